"""Where the edges of an encoder's steps lie, as well as the points on either side of them tell.

Any size and phase that leaves every point on its side of every edge fits as well as any other. The middle of all of
them is likely to put the fewest new points on the wrong side; an end of them, twice as many.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from core.gap.effects import drives
from core.geometry import Array

SHARES, NEARLY = (0.3, 1.6), 0.1
"""Of steps that errors may show; and standard deviation, in logarithms, of that of whole ones: where a joint stood at
even distances, shares of steps of many sizes look alike."""
PHASES, PHASES_AROUND = np.arange(32) / 32, 17
WIDEST, TRIED, ROUNDS, SPREAD = 0.08, 17, 3, 3.0
"""Shares of a step by which edges are moved, at the ends and in the middle; moves tried on either side of none, and
rounds, each about the mean of the last one and as wide as so many of its standard deviations."""


def whole(share: Array) -> Array:
    """What steps count of which the errors show a share: all where it is one, less and less where it is not."""
    return np.exp(-0.5 * (np.log(np.maximum(share, 1e-9)) / NEARLY) ** 2)


def possible(share: Array) -> np.ndarray:
    """Whether errors may show such a share of steps of which other causes took up a part."""
    return (share > SHARES[0]) & (share < SHARES[1])


@dataclass(frozen=True, eq=False)
class JointErrors:
    """Where one joint stood, and what its errors were, as well as each point tells them."""

    x: Array
    """rad or m, (m,)"""
    strength: Array
    """Weights of the errors, (m,)."""
    error: Array
    """Weighted errors, (m,)."""

    @cached_property
    def ends(self) -> tuple[float, float]:
        """The least and the largest x of all points that count."""
        told = self.x[self.strength > 0]
        return float(told.min()), float(told.max())

    @cached_property
    def _mean(self) -> Array:
        """Shares of the points in a weighted mean."""
        return self.strength / self.strength.sum()

    def explained(self, steps: Array, phases: Array) -> Array:
        """Energy that steps of each size and phase (k,) explain; 0 where a share of them does that is far from one."""
        energy, share = self.shares(steps, phases)
        return np.where(possible(share), energy, 0.0)

    def shares(self, steps: Array, phases: Array) -> tuple[Array, Array]:
        """Energy that steps of each size and phase (k,) explain, and the share of them that does."""
        teeth = drives.teeth(self.x / steps[:, None] - phases[:, None])
        mean = teeth @ self._mean
        pull = teeth @ self.error - mean * self.error.sum()
        teeth *= teeth
        square = np.maximum(teeth @ self.strength - mean**2 * self.strength.sum(), 1e-300)
        return pull**2 / square, pull / square / steps

    def energy(self, step: float, phase: float) -> float:
        """What steps of one size and phase explain."""
        return float(self.explained(np.array([step]), np.array([phase]))[0])

    def sharp_phase(self, step: float) -> float:
        """The best phase of steps of a size, as finely as points can tell."""
        phases, width = PHASES, 1 / len(PHASES)
        for _ in range(3):
            best = phases[int(np.argmax(self.explained(np.full(len(phases), step), phases)))]
            phases = np.append(best, best + width * np.linspace(-1, 1, PHASES_AROUND))
            width /= 8
        return float(best)

    @property
    def merged(self) -> "JointErrors":
        """The same with all points at one place as one: steps are the same for them, and arms stand long at some."""
        x, which = np.unique(self.x, return_inverse=True)
        return JointErrors(x, np.bincount(which, self.strength, len(x)), np.bincount(which, self.error, len(x)))

    def within(self, step: float) -> "JointErrors":
        """The same, none of them larger than a step: no outlier counts for more."""
        most = step * self.strength
        return replace(self, error=np.clip(self.error, -most, most))


def settled(errors: Sequence[JointErrors], step: float, phases: Sequence[float]) -> tuple[float, list[float]]:
    """The mean of all sizes and phases near given ones, by how well they explain the errors of joints of one size.

    Args:
        errors: of each joint.
        step: rad or m.
        phases: of each joint, shares of a step.

    Returns:
        Size and phases.
    """
    out = list(phases)
    told = [k for k, one in enumerate(errors) if np.count_nonzero(one.strength) and one.ends[1] > one.ends[0]]
    if not told:
        return step, out
    middle = np.array([sum(errors[k].ends) / 2 for k in told])
    teeth = max(errors[k].ends[1] - errors[k].ends[0] for k in told) / step
    around = np.linspace(-1, 1, TRIED)
    widths = np.full(1 + len(told), WIDEST)
    moves = np.zeros(1 + len(told))
    """Of the edges at the ends of the longest way, and of those in the middle of each joint's way."""
    for _ in range(ROUNDS):
        ends = moves[0] + widths[0] * around
        sizes = step / (1 + 2 * ends / teeth)
        each = [moves[1 + j] + widths[1 + j] * around for j in range(len(told))]
        energy = [
            _energy(errors[k], middle[j], step, phases[k], sizes, each[j]).reshape(TRIED, TRIED) / 2
            for j, k in enumerate(told)
        ]
        weight = _shares(sum(logsumexp(one, axis=1) for one in energy))
        found = [(ends, weight)]
        found += [(each[j], weight @ _shares(energy[j], axis=1)) for j in range(len(told))]
        moves = np.array([values @ share for values, share in found])
        spread = np.array([np.sqrt(share @ (values - values @ share) ** 2) for values, share in found])
        widths = np.minimum(np.maximum(SPREAD * spread, 2 * widths / (TRIED - 1)), WIDEST)
    size = step / (1 + 2 * moves[0] / teeth)
    for j, k in enumerate(told):
        out[k] = float((middle[j] / size - middle[j] / step + phases[k] - moves[1 + j]) % 1.0)
    return float(size), out


def _energy(errors: JointErrors, middle: float, step: float, phase: float, sizes: Array, moves: Array) -> Array:
    """Energy of every size with every move of the edge in the middle, (sizes * moves,)."""
    each = np.repeat(sizes, len(moves))
    return errors.explained(each, middle / each - middle / step + phase - np.tile(moves, len(sizes)))


def _shares(logs: Array, axis: int | None = None) -> Array:
    return np.exp(logs - logsumexp(logs, axis=axis, keepdims=True))
