"""Steps of encoders: saw-teeth that stand out of the spectra of joint errors."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.gap.doings import Doings
from core.gap.effects import drives
from core.gap.effects.candidate import Candidate, motors
from core.gap.effects.drives import EncoderSteps
from core.gap.library import joint_alone
from core.gap.sim import Part, Sim, Slot
from core.gap.step_edges import PHASES, JointErrors, possible, settled, whole
from core.geometry import Array

COARSEST_STEP_RAD, COARSEST_STEP_M = 0.06, 0.02
SPECTRUM_BINS = 1 << 17
"""Over the span of a joint; at least four a wave."""
SHARED = np.sinc(np.arange(SPECTRUM_BINS + 1) / (2 * SPECTRUM_BINS)) ** 2
"""What is left of a wave where each point is shared out to the bins before and behind it."""
PEAK = 20.0
"""A line of the spectrum must stand so many times above its neighbourhood."""
HARMONICS = 6
"""Of a saw-tooth, which tell steps from what else comes and goes."""
ALIKE = 0.8
"""Waves of at least so much of the greatest power may be the steps'."""
BESIDE, MOST_TRIED, MOST_TRIED_ALIKE, MOST_ALIKE = 6, 6, 3, 2
"""Waves so near are the same; so many others are tried, and sizes that are common to all joints."""
STEPS_AROUND, ALIKE_AROUND = 41, 61
TANGLED = 2
"""Times that the steps of several joints are found each in what the others leave."""
FEW_PHASES = np.arange(8) / 8
FINE_SIZES, ROUNDS, NARROWER = 25, 2, 10.0
"""Size and phase hang together: of thousands of teeth the last ones move by one where the size is off by less than a
thousandth. So both are tried together in the end, and again within a narrower range."""


def encoder_steps(sim: Sim, doings: Doings, aims_m: Sequence[Array], weight: Array) -> list[Candidate]:
    """Steps of encoders whose saw-teeth stand out of residuals: of motors, or of joints that are driven by two.

    Args:
        aims_m: residuals in which they are looked for, one set after the other, (m, 3) each.
        weight: of each point, 1/m^2, 0: left out, (m,).
    """
    out = _steps_of(sim, doings, Part.DRIVE, aims_m, weight)
    if doings.seen.chain.coupling_gains.any():
        out += _steps_of(sim, doings.uncoupled, Part.JOINT, aims_m, weight)
    return out


def settled_steps(sim: Sim, doings: Doings, candidate: EncoderSteps, aim_m: Array, weight: Array) -> EncoderSteps:
    """The same steps with sizes and phases as all points tell them that nothing else explains.

    Args:
        aim_m: residuals after everything that was fitted but these steps, (m, 3).
        weight: of each point, 1/m^2, (m,); 0: not looked at.
    """
    alone = candidate.columns(doings)[0][0][0].part is Part.JOINT
    told = doings.uncoupled if alone else doings
    fields = {j: sim.fields([Slot(Part.JOINT if alone else Part.DRIVE, j)])[:, :, 0] for j in candidate.steps}
    found = drives.quantisation(told, _untangled(told, fields, aim_m, candidate.steps, weight))
    return joint_alone(found) if alone else found


def _untangled(
    told: Doings, fields: dict[int, Array], aim_m: Array, steps: dict[int, tuple[float, float]], weight: Array
) -> dict[int, tuple[float, float]]:
    """Steps of several joints, each found anew in what the others leave: the strongest first."""
    left_m, there = aim_m.copy(), {}
    errors = {j: _errors(told, j, fields[j], aim_m, weight).within(steps[j][0]).merged for j in steps}
    strongest = sorted(steps, key=lambda j: -errors[j].energy(*steps[j]))
    for j in strongest * TANGLED:
        left_m += there.pop(j, 0.0)
        errors = _errors(told, j, fields[j], left_m, weight).within(steps[j][0]).merged
        phase = errors.sharp_phase(steps[j][0])
        if errors.energy(steps[j][0], phase) > 0:
            steps = steps | {j: (steps[j][0], phase)}
            there[j] = _moved_m(told, fields[j], j, steps[j])
            left_m -= there[j]
    return _settled(told, fields, {j: left_m + there.get(j, 0.0) for j in steps}, steps, weight)


