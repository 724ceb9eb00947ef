"""What a grid of candidates finds roughly, found sharply: the order of a mesh, the moment of a shift, encoder steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.gap.doings import Doings
from core.gap.effects import drives, instrument
from core.gap.effects.candidate import Candidate, motors
from core.gap.library import joint_alone
from core.gap.sim import Part, Sim, Slot
from core.geometry import Array

FINER = 25
COARSEST_STEP_RAD, COARSEST_STEP_M = 0.06, 0.02
SPECTRUM_BINS = 1 << 18
"""Over the span of a joint."""
PEAK = 20.0
"""A line of the spectrum must stand so many times above its neighbourhood."""
ALIKE, MOST_TRIED, MOST_TRIED_ALIKE = 0.8, 6, 3
"""Waves of at least so much of the greatest power may be the steps', as many of them are tried."""
SHARES = (0.5, 1.6)
STEPS_AROUND, ALIKE_AROUND = 41, 61
PHASES_AROUND = 17
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
    # Points beside a moment that was missed look like outliers: they are what it is found by.
    every = np.where(weight > 0, weight, weight.max())
    for candidate, own in zip(chosen, own_m, strict=True):
        place = candidate.place
        if drives.order_of(candidate) is not None:
            # Between two orders of the grid both are chosen: each is found anew without the other.
            near = [part for one, part in zip(chosen, own_m, strict=True) if _neighbours(doings, one, candidate)]
            out += _periodic(sim, doings, candidate, left_m + sum(near), weight)
        elif place.effect == "base_shift":
            out.append(_shift(sim, doings, place.record, left_m + own, every, None))
        elif place.effect == "target_slip":
            names = [target.name for target in doings.seen.campaign.targets]
            out.append(_shift(sim, doings, place.record, left_m + own, every, names.index(place.target)))
    return out


def encoder_steps(sim: Sim, doings: Doings, left_m: Array, weight: Array) -> list[Candidate]:
    """Steps of encoders whose saw-teeth stand out of residuals: of motors, or of joints that are driven by two."""
    out = _steps_of(sim, doings, Part.DRIVE, left_m, weight)
    if doings.seen.chain.coupling_gains.any():
        out += [joint_alone(one) for one in _steps_of(sim, doings.uncoupled, Part.JOINT, left_m, weight)]
    return out


