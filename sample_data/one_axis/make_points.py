"""Makes points.csv: a laser tracker looks at one target while one joint turns. Nothing in it was measured.

python sample_data/one_axis/make_points.py > sample_data/one_axis/points.csv
"""

import numpy as np

AXIS_POINT_MM = np.array([2150.0, -640.0, 810.0])
AXIS_TILTS_RAD = (0.012, -0.021)
RADIUS_MM = 742.0
ECCENTRICITY_RAD = 0.0004
SIGMA_MM = 0.025
FIRST_DEG, LAST_DEG, COUNT = -30.0, 30.0, 21


def main() -> None:
    """Print the file."""
    direction = np.array([*AXIS_TILTS_RAD, 1.0]) / np.linalg.norm([*AXIS_TILTS_RAD, 1.0])
    across = np.cross(direction, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    commanded = np.deg2rad(np.linspace(FIRST_DEG, LAST_DEG, COUNT))
    turned = (commanded - ECCENTRICITY_RAD * np.sin(commanded))[:, None]
    circle = np.cos(turned) * across + np.sin(turned) * np.cross(direction, across)
    points = AXIS_POINT_MM + RADIUS_MM * circle + np.random.default_rng(1).normal(scale=SIGMA_MM, size=(COUNT, 3))
    print("q_deg,x_mm,y_mm,z_mm")
    for command, point in zip(commanded, points, strict=True):
        print(",".join([f"{np.rad2deg(command):.3f}", *(f"{value:.4f}" for value in point)]))


if __name__ == "__main__":
    main()
