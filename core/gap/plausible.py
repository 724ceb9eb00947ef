"""Whether the numbers of a name are such as its effect has: free forms also fit what their effects never make.

A hysteresis that is lost at once is play; steps of encoders are whole; play that runs ahead of its motor is none, nor
is what never changes side; a frame that is off by a turn about the next axis is a zero offset; an axis whose tilts and
shifts nearly cancel does not wobble. Where the library has the plainer name, that name is the more probable one
anyway. Where it has not, something without a name acts.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import lgamma

import numpy as np

from core.gap.effects.candidate import Candidate
from core.gap.effects.structure import LINK_AXES
from core.gap.evidence import SIZES, Chosen, Evidence
from core.gap.problem import Problem
from core.geometry import Array
from core.robot import Robot

AGAINST = frozenset({"backlash", "hysteresis", "compliance"})
"""What loses motion lags behind, and what gives way gives way to the load: its first number is not negative."""
BENDS = frozenset({"compliance", "flexure"})
UNWEIGHED = 0.3
"""What gives way under what it carries does so under its own weight too: a share below which it does not."""
SURELY = 3.0
"""Standard deviations."""
GRADUALLY = 0.7
"""Of all that a joint loses at last: a hysteresis loses less at once."""
WHOLE = (0.8, 1.25)
"""Shares of an encoder's steps that are still whole ones: a share of others may look alike at even distances."""
MERELY = 0.98
"""Of what a frame moves: where a turn about one axis does so much, it is that turn."""
CANCELLING, DRAWS, SEED = 0.05, 4000, 17
"""So few of random numbers of the same size move points so little."""
IDLE = 7.0
"""Log evidence that is gained where most numbers are taken to be small."""


@dataclass(frozen=True, eq=False)
class Own:
    """One candidate among others."""

    candidate: Candidate
    scale: Array
    """SI units of its columns, (w,)."""
    size: float
    square: Array
    """Products of its columns without what the others explain, (w, w)."""
    pull: Array
    """(w,)"""
    constant: bool = False
    """Whether it moves its joint by the same at every point."""

    @cached_property
    def covariance(self) -> Array:
        return np.linalg.inv(self.square + np.eye(len(self.pull)) / self.size**2)

    @cached_property
    def numbers(self) -> Array:
        """In the units of the columns, (w,)."""
        return self.covariance @ self.pull

    @cached_property
    def values(self) -> dict[str, float]:
        """In SI units by name."""
        return dict(zip(self.candidate.names, (self.numbers * self.scale).tolist(), strict=True))


def own(problem: Problem, evidence: Evidence, group: int, size: float, others: Chosen) -> Own:
    """A candidate with what it adds to others."""
    _, square, pull = next(evidence.conditioned(np.array([group]), others))
    columns = problem.design.columns[problem.slices[group]]
    constant = all(np.ptp(feature) == 0 for column in columns for _, feature in column)
    scale = problem.design.scale[problem.slices[group]]
    return Own(problem.candidates[group], scale, size, square[0], pull[0], constant)


def plausible(one: Own, chain: Robot) -> bool:
    """Whether the numbers are such as the effect has."""
    effect = one.candidate.place.effect
    if effect in AGAINST and one.numbers[0] < 0 and one.pull[0] < -SURELY * np.sqrt(max(one.square[0, 0], 0.0)):
        return False
    if effect == "backlash" and one.constant:
        return False
    if effect in BENDS and _weightless(one):
        return False
    if effect == "linkage":
        return not _is(one, np.array([float(name.startswith("offset")) for name in one.candidate.names]))
    if effect == "hysteresis":
        return _grows(one)
    if effect == "quantisation":
        return bool(WHOLE[0] < one.numbers[0] * one.scale[0] < WHOLE[1])
    if effect == "geometry":
        return not _turns_merely(one, chain)
    return effect != "axis_wobble" or not (_cancels(one) or _errs_along(one, chain))


def _grows(one: Own) -> bool:
    """Whether motion is lost over some way, or more of it under load, never less: what is lost at once is play."""
    at_once = sum(v for name, v in one.values.items() if name.startswith(("loss", "not_yet")))
    whole = one.numbers[0] * one.scale[0]
    with_load = sum(v for name, v in one.values.items() if name.startswith("with_load"))
    enough = (1 - GRADUALLY) * whole
    return with_load > -enough and (at_once < GRADUALLY * whole or with_load > enough)


def _turns_merely(one: Own, chain: Robot) -> bool:
    """Whether a frame is off by no more than a turn about the axis of the next joint."""
    link = one.candidate.place.frame - 1
    if chain.sliding[link + 1]:
        return False
    axis, origin = chain.link_transforms[link][:3, 2], chain.link_transforms[link][:3, 3]
    return _is(one, np.concatenate([axis, np.cross(origin, axis)])[list(LINK_AXES)] / one.scale)