def _steps_of(sim: Sim, doings: Doings, part: Part, left_m: Array, weight: Array) -> list[Candidate]:
    """Steps of one joint after the other, of those together, and of all alike."""
    spectra = []
    for joint in motors(doings):
        field = sim.fields([Slot(part, joint)])[:, :, 0]
        strength = weight * np.sum(field**2, axis=1)
        if strength.max() > 0:
            sliding = bool(doings.seen.chain.sliding[joint])
            error = weight * np.sum(field * left_m, axis=1)
            spectra.append(Spectrum(joint, sliding, doings.active[:, joint], error, strength))
    single = {one.joint: found for one in spectra if (found := one.steps()) is not None}
    out = [{joint: found} for joint, found in single.items()]
    if len(single) > 1:
        out.append(single)
    turning = [spectrum for spectrum in spectra if not spectrum.sliding]
    if len(turning) > 1:
        sizes = {single[one.joint][0] for one in turning if one.joint in single}
        out += [alike for alike in (common_steps(turning), *(_alike(turning, size) for size in sizes)) if alike]
    return [drives.quantisation(doings, steps) for steps in out]


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

    def _waves(self, values: Array) -> Array:
        """Sum of values times exp(-2 pi i wave x) for each wave, (SPECTRUM_BINS + 1,)."""
        bins = np.minimum(((self.x - self.x.min()) / self.span * SPECTRUM_BINS).astype(int), SPECTRUM_BINS - 1)
        return np.fft.rfft(np.bincount(bins, values, 2 * SPECTRUM_BINS))

    @cached_property
    def wave(self) -> Array:
        """Waves that are looked at, in a unit of x, (SPECTRUM_BINS // 4 + 1,): finer steps would be blurred."""
        return np.arange(SPECTRUM_BINS // 4 + 1) / (2 * self.span)

    @cached_property
    def _weights(self) -> Array:
        return self._waves(self.strength)

    @cached_property
    def _weighed(self) -> Array:
        """Sum of the weights times each wave over their sum; what is constant in errors, placement has taken up."""
        return self._weights[: len(self.wave)] / self.strength.sum()

    @cached_property
    def _pull(self) -> Array:
        return self._waves(self.error)[: len(self.wave)] - self.error.sum() * self._weighed

    @cached_property
    def power(self) -> Array:
        """Of each wave, in units of what noise makes of it; 0 where steps would be so coarse as to be other effects."""
        power = np.abs(self._pull) ** 2 / max(float(np.sum(self.error**2)), 1e-300)
        coarsest = COARSEST_STEP_M if self.sliding else COARSEST_STEP_RAD
        return np.where(self.wave < 1 / coarsest, 0.0, power)

    @cached_property
    def amplitude(self) -> Array:
        """Of each wave when it is fitted to the errors beside a constant, rad or m."""
        whole, twice = float(self.strength.sum()), self._weights[: 2 * len(self.wave) : 2]
        once = self._weighed
        cosines = (whole + twice.real) / 2 - whole * once.real**2
        sines = (whole - twice.real) / 2 - whole * once.imag**2
        both = -twice.imag / 2 + whole * once.real * once.imag
        cosine, sine = self._pull.real, -self._pull.imag
        determinant = np.maximum(cosines * sines - both**2, 1e-6 * whole**2)
        return np.hypot(sines * cosine - both * sine, cosines * sine - both * cosine) / determinant

    def steps(self) -> tuple[float, float] | None:
        """Size and phase of the steps that stand out; None: none."""
        if self.span < 4 * (COARSEST_STEP_M if self.sliding else COARSEST_STEP_RAD) / 3:
            return None
        if not self.power.max() > PEAK:
            return None
        places = _whole_steps(self.wave, self.power, self.amplitude, MOST_TRIED)
        best = max((self.saw_near(1 / self.wave[k]) for k in places), default=(0.0, 0.0))
        return (best[1], self.sharp_phase(best[1])) if best[0] > 0 else None

    def saw_near(self, step: float) -> tuple[float, float]:
        """The best explained energy near a size of steps, and the size."""
        sizes = step + step**2 / self.span / 2 * np.linspace(-1, 1, STEPS_AROUND)
        energy = self.best_energy(sizes)
        best = int(np.argmax(energy))
        return float(energy[best]), float(sizes[best])

    def best_energy(self, sizes: Array) -> Array:
        """Energy that steps of each size (k,) explain at their best phase, (k,)."""
        energy = self.explained(np.repeat(sizes, len(PHASES)), np.tile(PHASES, len(sizes)))
        return energy.reshape(len(sizes), -1).max(axis=1)

    def sharp_phase(self, step: float) -> float:
        """The best phase of steps of a size, as finely as points can tell."""
        phases, width = np.array(PHASES), 1 / len(PHASES)
        for _ in range(3):
            best = phases[int(np.argmax(self.explained(np.full(len(phases), step), phases)))]
            phases = np.append(best, best + width * np.linspace(-1, 1, PHASES_AROUND))
            width /= 8
        return float(best)

    def explained(self, steps: Array, phases: Array) -> Array:
        """Energy that steps of each size and phase (k,) explain; 0 where a share of them does that is far from one.

        Such a share of other steps may look alike at the few places where a joint stood, and is none.
        """
        teeth = drives.saw(self.x, steps[:, None], phases[:, None])
        teeth -= (teeth @ self.strength / self.strength.sum())[:, None]
        pull, square = teeth @ self.error, np.maximum(teeth**2 @ self.strength, 1e-300)
        whole = (pull / square > SHARES[0]) & (pull / square < SHARES[1])
        return np.where(whole, pull**2 / square, 0.0)


def _whole_steps(wave: Array, power: Array, amplitude: Array, most: int) -> np.ndarray:
    """The wave that stands out most, and such as do nearly so and have the amplitude of whole steps of their length.

    Where a joint stood at few places, steps of many lengths look alike but for that: a saw-tooth of steps s has a
    fundamental wave of amplitude s / pi.
    """
    high = np.flatnonzero(power > ALIKE * power.max())
    off = np.abs(np.log(np.maximum(np.pi * wave[high] * amplitude[high], 1e-300)))
    return np.unique([*high[np.argsort(off)[: most - 1]], *high[np.argsort(power[high])[-1:]]]).astype(int)


def common_steps(spectra: list[Spectrum]) -> dict[int, tuple[float, float]] | None:
    """One size of steps for all turning joints, by the sum of their spectra; None: none stands out."""
    waves = max(spectra, key=lambda spectrum: spectrum.span).wave
    places = [np.rint(waves * 2 * spectrum.span).astype(int) for spectrum in spectra]
    total = sum(spectrum.power[place] for spectrum, place in zip(spectra, places, strict=True))
    if not total.max() > PEAK + 2 * len(spectra):
        return None
    strengths = [float(spectrum.strength.sum()) for spectrum in spectra]
    amplitudes = [spectrum.amplitude[place] for spectrum, place in zip(spectra, places, strict=True)]
    amplitude = np.average(amplitudes, axis=0, weights=strengths)
    found = _whole_steps(waves, total, amplitude, MOST_TRIED_ALIKE)
    best = max((_alike_near(spectra, 1 / waves[k]) for k in found), default=(0.0, 0.0))
    return _alike(spectra, best[1]) if best[0] > 0 else None


def _alike(spectra: list[Spectrum], size: float) -> dict[int, tuple[float, float]]:
    """Steps of one size for all, at the best phase of each."""
    return {spectrum.joint: (size, spectrum.sharp_phase(size)) for spectrum in spectra}


def _alike_near(spectra: list[Spectrum], step: float) -> tuple[float, float]:
    """Steps of one size, counted alike, near a size: the energy that they explain, and the size."""
    farthest = max(float(np.abs(spectrum.x).max()) for spectrum in spectra)
    for width in (step**2 / min(spectrum.span for spectrum in spectra), step**2 / farthest):
        sizes = step + width * np.linspace(-1, 1, ALIKE_AROUND)
        energy = sum(spectrum.best_energy(sizes) for spectrum in spectra)
        step = float(sizes[int(np.argmax(energy))])
    return float(energy.max()), step


def _neighbours(doings: Doings, one: Candidate, other: Candidate) -> bool:
    """Whether two periodic errors are one that lies between orders of the grid, or the same."""
    if not one.place.same_as(other.place):
        return False
    apart = abs(drives.order_of(one) - drives.order_of(other))
    return apart < 1.5 * drives.order_step(doings, other.place.joint - 1)


def _periodic(sim: Sim, doings: Doings, candidate: Candidate, aim_m: Array, weight: Array) -> list[Candidate]:
    """The order between the neighbours on the grid at which a periodic error explains most, under all its names."""
    joint, order = candidate.place.joint - 1, drives.order_of(candidate)
    field = sim.fields([Slot(Part.DRIVE, joint)])[:, :, 0]
    x = doings.active[:, joint]
    orders = order + drives.order_step(doings, joint) * np.linspace(-1.0, 1.0, FINER)
    orders = orders[orders > (0.0 if doings.seen.chain.sliding[joint] else 1.5)]
    gains = [_explained([np.sin(k * x), np.cos(k * x)], field, aim_m, weight) for k in orders]
    return drives.periodic(candidate, doings, float(orders[int(np.argmax(gains))]))


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
    # What happened while nobody looked is told from the record on at which it was seen.
    starts = (np.arange(seen.count) if target is None else np.flatnonzero(seen.target == target))[1:]
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
