"""One campaign's residuals with all candidates' columns, ready to be searched."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.gap.calibration_doubt import doubt_columns
from core.gap.design import Design, candidate_columns
from core.gap.doings import Doings
from core.gap.effects.candidate import Candidate, Column
from core.gap.effects.structure import geometry_slots
from core.gap.evidence import Evidence
from core.gap.gram import Gram, gram, whitened
from core.gap.observations import Observations
from core.gap.placement import placement_priors, placement_slots
from core.gap.sim import Sim, Slot
from core.gap.whitening import Whitening
from core.geometry import Array

FREE = 10.0
"""Prior of base and unknown targets, rad and m: none."""
KNOWN = 1e-9
"""Prior of geometry that is taken as known, rad and m."""
NULL_DRAWS, NULL_SEED = 60, 11


@dataclass(frozen=True, eq=False)
class Problem:
    """Columns of placement, geometry and candidates; residuals of the placed sim; noise."""

    sim: Sim
    doings: Doings
    candidates: tuple[Candidate, ...]
    design: Design
    slices: tuple[slice, ...]
    placement: int
    """The first so many columns place base and targets."""
    geometry: int
    """So many after them change the geometry of the sim."""
    doubt: int
    """The last so many of those are errors that a calibrated sim knows it may have, in their standard deviations."""
    placement_prior: Array
    residual_m: Array
    """Real minus sim, (m, 3)."""
    white: Whitening
    sums: Gram

    @property
    def nuisance(self) -> int:
        return self.placement + self.geometry

    def nuisance_precision(self, geometry_prior: float) -> Array:
        """Prior precision of placement and of geometry known to so much, rad and m."""
        free = 1 / np.minimum(self.placement_prior, FREE) ** 2
        own = np.full(self.geometry, 1 / geometry_prior**2)
        if geometry_prior > KNOWN:
            own[self.geometry - self.doubt :] = 1.0
        return np.concatenate([free, own])

    def evidence(self, geometry_prior: float) -> Evidence:
        return Evidence(self.sums, self.nuisance, self.nuisance_precision(geometry_prior))

    def nuisance_columns(self, seen: Observations) -> list[Column]:
        """The nuisance columns over other points of the same arm."""
        return _nuisance([column[0][0] for column in self.design.columns[: self.nuisance - self.doubt]], seen)

    @cached_property
    def cost(self) -> Array:
        """What having been chosen from several atoms costs each candidate in log evidence."""
        return np.log([candidate.choices for candidate in self.candidates])

    def width(self, candidate: int) -> int:
        """Number of columns of a candidate."""
        return self.slices[candidate].stop - self.slices[candidate].start

    @cached_property
    def named(self) -> np.ndarray:
        return np.array([k for k, c in enumerate(self.candidates) if c.named], dtype=int)

    @cached_property
    def nameless(self) -> np.ndarray:
        return np.array([k for k, c in enumerate(self.candidates) if not c.named], dtype=int)


def pose_problem(
    sim: Sim, doings: Doings, candidates: Sequence[Candidate], residual_m: Array, white: Whitening
) -> Problem:
    """The columns of all candidates over the points, scaled so that one is one noise standard deviation rms."""
    placement = placement_slots(sim.seen)
    slots = [*placement, *geometry_slots(doings)]
    nuisance = _nuisance(slots, sim.seen)
    columns, sizes, slices = candidate_columns(candidates, doings)
    start = len(nuisance)
    own = tuple(slice(s.start + start, s.stop + start) for s in slices)
    scale = np.concatenate([np.ones(start), sizes])
    design = Design(sim, (*nuisance, *columns), scale)
    whole = whitened(design, white)
    unit = _units(whole, own, 3 * int(np.count_nonzero(white.weight)))
    # In place: nobody else holds these columns, and they are large.
    whole *= unit[:, None]
    return Problem(
        sim,
        doings,
        tuple(candidates),
        Design(sim, design.columns, scale * unit),
        own,
        len(placement),
        start - len(placement),
        start - len(slots),
        placement_priors(sim.seen, placement),
        residual_m,
        white,
        gram(whole, own, residual_m, white, NULL_DRAWS, NULL_SEED),
    )


def _nuisance(slots: Sequence[Slot], seen: Observations) -> list[Column]:
    """One column for each small motion that is the same at every point, and what a calibration knows it may err by."""
    ones = np.ones(seen.count)
    return [*([(slot, ones)] for slot in slots), *doubt_columns(seen)]


def _units(columns: Array, slices: Sequence[slice], count: int) -> Array:
    """Factors that make the columns (p, 3 m) of each group one noise standard deviation rms over the components."""
    energy = np.einsum("pn,pn->p", columns, columns)
    unit = np.ones(len(energy))
    for group in slices:
        unit[group] = 1 / np.sqrt(max(energy[group].mean() / max(count, 1), 1e-300))
    return unit
