"""What a plan is worth: the paper's table 1 against sweeps and free poses that the planner places, shot for shot.

Same arm, same theodolites, noise in every shot, limits and rule of sight. Of each plan: what its Cramer-Rao bound
promises for the twelve test poses, and what calibrations of simulated campaigns come to, which have seen none of them.
"""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from core.measurements import SWEEP, Measurements
from core.planning.expected_error import mean_lengths
from core.planning.mounts import with_bar
from core.planning.pose_plan import pose_pool
from core.planning.proposal import (
    Proposal,
    indices_of,
    least_of,
    poses_that_matter,
    propose,
    saving,
    shown_by,
    swept_ranges,
)
from core.planning.shots import pose_rows
from core.planning.site import Site
from core.planning.site_makers import narrowed
from core.twin import irb_l6
from tests.benchmarks.planned_cell import (
    bound,
    calibrated,
    drawn_site,
    errors_of,
    measured,
    table_1,
    true_site,
)
from tests.benchmarks.tables import markdown

SHOTS = 129
SEEDS = 100
PLAN_SEED = 1
BAR_M = 0.3
SECONDS_A_SHOT = irb_l6.protocol().seconds_a_shot


@dataclass(frozen=True)
class Plan:
    """Shots with a name, and the site that they are planned on."""

    name: str
    site: Site
    rows: Measurements
    seconds: float = 0.0
    """That planning took."""

    @property
    def shots(self) -> int:
        return int(np.count_nonzero((self.rows.target >= 0) & ~self.rows.check))


@dataclass(frozen=True)
class Worth:
    """Mean errors over the test poses, m and rad."""

    plan: Plan
    bound_m: float
    found_m: float
    found_std_m: float
    """Standard uncertainty of ``found_m`` by the number of campaigns."""
    bound_rad: float
    found_rad: float
    visit_m: float
    """With the arm's repeatability on the day, as a test pose would be measured without noise."""


def plans() -> list[Plan]:
    """Table 1, and what is planned in its place."""
    site, table = drawn_site(), table_1()
    near = narrowed(site, commanded_ranges(table))
    out = [Plan("table 1 of the paper", site, table)]
    for name, kind, shots, own in (
        ("planned sweeps", "sweeps", SHOTS, site),
        ("planned sweeps, commands within those of table 1", "sweeps", SHOTS, near),
        ("planned sweeps, targets on a bar of 2 x 300 mm too", "sweeps", SHOTS, with_bar(site, BAR_M)),
        ("planned sweeps, fewest shots", "sweeps", least_of(site, "sweeps"), site),
        ("planned free poses", "poses", SHOTS, site),
        ("planned free poses, commands within those of table 1", "poses", SHOTS, near),
        ("planned free poses, fewest shots", "poses", least_of(site, "poses"), site),
    ):
        start = perf_counter()
        proposal = proposed(own, kind, shots)
        out.append(Plan(name, own, proposal.rows, perf_counter() - start))
    return [*out, Plan("random free poses", site, random_poses(site, SHOTS, 0))]


def proposed(site: Site, kind: str, shots: int, criterion: str = "I") -> Proposal:
    """A plan for the poses within the ranges of table 1."""
    needed = poses_that_matter(site, swept_ranges(site, table_1()), PLAN_SEED)
    return propose(site, kind, shots, needed, PLAN_SEED, criterion)


def commanded_ranges(table: Measurements) -> dict[int, tuple[float, float]]:
    """The lowest and the highest command that each joint has in sweeps, rad."""
    commanded = table.commanded[table.phase == SWEEP]
    ends = zip(commanded.min(axis=0), commanded.max(axis=0), strict=True)
    return {joint: (float(low), float(high)) for joint, (low, high) in enumerate(ends, 1)}


def random_poses(site: Site, shots: int, seed: int) -> Measurements:
    """Any poses that can be taken and seen."""
    return pose_rows(*pose_pool(site, shots, np.random.default_rng(seed)))