def _settled(
    told: Doings,
    fields: dict[int, Array],
    aims_m: dict[int, Array],
    steps: dict[int, tuple[float, float]],
    weight: Array,
) -> dict[int, tuple[float, float]]:
    """Steps settled by what each joint's have to explain; of one size stay of one size."""
    errors = {j: _errors(told, j, fields[j], aims_m[j], weight).within(steps[j][0]).merged for j in steps}
    out = {}
    for size in dict.fromkeys(size for size, _ in steps.values()):
        same = [j for j in steps if steps[j][0] == size]
        anew, phases = settled([errors[j] for j in same], size, [steps[j][1] for j in same])
        out |= {j: (anew, phase) for j, phase in zip(same, phases, strict=True)}
    return {j: out[j] for j in steps}


def _errors(told: Doings, joint: int, field: Array, aim_m: Array, weight: Array) -> JointErrors:
    return JointErrors(told.active[:, joint], weight * np.sum(field**2, axis=1), weight * np.sum(field * aim_m, axis=1))


def _moved_m(told: Doings, field: Array, joint: int, steps: tuple[float, float]) -> Array:
    return field * drives.saw(told.active[:, joint], *steps)[:, None]


def _steps_of(sim: Sim, doings: Doings, part: Part, aims_m: Sequence[Array], weight: Array) -> list[Candidate]:
    seen: list[tuple[Stops, Array]] = []
    for joint in motors(doings):
        field = sim.fields([Slot(part, joint)])[:, :, 0]
        strength = weight * np.sum(field**2, axis=1)
        if strength.max() > 0:
            sliding = bool(doings.seen.chain.sliding[joint])
            seen.append((Stops(joint, sliding, doings.active[:, joint], strength), field))
    fields = {stops.joint: field for stops, field in seen}
    each = [
        [Spectrum(stops, weight * np.sum(fields[stops.joint] * aim_m, axis=1)) for stops, _ in seen] for aim_m in aims_m
    ]
    # What stands out where other causes were taken away may be blurred where they were not, and the reverse.
    waves = [np.unique(np.concatenate([one.likely for one in same])) for same in zip(*each, strict=True)]
    found = []
    for aim_m, spectra in zip(aims_m, each, strict=True):
        for steps in _in_spectra(spectra, waves):
            if len(steps) > 1:
                steps = _untangled(doings, {j: fields[j] for j in steps}, aim_m, steps, weight)
            found.append(drives.quantisation(doings, steps))
    return [joint_alone(one) for one in found] if part is Part.JOINT else found


def _in_spectra(spectra: Sequence["Spectrum"], waves: Sequence[Array]) -> list[dict[int, tuple[float, float]]]:
    """Steps of one joint after the other, of those together, and of all alike: size and phase by joint."""
    each = {one.stops.joint: one.steps(likely) for one, likely in zip(spectra, waves, strict=True)}
    out = [{joint: one} for joint, found in each.items() for one in found]
    single = {joint: found[0] for joint, found in each.items() if found}
    if len(single) > 1:
        out.append(single)
    turning = [spectrum for spectrum in spectra if not spectrum.stops.sliding]
    if len(turning) > 1:
        sizes = {size for one in turning for size, _ in each[one.stops.joint]}
        common = common_size(turning)
        sizes |= set() if common is None else {common}
        likely = sorted(sizes, key=lambda size: -_energy_alike(turning, size))[:MOST_ALIKE]
        out += [_alike(turning, size) for size in likely]
    return out


