"""The numerics of trueaxis: from measured points to joint axes, error functions and arm parameters.

Everything in here is in metres, radians, kilograms and seconds; files and pages convert at the edge.
"""
