"""``python -m tests.benchmarks WHAT``: a table in Markdown, the same numbers every time but for times."""

import os

# Before numpy is imported: one thread, so that times compare.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import argparse  # noqa: E402
import sys  # noqa: E402


def main() -> None:
    """Print the table that was asked for."""
    if sys.argv[1:2] == ["withheld"]:
        from tests.benchmarks.withheld.command import main as withheld

        return withheld(sys.argv[2:])
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("what", choices=("axes", "speed", "poses", "planning", "dashboard", "sessions", "gap"))
    parser.add_argument("--sweeps", type=int, default=4000, help="simulated sweeps for each row of 'axes'")
    parser.add_argument("--poses", type=int, default=100_000, help="random poses for 'poses'")
    parser.add_argument("--seeds", type=int, default=100, help="simulated campaigns for each plan of 'planning'")
    asked = parser.parse_args()
    if asked.what == "axes":
        from tests.benchmarks.axis_efficiency import table

        print(table(asked.sweeps))
    elif asked.what == "poses":
        from tests.benchmarks.compensation_speed import report as of_poses

        print(of_poses(asked.poses))
    elif asked.what == "planning":
        from tests.benchmarks.planning import report as of_planning

        print(of_planning(asked.seeds))
    elif asked.what == "sessions":
        from tests.benchmarks.session_speed import report as of_sessions

        print(of_sessions())
    elif asked.what == "gap":
        from tests.benchmarks.gap_speed import report as of_gap

        print(of_gap())
    elif asked.what == "dashboard":
        from tests.benchmarks.dashboard import report as of_dashboard

        print(of_dashboard())
    else:
        from tests.benchmarks.axis_speed import report

        print(report())


if __name__ == "__main__":
    main()
