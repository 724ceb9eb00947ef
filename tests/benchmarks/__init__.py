"""Measurements of accuracy and speed, each made by one command: ``python -m tests.benchmarks axes`` or ``speed``."""
