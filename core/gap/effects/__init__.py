"""Every effect that a diagnosis knows, one family a file, and nameless stand-ins for those that it does not."""
