"""Joint axes from measured points."""
