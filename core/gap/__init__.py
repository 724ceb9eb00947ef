"""The gap between a simulated arm and the real one: where it lies, which effect causes it, how far it shrinks."""
