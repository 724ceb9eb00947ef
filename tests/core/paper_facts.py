"""Numbers as they are printed in the paper (Sultan and Wager: an ASEA IRB L6/2 with dependent joints).

Lengths in metres, angles in degrees unless a name says otherwise. Minus signs were lost in the text at hand. Those of
the axis lines are the only ones, of all sign patterns, with which the lines give table 2.
"""

import numpy as np

TABLE_1 = {
    "axis": (6, 5, 4, 3, 2, 1),
    "span_deg": (50, 60, 90, 45, 45, 48),
    "intervals": (16, 15, 15, 15, 15, 15),
    "points": (17, 16, 32, 16, 32, 16),
    "extra_point": (False, False, True, False, True, False),
}

PHI_DEG = np.array([90.0, 0.0, 0.0, 0.0, 0.0])

NOMINAL_A_M = np.array([0.0, -0.690, -0.670, 0.0, 0.0])
NOMINAL_B_M = np.array([0.0, 0.0, 0.0, 0.0, -0.2325])
NOMINAL_ALPHA_DEG = np.array([90.0, 90.0, 90.0, 90.0, 90.0])
NOMINAL_THETA_DEG = np.array([-90.0, -180.0, -180.0, -90.0, -90.0])

ACTUAL_A_M = np.array([0.00232, -0.6931, -0.6727, -0.0007, -0.0039])
ACTUAL_B_M = np.array([0.0, 0.00487, 0.00162, 0.00297, -0.2331])
ACTUAL_ALPHA_DEG = np.array([90.0, 89.828, 90.4213, 89.8033, 89.4829])
ACTUAL_THETA_DEG = np.array([-90.378, -179.54, -179.99, -89.921, -90.137])

AXIS_POINTS_M = np.array(
    [
        [-3.1423, 4.4394, -0.526123],
        [-3.1352, 4.4442, -0.5293],
        [-3.1367, 4.4388, 0.1638],
        [-3.1367, 5.1116, 0.16354],
        [-3.14308, 4.44598, 0.16303],
        [-3.1565, 5.3466, -0.52353],
    ]
)
"""A point on each axis, in the frame of the left-hand theodolite."""
AXIS_DIRECTIONS = np.array(
    [
        [0.001445, 0.002876, 0.999995],
        [0.999898, 0.013323, 0.0051096],
        [0.999983, 0.00537, 0.002136],
        [0.999917, 0.012724, 0.002198],
        [-0.014096, 0.99990, 0.000597],
        [-0.006872, 0.002904, -0.999972],
    ]
)

MISPRINTED_P20_Y_M = 4.4442
P20_Y_M = 4.4418
"""The y of the point on axis 2 with which both a_1 and b_2 come out as printed."""
MISPRINTED_A4_M = -0.0007
A4_M = -0.00008
"""What the axis lines give: a zero was lost in print."""

FOUR_BAR_NUMERATOR = (-0.998132, 0.213253, -0.212863)
"""Factors of sin, cos and 1."""
FOUR_BAR_DENOMINATOR = (1.0, 0.096654, 0.0006941)
"""Factors of cos, sin and 1."""
GEAR_RATIO = 32 / 19
TRANSMISSIONS = {1: (0.000771, 0.000007), 2: (0.001094, 0.001317), 3: (0.003462, 0.000867), 6: (0.017334, 0.002677)}
"""commanded = actual + s sin(actual) + c cos(actual), by joint."""
TRANSMISSION_5 = (0.041227, 0.000013)
"""At the bevel gear: commanded = actual / N + s sin(actual / N) + c cos(actual / N)."""
COUPLING_4_TO_5 = (0.040562, 0.000018)
"""passive = N actual + s sin(N actual) + c cos(N actual)."""

THEODOLITE_NET_RADIAL_ERROR_MM = 0.19
REPEATABILITY_RADIAL_MM = 0.34
REPEATABILITY_ORIENTATION_RAD = 0.0033
UNCALIBRATED_POSITION_MM, UNCALIBRATED_ORIENTATION_RAD = 47.00, 0.05
"""Mean errors of the nominal model over the test positions."""

DISTANCE_2_TO_3_WIDER_MM = 3.3
OUT_OF_PARALLEL_WITH_AXIS_1_DEG = 0.37
DISKS_ON_AXIS_4_WIDE_MM = 2.9
"""What the paper's report reads out of table 2."""
