"""What a grid of candidates finds roughly, found sharply: the order of a mesh, the moment of a shift, encoder steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.gap.doings import Doings
from core.gap.effects import drives, instrument
from core.gap.effects.candidate import Candidate, motors
from core.gap.sim import Part, Sim, Slot
from core.geometry import Array

FINER = 25
COARSEST_STEP_RAD, COARSEST_STEP_M = 0.06, 0.02
SPECTRUM_BINS = 1 << 18
"""Over the span of a joint."""
PEAK = 20.0
"""A line of the spectrum must stand so many times above its neighbourhood."""
ALIKE, LENGTH_MARGIN, MOST_TRIED = 0.7, 0.25, 6
"""Waves of at least so much of the greatest power may be it, if their length is right to so much."""
STEPS_AROUND, ALIKE_AROUND = 41, 61
PHASES = tuple(float(phase) for phase in np.arange(8) / 8)


def sharpened(
    sim: Sim, doings: Doings, chosen: Sequence[Candidate], left_m: Array, own_m: Sequence[Array], weight: Array
) -> list[Candidate]:
    """Better atoms for chosen candidates, and steps of encoders that the rest of the residuals shows.

    Args:
        left_m: residuals after everything chosen, (m, 3).
        own_m: what each chosen candidate moves, (m, 3) each.
        weight: of each point, 1/m^2, 0: left out, (m,).
    """
    out = []
    for candidate, own in zip(chosen, own_m, strict=True):
        place = candidate.place
        if place.effect == "mesh" and place.joint is not None and not doings.seen.chain.sliding[place.joint - 1]:
            # Between two orders of the grid both are chosen: each is found anew without the other.
            near = [part for one, part in zip(chosen, own_m, strict=True) if _neighbours(doings, one, candidate)]
            out.append(_mesh(sim, doings, place.joint - 1, candidate, left_m + sum(near), weight))
        elif place.effect == "base_shift":
            out.append(_shift(sim, doings, place.record, left_m + own, weight, None))
        elif place.effect == "target_slip":
            names = [target.name for target in doings.seen.campaign.targets]
            out.append(_shift(sim, doings, place.record, left_m + own, weight, names.index(place.target)))
    return out


def encoder_steps(sim: Sim, doings: Doings, left_m: Array, weight: Array) -> list[Candidate]:
    """Steps of encoders whose saw-teeth stand out of residuals: of one joint after the other, and of all alike."""
    spectra = []
    for joint in motors(doings):
        field = sim.fields([Slot(Part.DRIVE, joint)])[:, :, 0]
        strength = weight * np.sum(field**2, axis=1)
        if strength.max() > 0:
            sliding = bool(doings.seen.chain.sliding[joint])
            error = weight * np.sum(field * left_m, axis=1)
            spectra.append(Spectrum(joint, sliding, doings.active[:, joint], error, strength))
    out = []
    for spectrum in spectra:
        found = spectrum.steps()
        if found is not None:
            out.append(drives.quantisation(doings, {spectrum.joint: found}))
    turning = [spectrum for spectrum in spectra if not spectrum.sliding]
    alike = common_steps(turning) if len(turning) > 1 else None
    if alike is not None:
        out.append(drives.quantisation(doings, alike))
    if len(out) > 1:
        single = {j: step for one in out for j, step in one.steps.items() if len(one.steps) == 1}
        if len(single) > 1:
            out.append(drives.quantisation(doings, single))
    return out


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Errors of one joint as a sum of waves of its displacement."""

    joint: int
    sliding: bool
    x: Array
    error: Array
    """Weighted joint errors, (m,)."""
    strength: Array
    """Their weights, (m,)."""

    @property
    def span(self) -> float:
        return float(np.ptp(self.x))

    @cached_property
    def power(self) -> Array:
        """Of each wave, in units of what noise makes of it, (SPECTRUM_BINS + 1,); wave k: k / (2 span) in a unit."""
        bins = np.minimum(((self.x - self.x.min()) / self.span * SPECTRUM_BINS).astype(int), SPECTRUM_BINS - 1)
        power = np.abs(np.fft.rfft(np.bincount(bins, self.error, 2 * SPECTRUM_BINS))) ** 2
        wave = np.arange(len(power)) / (2 * self.span)
        coarsest = COARSEST_STEP_M if self.sliding else COARSEST_STEP_RAD
        # Steps finer than eight bins are blurred; coarse ones are other effects.
        power[(wave < 1 / coarsest) | (np.arange(len(power)) > SPECTRUM_BINS // 4)] = 0.0
        return power / max(float(np.sum(self.error**2)), 1e-300)

    @cached_property
    def pull(self) -> Array:
        """Of each wave on the errors, like ``power``, without its unit."""
        return np.sqrt(self.power * float(np.sum(self.error**2)))

    def steps(self) -> tuple[float, float] | None:
        """Size and phase of the steps that stand out; None: none."""
        if self.span < 4 * (COARSEST_STEP_M if self.sliding else COARSEST_STEP_RAD) / 3:
            return None
        wave = np.arange(len(self.power)) / (2 * self.span)
        places = _whole_steps(wave, self.power, self.pull, float(self.strength.sum()), PEAK)
        best = max((self.saw_near(1 / wave[k]) for k in places), default=(0.0,))
        return best[1:] if best[0] > 0 else None

    def saw_near(self, step: float) -> tuple[float, float, float]:
        """The best explained energy near a size of steps, with the size and the phase."""
        best = (0.0, step, 0.0)
        width = step**2 / self.span / 2
        for size in step + width * np.linspace(-1, 1, STEPS_AROUND):
            for phase in PHASES:
                best = max(best, (self.explained(size, phase), float(size), phase))
        return best

    def best_phase(self, step: float) -> tuple[float, float]:
        """Energy that steps of a size explain at their best phase, and that phase."""
        return max((self.explained(step, phase), phase) for phase in PHASES)

    def explained(self, step: float, phase: float) -> float:
        """Energy that whole steps explain; negative where they would be too much, or turned round.

        A share of coarser steps may look alike at the few places where a joint stood, and is none.
        """
        teeth = drives.saw(self.x, step, phase)
        return float(2 * (teeth @ self.error) - teeth**2 @ self.strength)


def _whole_steps(wave: Array, power: Array, pull: Array, strength: float, peak: float) -> np.ndarray:
    """Waves that stand out with the amplitude that whole steps of their length have, a few of the strongest.

    Where a joint stood at few places, steps of many lengths look alike but for that: a saw-tooth of steps s has a
    fundamental wave of amplitude s / pi.
    """
    strongest = int(np.argmax(power))
    if not power[strongest] > peak:
        return np.zeros(0, dtype=int)
    expected = strength / (2 * np.pi * pull[strongest])
    fits = (power > ALIKE * power[strongest]) & (np.abs(wave / expected - 1) < LENGTH_MARGIN)
    high = np.flatnonzero(fits)
    return high[np.argsort(power[high])[::-1][:MOST_TRIED]]


def common_steps(spectra: list[Spectrum]) -> dict[int, tuple[float, float]] | None:
    """One size of steps for all turning joints, by the sum of their spectra; None: none stands out."""
    longest = max(spectrum.span for spectrum in spectra)
    waves = np.arange(1, SPECTRUM_BINS // 4) / (2 * longest)
    total, pull = np.zeros(len(waves)), np.zeros(len(waves))
    for spectrum in spectra:
        place = np.minimum(np.rint(waves * 2 * spectrum.span).astype(int), SPECTRUM_BINS)
        total += spectrum.power[place]
        pull += spectrum.pull[place]
    strength = sum(float(spectrum.strength.sum()) for spectrum in spectra)
    places = _whole_steps(waves, total, pull, strength, PEAK + 2 * len(spectra))
    best = max((_alike_near(spectra, 1 / waves[k]) for k in places), key=lambda found: found[0], default=(0.0, {}))
    return best[1] if best[0] > 0 else None


def _alike_near(spectra: list[Spectrum], step: float) -> tuple[float, dict[int, tuple[float, float]]]:
    """Steps of one size, counted alike, near a size: the energy that they explain, and size and phase by joint."""
    farthest = max(float(np.abs(spectrum.x).max()) for spectrum in spectra)
    best = (0.0, step)
    for width in (step**2 / min(spectrum.span for spectrum in spectra), step**2 / farthest):
        for size in best[1] + width * np.linspace(-1, 1, ALIKE_AROUND):
            best = max(best, (sum(spectrum.best_phase(size)[0] for spectrum in spectra), float(size)))
    return best[0], {spectrum.joint: (best[1], spectrum.best_phase(best[1])[1]) for spectrum in spectra}


def _neighbours(doings: Doings, one: Candidate, other: Candidate) -> bool:
    """Whether two mesh errors are one that lies between orders of the grid, or the same."""
    if not one.place.same_as(other.place):
        return False
    apart = abs(dict(one.fixed)["order_1"] - dict(other.fixed)["order_1"])
    return apart < 1.5 * _order_step(doings, other.place.joint - 1)


def _order_step(doings: Doings, joint: int) -> float:
    return max(drives.FINEST_ORDER_STEP, np.pi / (2.5 * max(doings.seen.span[joint], 1e-6)))


def _mesh(sim: Sim, doings: Doings, joint: int, candidate: Candidate, aim_m: Array, weight: Array) -> Candidate:
    order = dict(candidate.fixed)["order_1"]
    step = _order_step(doings, joint)
    field = sim.fields([Slot(Part.DRIVE, joint)])[:, :, 0]
    x = doings.active[:, joint]
    orders = order + step * np.linspace(-1.0, 1.0, FINER)
    orders = orders[orders > 1.5]
    gains = [_explained([np.sin(k * x), np.cos(k * x)], field, aim_m, weight) for k in orders]
    return drives.mesh(doings, joint, float(orders[int(np.argmax(gains))]))


def _shift(sim: Sim, doings: Doings, record: int | None, aim_m: Array, weight: Array, target: int | None) -> Candidate:
    """The record between the neighbours on the grid at which the change explains most."""
    seen = doings.seen
    slots = (
        [Slot(Part.BASE, 0, k) for k in range(6)]
        if target is None
        else [Slot(Part.TARGET, target, k) for k in range(3)]
    )
    fields = sim.fields(slots) * np.sqrt(weight)[:, None, None]
    aim = aim_m * np.sqrt(weight)[:, None]
    squares = np.cumsum(np.einsum("mck,mcl->mkl", fields, fields)[::-1], axis=0)[::-1]
    pulls = np.cumsum(np.einsum("mck,mc->mk", fields, aim)[::-1], axis=0)[::-1]
    starts = np.flatnonzero(np.append(True, np.diff(seen.standstill) != 0))[1:]
    near = np.abs(seen.record[starts] - record) <= np.ptp(seen.record) * 2.0 / instrument.MOMENTS
    starts = starts[near] if near.any() else starts
    # The part before the change is free as well: placement has already met both halves in the middle.
    before, pulls_before = squares[0] - squares[starts], pulls[0] - pulls[starts]
    ridge = 1e-9 * np.trace(squares[0]) * np.eye(len(slots))
    gains = _gain(squares[starts] + ridge, pulls[starts]) + _gain(before + ridge, pulls_before)
    best = int(seen.record[starts[int(np.argmax(gains))]])
    if target is None:
        return instrument.base_shift(best, instrument.MOMENTS)
    return instrument.target_slip(doings, target, best, instrument.MOMENTS)


def _gain(square: Array, pull: Array) -> Array:
    return np.einsum("rk,rk->r", pull, np.linalg.solve(square, pull[:, :, None])[:, :, 0])


def _explained(features: list[Array], field: Array, aim_m: Array, weight: Array) -> float:
    columns = np.stack([field * f[:, None] for f in (*features, np.ones_like(features[0]))], axis=2)
    flat = (columns * np.sqrt(weight)[:, None, None]).reshape(-1, columns.shape[2])
    aim = (aim_m * np.sqrt(weight)[:, None]).ravel()
    square = flat.T @ flat
    pull = flat.T @ aim
    return float(pull @ np.linalg.solve(square + 1e-12 * np.trace(square) * np.eye(len(square)), pull))