def _errs_along(one: Own, chain: Robot) -> bool:
    """Whether a guide is off along its way alone: that is the drive's."""
    if not chain.sliding[one.candidate.place.joint - 1]:
        return False
    along = [k for k, name in enumerate(one.candidate.names) if name.startswith("shift_along_z")]
    return bool(along) and _is(one, np.eye(len(one.numbers))[:, along])


def _is(one: Own, directions: Array) -> bool:
    """Whether the numbers move points as those of some directions (w,) or (w, k) do, up to a little or to noise."""
    basis = directions.reshape(len(one.numbers), -1)
    moved = one.square @ one.numbers
    pull, inner = basis.T @ moved, basis.T @ one.square @ basis
    alike = float(pull @ np.linalg.lstsq(inner, pull, rcond=None)[0])
    whole = float(one.numbers @ moved)
    return whole - alike < max((1 - MERELY) * whole, SURELY**2)


def _weightless(one: Own) -> bool:
    """Whether what bends the most bends under what is carried alone."""
    names = one.candidate.names
    moved = dict(zip(names, one.numbers**2 * np.diag(one.square), strict=True))
    most = max((name for name in moved if name.startswith("give_")), key=lambda name: moved[name])
    give, own_weight, link_weight = one.values[most], f"own_weight_{most}", f"link_weight_{most}"
    itself = give + one.values.get(own_weight, 0.0)
    if link_weight in names:
        # What lies beyond a link and the link itself hang on it alike: one may stand in for the other.
        own, link = (one.square[k, k] / one.scale[k] ** 2 for k in map(names.index, (own_weight, link_weight)))
        itself += one.values[link_weight] * np.sqrt(link / max(own, 1e-300))
    return bool(abs(itself) < UNWEIGHED * abs(give))


def gives_at_one_joint(one: Own) -> bool:
    """Whether a load that nobody wrote down shows at one joint alone, which gives way as it would under any load."""
    if one.candidate.place.effect != "payload":
        return False
    gives = np.array([name.startswith("give_of_joint") for name in one.candidate.names])
    moved = one.numbers**2 * np.diag(one.square)
    most = int(np.argmax(np.where(gives, moved, -1.0)))
    return bool(one.numbers[most] > 0 and moved[most] > MERELY * moved.sum())


def _cancels(one: Own) -> bool:
    """Whether the numbers move points far less than random ones of their size would."""
    draws = np.random.default_rng(SEED).standard_normal((DRAWS, len(one.numbers)))
    moved = np.einsum("di,di->d", draws @ one.square, draws) / np.sum(draws**2, axis=1)
    mine = float(one.numbers @ one.square @ one.numbers) / max(float(one.numbers @ one.numbers), 1e-300)
    return float(np.mean(moved <= mine)) < CANCELLING


def mostly_idle(one: Own) -> bool:
    """Whether most of the numbers do next to nothing, so that something plainer would do as well.

    Frames are often off by one number alone, and axes wobble once a turn.
    """
    width = len(one.numbers)
    if width < 2 or one.candidate.place.effect in ("geometry", "axis_wobble"):
        return False
    alike = max(_log_evidence(one, np.full(width, size)) - _hyper(size) for size in SIZES)
    order = np.argsort(-np.abs(one.numbers))
    best = -np.inf
    for many in range(1, width):
        ways = lgamma(width + 1) - lgamma(many + 1) - lgamma(width - many + 1)
        great, small = (float(np.sqrt(np.mean(one.numbers[part] ** 2))) for part in (order[:many], order[many:]))
        for size, rest in product(_near(great), _near(small)):
            sizes = np.where(np.isin(np.arange(width), order[:many]), size, min(rest, size))
            best = max(best, _log_evidence(one, sizes) - _hyper(size) - _hyper(rest) - ways)
    return best - alike > IDLE


def _near(size: float) -> Array:
    """Scales of the grid next to a size."""
    return SIZES[np.argsort(np.abs(np.log(SIZES / max(size, 1e-12))))[:2]]


def _hyper(size: float) -> float:
    return float(0.5 * np.log10(size) ** 2)


def _log_evidence(one: Own, sizes: Array) -> float:
    inner = one.square + np.diag(sizes**-2.0)
    occam = np.linalg.slogdet(inner)[1] + 2 * float(np.sum(np.log(sizes)))
    return float(0.5 * (one.pull @ np.linalg.solve(inner, one.pull) - occam))