def worth(plan: Plan, seeds: int) -> Worth:
    """What a plan's bound promises and what its calibrations come to."""
    promised = bound(plan.rows, plan.site)
    found = [errors_of(calibrated(measured(plan.site, plan.rows, seed))) for seed in range(seeds)]
    position = np.array([errors.position_m for errors in found])
    again = np.random.default_rng(0).normal(size=(seeds, *found[0].shift_m.shape)) * plan.site.repeats.link_sigma_m
    visits = np.linalg.norm(np.array([errors.shift_m for errors in found]) + again, axis=2)
    return Worth(
        plan=plan,
        bound_m=promised.mean_position_m,
        found_m=float(position.mean()),
        found_std_m=float(position.std(ddof=1) / np.sqrt(seeds)) if seeds > 1 else np.nan,
        bound_rad=promised.mean_orientation_rad,
        found_rad=float(np.mean([errors.orientation_rad for errors in found])),
        visit_m=float(visits.mean()),
    )


def worth_table(seeds: int) -> str:
    """All plans, measured and calibrated."""
    worths = [worth(plan, seeds) for plan in plans()]
    first = worths[0]
    rows = [
        (
            w.plan.name,
            str(w.plan.shots),
            f"{w.plan.shots * SECONDS_A_SHOT / 60:.0f}",
            f"{w.bound_m * 1e3:.3f}",
            f"{w.found_m * 1e3:.3f} ± {w.found_std_m * 1e3:.3f}",
            f"{first.bound_m / w.bound_m:.1f}",
            f"{first.found_m / w.found_m:.1f}",
            f"{w.bound_rad * 1e3:.2f}",
            f"{w.found_rad * 1e3:.2f}",
            f"{w.visit_m * 1e3:.3f}",
            f"{w.plan.seconds:.1f}" if w.plan.seconds else "-",
        )
        for w in worths
    ]
    floor = float(mean_lengths(drawn_site().repeats.link_sigma_m ** 2 * np.eye(3)[None])[0])
    rows.append(("a perfect model", "-", "-", "0", "0", "-", "-", "0", "0", f"{floor * 1e3:.3f}", "-"))
    header = (
        *("plan", "shots", "min", "bound, mm", f"mean of {seeds}, mm", "better by the bound", "better, measured"),
        *("bound, mrad", "mean, mrad", "with repeatability, mm", "planned in, s"),
    )
    return markdown(header, rows)


def saving_table() -> str:
    """Measuring time that plans save for the accuracy of table 1."""
    site, rows = drawn_site(), []
    needed = poses_that_matter(site, swept_ranges(site, table_1()), PLAN_SEED)
    for kind in ("sweeps", "poses"):
        proposal = proposed(site, kind, SHOTS)
        saved = saving(proposal, needed, table_1(), SECONDS_A_SHOT)
        repeats = (saved.baseline.mean_position_m / proposal.expected.mean_position_m) ** 2
        rows.append(
            (
                kind,
                str(saved.equal_shots),
                f"{saved.seconds / 60:.0f}",
                f"{(repeats - 1) * SHOTS * SECONDS_A_SHOT / 3600:.0f}",
            )
        )
    header = (
        *("planned", "fewest shots at least as exact as table 1", "min saved"),
        f"h that table 1 takes more, repeated until as exact as {SHOTS} planned shots",
    )
    return markdown(header, rows)


def index_table() -> str:
    """Observability indices of as many shots each."""
    site = drawn_site()
    sets = {
        "table 1 (coupling 3 to 4 held)": table_1(),
        "planned sweeps, I": proposed(site, "sweeps", SHOTS).rows,
        "random free poses": random_poses(site, SHOTS, 0),
        "free poses, D": proposed(site, "poses", SHOTS, "D").rows,
        "free poses, I": proposed(site, "poses", SHOTS).rows,
    }
    rows = []
    for name, table in sets.items():
        found = indices_of(shown_by(true_site(), table), table)
        figures = (found.o1, found.o2, found.o3, found.o4, found.o5, found.condition)
        rows.append((name, *(f"{value:.3g}" for value in figures), f"{bound(table).mean_position_m * 1e3:.3f}"))
    return markdown(("shots", "O1", "O2", "O3", "O4", "O5", "condition", "bound, mm"), rows)


def report(seeds: int = SEEDS) -> str:
    """All tables."""
    return "\n\n".join(
        (
            f"Mean errors over the twelve test poses, simulated: {SHOTS} shots of table 1 against planned ones, "
            f"{seeds} campaigns each.",
            worth_table(seeds),
            saving_table(),
            index_table(),
        )
    )
