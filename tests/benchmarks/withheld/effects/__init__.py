"""The hidden effects, one family a file, each with parameters drawn once and applied to any session of its arm."""
