"""``trueaxis axis``: one joint axis from a plain CSV of points, nothing else needed."""

import argparse
from pathlib import Path

import numpy as np

from app.standard_output import print_json
from app.summary import axis_summary
from core.axes import ESTIMATORS, AxisFit, fit_axis
from core.axis_json import axis_to_json
from core.errors import AxisUndefined, InputError
from core.points_file import PlainSweep, read_points

COLUMNS = """columns of POINTS.csv, units in their names:
  x_mm, y_mm, z_mm   the measured points (or _m)
  q_deg              commanded displacement of the joint (_rad; _mm, _m where it slides); optional
  target             a name, where several targets were seen; optional
  step               number of the standstill, where several targets were seen at each; optional
  sigma_mm           standard deviation of one coordinate of the point; optional"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("points", type=Path, metavar="POINTS.csv", help="points measured while one joint moved")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.add_argument("--slides", action="store_true", help="the joint slides (known already if q is in mm or m)")
    parser.add_argument(
        "--estimator", choices=ESTIMATORS, default="likelihood", help="of the axis (default: likelihood)"
    )
    parser.add_argument("--keep-all", action="store_true", help="fit points that stand out as well")
    parser.epilog = COLUMNS


def run(arguments: argparse.Namespace) -> None:
    """Find the axis and print it.

    Raises:
        InputError: the file cannot be used, or its points do not define an axis.
    """
    sweep = read_points(arguments.points)
    _require_agreement(arguments.points, sweep, arguments.slides)
    try:
        fit = _fit(sweep, arguments)
    except AxisUndefined as error:
        raise AxisUndefined(f"{arguments.points}: {error}") from None
    if arguments.json:
        print_json(axis_to_json(sweep, fit))
    else:
        print(axis_summary(str(arguments.points), sweep, fit))


def _fit(sweep: PlainSweep, arguments: argparse.Namespace) -> AxisFit:
    return fit_axis(
        sweep.point_m,
        sliding=bool(sweep.sliding) or arguments.slides,
        estimator=arguments.estimator,
        target=sweep.target,
        stop=sweep.stop,
        sigma_m=sweep.sigma_m,
        commanded=sweep.commanded,
        reject=not arguments.keep_all,
    )


def _require_agreement(path: Path, sweep: PlainSweep, slides: bool) -> None:
    if slides and sweep.sliding is False:
        raise InputError(f"{path}: q is an angle, expected a length (q_mm) for a joint that slides")
    if sweep.sigma_m is not None and np.isnan(sweep.sigma_m).any():
        raise InputError(f"{path}: sigma stands in some rows only, expected it in every row or in none")
