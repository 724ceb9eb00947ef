"""Campaigns of arms with a known hidden effect, and the score of what a diagnosis says of them.

Written apart from the diagnosis: the kinematics, loads and formulas of this package are its own, finite (exactly
composed, non-linear) and on purpose other members of each family than a diagnosis would fit. Nothing here imports
``core.gap`` but the scoring, which calls it as a user would.
"""
