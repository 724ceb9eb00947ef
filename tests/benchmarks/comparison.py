"""How near the calibration comes to the bound of its campaign, and how it compares with the literature's methods.

``python -m tests.benchmarks.comparison [--seeds N] [--only bound|methods]``: tables in Markdown.

Acceptance: over 100 seeds of table 1's campaign on the simulated arm, noise of instrument and arm in every shot, the
mean position error over the twelve kept-out positions after compensation is at most 1.1 times what the Cramer-Rao bound
of that campaign allows.
"""

import os

# Before numpy is imported: one thread, so that times compare.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import argparse  # noqa: E402
from dataclasses import dataclass  # noqa: E402

import numpy as np  # noqa: E402

from core.calibrated_arm import calibrated_arm  # noqa: E402
from core.calibration import calibrate  # noqa: E402
from core.compensation import compensate  # noqa: E402
from core.geometry import Array  # noqa: E402
from core.rivals.verdict import verdicts  # noqa: E402
from core.rotations import vectors_of_rotations  # noqa: E402
from core.twin import irb_l6  # noqa: E402
from core.twin.campaign import simulate_campaign  # noqa: E402
from core.twin.noise import Noise  # noqa: E402
from core.twin.trials import compare_on_twin  # noqa: E402
from tests.benchmarks.campaign_bound import CampaignBound  # noqa: E402
from tests.benchmarks.tables import markdown  # noqa: E402

SEEDS = 100
LARGEST_RATIO = 1.1
NOISES = (("instrument and arm", Noise()), ("instrument alone", Noise(repeatability=False)))


@dataclass(frozen=True, eq=False)
class Reached:
    """Errors of the compensated arm beside the bound."""

    bound: CampaignBound
    position_m: Array
    """Mean over the poses, one a seed."""
    orientation_rad: Array
    linear_position_m: Array
    """What the best linear estimator makes of the very same noise."""
    linear_orientation_rad: Array

    @property
    def position_ratio(self) -> float:
        """Reached over bound."""
        return float(self.position_m.mean() / self.bound.position_m)

    @property
    def orientation_ratio(self) -> float:
        return float(self.orientation_rad.mean() / self.bound.orientation_rad)


def reached(noise: Noise, seeds: int) -> Reached:
    """Calibrate, compensate and execute campaigns of many seeds."""
    cell = irb_l6.cell()
    bound = CampaignBound(cell, noise)
    true, rng = cell.truth, np.random.default_rng(11)
    wanted = true.base @ true.tool_poses(bound.commanded)
    own, linear = [], []
    for seed in range(seeds):
        measured = simulate_campaign(seed, cell, noise)
        ready = compensate(calibrated_arm(calibrate(measured)), wanted, bound.commanded, "instrument")
        if not ready.ok.all():
            raise RuntimeError(f"seed {seed}: {ready.status}")
        there = true.base @ true.tool_poses(ready.commanded)
        turn = vectors_of_rotations(there[:, :3, :3] @ np.swapaxes(wanted[:, :3, :3], 1, 2))
        visit = rng.normal(size=(len(wanted), 6)) * np.repeat([bound.repeatability_m, bound.repeatability_rad], 3)
        own.append(np.concatenate([there[:, :3, 3] - wanted[:, :3, 3], turn], axis=1) + visit)
        linear.append(visit - bound.linear_errors(measured))
    sizes = [np.linalg.norm(np.array(e).reshape(seeds, -1, 2, 3), axis=3).mean(axis=1) for e in (own, linear)]
    return Reached(bound, sizes[0][:, 0], sizes[0][:, 1], sizes[1][:, 0], sizes[1][:, 1])


def bound_table(seeds: int) -> str:
    """Reached errors over the bound, with both noises and with the instrument's alone."""
    rows = []
    for words, noise in NOISES:
        found = reached(noise, seeds)
        for what, unit, errors, linear, limit in (
            ("position", "mm", found.position_m, found.linear_position_m, found.bound.position_m),
            ("orientation", "mrad", found.orientation_rad, found.linear_orientation_rad, found.bound.orientation_rad),
        ):
            spread = errors.std(ddof=1) / np.sqrt(seeds) if seeds > 1 else np.nan
            rows.append(
                (
                    words,
                    f"{what}, {unit}",
                    f"{errors.mean() * 1e3:.3f} +- {spread * 1e3:.3f}",
                    f"{limit * 1e3:.3f}",
                    f"{errors.mean() / limit:.3f}",
                    f"{linear.mean() * 1e3:.3f}",
                    f"{errors.mean() / linear.mean():.3f}",
                )
            )
    header = ("noise", "mean error", "reached", "bound", "ratio", "best linear, same noise", "ratio")
    return markdown(header, rows)


def methods_table(seeds: int) -> str:
    """All methods, as ``trueaxis compare`` has them."""
    found = compare_on_twin(seeds)
    rows = [
        (
            row.name,
            str(row.drives),
            f"{row.points} {row.data}" if row.points else "",
            f"{row.position_m.mean * 1e3:.3f} +- {row.position_m.mean_std * 1e3:.3f}",
            f"{row.position_m.p95 * 1e3:.2f}",
            f"{row.position_m.max * 1e3:.2f}",
            f"{row.orientation_rad.mean * 1e3:.2f}",
            f"{row.length_error_m * 1e3:.3f}",
            f"{row.angle_error_rad * 1e3:.2f}",
            f"{row.seconds:.3f}",
            str(row.failed),
        )
        for row in found.rows
    ]
    rows += [
        (one.name, "", "", f"{one.position_m * 1e3:.3f}", "", "", f"{one.orientation_rad * 1e3:.2f}", "", "", "", "")
        for one in found.references
    ]
    header = ("method", "drives", "points", "position, mm", "p95", "max", "mrad", "a, b, mm", "alpha, theta, mrad", "s")
    return "\n\n".join([markdown((*header, "failed"), rows), *verdicts(found)])


def main() -> None:
    """Print what was asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.comparison", description=__doc__)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--only", choices=("bound", "methods"))
    asked = parser.parse_args()
    if asked.only != "methods":
        print(f"{asked.seeds} seeds; accepted: position with both noises at most {LARGEST_RATIO} times the bound\n")
        print(bound_table(asked.seeds), flush=True)
    if asked.only != "bound":
        print(f"\n{methods_table(asked.seeds)}")


if __name__ == "__main__":
    main()