@dataclass(frozen=True, eq=False)
class Stops:
    """Where one joint stood, and how well each point tells its error."""

    joint: int
    """From 0."""
    sliding: bool
    x: Array
    """(m,)"""
    strength: Array
    """Weights of joint errors, (m,)."""

    @property
    def span(self) -> float:
        return float(np.ptp(self.x))

    @property
    def coarsest(self) -> float:
        """Coarser steps would be other effects."""
        return COARSEST_STEP_M if self.sliding else COARSEST_STEP_RAD

    @cached_property
    def _bins(self) -> tuple[np.ndarray, Array]:
        """The bin before each point, and how far it is from there to the next, 0..1."""
        place = (self.x - self.x.min()) / self.span * SPECTRUM_BINS
        before = np.minimum(place.astype(int), SPECTRUM_BINS - 1)
        return before, place - before

    def waves(self, values: Array) -> Array:
        """Sum of values times exp(-2 pi i wave (x - least x)) for each wave, (SPECTRUM_BINS + 1,)."""
        before, beyond = self._bins
        bins = np.bincount(before, values * (1 - beyond), 2 * SPECTRUM_BINS)
        bins += np.bincount(before + 1, values * beyond, 2 * SPECTRUM_BINS)
        return np.fft.rfft(bins) / SHARED

    @cached_property
    def wave(self) -> Array:
        """Waves that are looked at, in a unit of x, (SPECTRUM_BINS // 2 + 1,): finer steps would be blurred."""
        return np.arange(SPECTRUM_BINS // 2 + 1) / (2 * self.span)

    @cached_property
    def _weights(self) -> Array:
        return self.waves(self.strength)

    @cached_property
    def weighed(self) -> Array:
        """Sum of the weights times each wave over their sum."""
        return self._weights[: len(self.wave)] / self.strength.sum()

    @cached_property
    def products(self) -> tuple[Array, Array, Array]:
        """Weighted squares of cosines and of sines less their means, and their products."""
        whole, once = float(self.strength.sum()), self.weighed
        twice = self._weights[: 2 * len(self.wave) : 2]
        cosines = (whole + twice.real) / 2 - whole * once.real**2
        sines = (whole - twice.real) / 2 - whole * once.imag**2
        return cosines, sines, -twice.imag / 2 + whole * once.real * once.imag


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Errors of one joint as a sum of waves of its displacement."""

    stops: Stops
    error: Array
    """Weighted joint errors, (m,)."""

    @cached_property
    def errors(self) -> JointErrors:
        return JointErrors(self.stops.x, self.stops.strength, self.error).merged

    @cached_property
    def _pull(self) -> Array:
        # What is constant in errors, placement has taken up.
        return self.stops.waves(self.error)[: len(self.stops.wave)] - self.error.sum() * self.stops.weighed

    @cached_property
    def power(self) -> Array:
        """Of each wave, in units of what noise makes of it; 0 where steps would be so coarse as to be other effects."""
        power = np.abs(self._pull) ** 2 / max(float(np.sum(self.error**2)), 1e-300)
        return np.where(self.stops.wave < 1 / self.stops.coarsest, 0.0, power)

    @cached_property
    def amplitude(self) -> Array:
        """Of each wave when it is fitted to the errors beside a constant, rad or m."""
        cosines, sines, both = self.stops.products
        cosine, sine = self._pull.real, -self._pull.imag
        determinant = np.maximum(cosines * sines - both**2, 1e-6 * float(self.stops.strength.sum()) ** 2)
        return np.hypot(sines * cosine - both * sine, cosines * sine - both * cosine) / determinant

    @cached_property
    def saw_energy(self) -> Array:
        """Energy that steps of each wave's length explain at their best phase, (waves,).

        A saw-tooth of steps s is the sum over k of -(s / pi k) (-1)^(k+1) sin(2 pi k (x / s - phase)).
        """
        parts = np.column_stack([self._pull.real, self._pull.imag])
        pulls = np.zeros((len(parts), len(FEW_PHASES)))
        for k in range(1, HARMONICS + 1):
            turn = 2 * np.pi * k * FEW_PHASES
            harmonic = parts[::k] @ np.array([np.sin(turn), np.cos(turn)])
            pulls[: len(harmonic)] += (-1) ** k / k * harmonic
        # Teeth of s have a mean square of s^2 / 12: their size cancels.
        energy = 12 / np.pi**2 * np.max(pulls**2, axis=1) / self.stops.strength.sum()
        return np.where(self.stops.wave < 1 / self.stops.coarsest, 0.0, energy)

    @cached_property
    def likely(self) -> Array:
        """Waves of which steps may be, in a unit of x."""
        if self.stops.span < 4 * self.stops.coarsest / 3 or not self.power.max() > PEAK:
            return np.zeros(0)
        alike = _whole_steps(self.stops.wave, self.power, self.amplitude, MOST_TRIED)
        return self.stops.wave[np.unique([*_peaks(self.saw_energy, MOST_TRIED), *alike])]

    def steps(self, waves: Array) -> list[tuple[float, float]]:
        """Sizes and phases of the steps, of some waves, that explain most: any share of them, and whole ones."""
        near = [found for wave in waves for found in self._saws_near(1 / wave)]
        sizes = {max(near[k::2])[1]: None for k in (0, 1) if near and max(near[k::2])[0] > 0}
        sharp = [sharp_size([self], size) for size in sizes]
        return [(step, self.errors.sharp_phase(step)) for step in sharp]

    def _saws_near(self, step: float) -> list[tuple[float, float]]:
        """The best energy near a size of steps, and the size: of any share of them, and of whole ones."""
        sizes = step + step**2 / self.stops.span / 2 * np.linspace(-1, 1, STEPS_AROUND)
        told = self.errors.shares(np.repeat(sizes, len(FEW_PHASES)), np.tile(FEW_PHASES, len(sizes)))
        energy, share = (part.reshape(len(sizes), -1) for part in told)
        each = [np.where(possible(share), energy, 0.0).max(axis=1), (energy * whole(share)).max(axis=1)]
        return [(float(one.max()), float(sizes[int(np.argmax(one))])) for one in each]

    def best_energy(self, sizes: Array) -> Array:
        """Energy that steps of each size (k,) explain at their best phase, (k,)."""
        energy = self.errors.explained(np.repeat(sizes, len(FEW_PHASES)), np.tile(FEW_PHASES, len(sizes)))
        return energy.reshape(len(sizes), -1).max(axis=1)


def sharp_size(spectra: Sequence[Spectrum], step: float) -> float:
    """The size near a size at which steps, each joint's at their best phase, explain most."""
    width = step**2 / min(spectrum.stops.span for spectrum in spectra) / 2
    for _ in range(ROUNDS):
        sizes = step + width * np.linspace(-1, 1, FINE_SIZES)
        energy = [sum(one.errors.explained(np.full(len(PHASES), s), PHASES).max() for one in spectra) for s in sizes]
        step, width = float(sizes[int(np.argmax(energy))]), width / NARROWER
    return step


def _whole_steps(wave: Array, power: Array, amplitude: Array, most: int) -> np.ndarray:
    """The wave that stands out most, and such as do nearly so and have the amplitude of whole steps of their length.

    Where a joint stood at few places, steps of many lengths look alike but for that: a saw-tooth of steps s has a
    fundamental wave of amplitude s / pi.
    """
    high = np.flatnonzero(power > ALIKE * power.max())
    off = np.abs(np.log(np.maximum(np.pi * wave[high] * amplitude[high], 1e-300)))
    return np.unique([*high[np.argsort(off)[: most - 1]], *high[np.argsort(power[high])[-1:]]]).astype(int)


def _peaks(values: Array, most: int) -> np.ndarray:
    """The places of the highest values, no two of them beside each other."""
    left, out = values.copy(), []
    for _ in range(most):
        k = int(np.argmax(left))
        if not left[k] > 0:
            break
        out.append(k)
        left[max(k - BESIDE, 0) : k + BESIDE + 1] = 0.0
    return np.array(out, dtype=int)


def common_size(spectra: list[Spectrum]) -> float | None:
    """One size of steps for all turning joints, by the sum of their spectra; None: none stands out."""
    waves = max((spectrum.stops for spectrum in spectra), key=lambda stops: stops.span).wave
    places = [np.rint(waves * 2 * spectrum.stops.span).astype(int) for spectrum in spectra]
    total = sum(spectrum.power[place] for spectrum, place in zip(spectra, places, strict=True))
    if not total.max() > PEAK + 2 * len(spectra):
        return None
    energy = sum(spectrum.saw_energy[place] for spectrum, place in zip(spectra, places, strict=True))
    found = _peaks(energy, MOST_TRIED_ALIKE)
    best = max((_alike_near(spectra, 1 / waves[k]) for k in found), default=(0.0, 0.0))
    return sharp_size(spectra, best[1]) if best[0] > 0 else None


def _alike(spectra: list[Spectrum], size: float) -> dict[int, tuple[float, float]]:
    """Steps of one size for all, at the best phase of each."""
    return {spectrum.stops.joint: (size, spectrum.errors.sharp_phase(size)) for spectrum in spectra}


def _energy_alike(spectra: list[Spectrum], size: float) -> float:
    """What steps of one size explain, each joint's at its best phase."""
    return sum(float(one.errors.explained(np.full(len(PHASES), size), PHASES).max()) for one in spectra)


def _alike_near(spectra: list[Spectrum], step: float) -> tuple[float, float]:
    """Steps of one size, counted alike, near a size: the energy that they explain, and the size."""
    farthest = max(float(np.abs(spectrum.stops.x).max()) for spectrum in spectra)
    for width in (step**2 / min(spectrum.stops.span for spectrum in spectra), step**2 / farthest):
        sizes = step + width * np.linspace(-1, 1, ALIKE_AROUND)
        energy = sum(spectrum.best_energy(sizes) for spectrum in spectra)
        step = float(sizes[int(np.argmax(energy))])
    return float(energy.max()), step
