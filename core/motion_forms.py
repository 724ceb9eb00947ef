"""Families of functions between the two ends of a drive (equations 8, 13 and 15, and section 4 of the paper).

Two kinds use them:

- a **transmission** maps the actual displacement of a joint to the displacement that was commanded of its motor;
- a **coupling** maps the active displacement of joint i to the passive displacement of joint i+1.

Conventions. Displacements are rad (m where a joint slides), positive in the sense in which a positive command moves
the joint; x = 0 is the arm's zero pose. A transmission has no constant term of its own: the zero of a joint is where
the function says so, and an offset is kept beside it (``MotionFunction.offset``). A coupling is zero at zero: passive
motion counts from there. Forms are smooth over the whole range of a joint, more than a turn included.

    direct          f(x) = x                                                        no constants
    ratio           f(x) = r x                                                      linear, with ratio
    first_harmonic  f(x) = x + s sin x + c cos x                                    eccentric last gear
    gear            f(x) = x + N (s sin(x/N) + c cos(x/N))                          the same, seen through a ratio N
    harmonics_k     f(x) = x + sum over j = 1..k of s_j sin(j x) + c_j cos(j x)
    proportional    f(x) = g x                                                      couplings from here on
    gear            f(x) = N x + s sin(N x) + c (cos(N x) - 1)
    arctangent      f(x) = atan((n0 sin x + n1 (cos x - 1)) / (cos x + d1 sin x + d2))        four-bar linkage

The paper writes the arctangent with a constant n2 of its own; counting passive motion from zero makes n2 = -n1. It
gives the gear of a transmission at the gear's own shaft, f/N; here it is at the joint, so that commands keep the
joint's unit.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from core.errors import InputError
from core.geometry import Array, wrap_angle

PERIODIC_STD_RAD = 0.03
"""Size of periodic errors to be expected of a drive: the paper's run up to 0.04 rad."""
RATIO_STD = 0.01
"""Size of ratio errors to be expected."""


class MotionForm(ABC):
    """One family: what it is called, its constants, its value and its derivatives."""

    name: str
    coefficient_names: tuple[str, ...]
    formula: str

    @abstractmethod
    def start(self) -> Array:
        """The constants of a perfect drive, shape (p,)."""

    @abstractmethod
    def evaluate(self, x: Array, coefficients: Array) -> tuple[Array, Array, Array]:
        """Value (m,), slope with respect to x (m,), gradient with respect to the constants (m, p)."""

    @abstractmethod
    def prior_std(self) -> Array:
        """How far the constants of real drives are from a perfect one, roughly, (p,): the prior of the evidence."""

    def constants(self) -> dict[str, float]:
        """Numbers of the formula that are given and not fitted, by name."""
        return {}


@dataclass(frozen=True)
class Direct(MotionForm):
    """The motor moves the joint as commanded."""

    name = "direct"
    coefficient_names = ()
    formula = "x"

    def start(self) -> Array:
        return np.zeros(0)

    def prior_std(self) -> Array:
        return np.zeros(0)

    def evaluate(self, x: Array, coefficients: Array) -> tuple[Array, Array, Array]:
        return x.copy(), np.ones_like(x), np.zeros((len(x), 0))


@dataclass(frozen=True)
class Proportional(MotionForm):
    """A straight line through zero: the ratio of a transmission, the gain of a coupling."""

    gain: float = 1.0
    """Its nominal slope."""
    name: str = "ratio"
    coefficient: str = "ratio"

    @property
    def coefficient_names(self) -> tuple[str, ...]:
        return (self.coefficient,)

    @property
    def formula(self) -> str:
        return f"{self.coefficient} x"

    def start(self) -> Array:
        return np.array([self.gain])

    def prior_std(self) -> Array:
        return np.array([RATIO_STD * abs(self.gain)])

    def evaluate(self, x: Array, coefficients: Array) -> tuple[Array, Array, Array]:
        return coefficients[0] * x, np.full_like(x, coefficients[0]), x[:, None]


@dataclass(frozen=True)
class Harmonics(MotionForm):
    """x plus periodic errors of the joint's turn, orders 1..k."""

    orders: int = 1

    @property
    def name(self) -> str:
        return "first_harmonic" if self.orders == 1 else f"harmonics_{self.orders}"

    @property
    def coefficient_names(self) -> tuple[str, ...]:
        if self.orders == 1:
            return ("s", "c")
        return tuple(f"{letter}{k}" for k in range(1, self.orders + 1) for letter in "sc")

    @property
    def formula(self) -> str:
        if self.orders == 1:
            return "x + s sin x + c cos x"
        return "x + " + " + ".join(f"s{k} sin {k}x + c{k} cos {k}x" for k in range(1, self.orders + 1))

    def start(self) -> Array:
        return np.zeros(2 * self.orders)

    def prior_std(self) -> Array:
        return np.repeat(PERIODIC_STD_RAD / np.arange(1, self.orders + 1), 2)

    def evaluate(self, x: Array, coefficients: Array) -> tuple[Array, Array, Array]:
        gradient, turned = np.empty((len(x), 2 * self.orders)), np.empty((len(x), 2 * self.orders))
        for k in range(1, self.orders + 1):
            angle = x if k == 1 else k * x
            sine, cosine = np.sin(angle), np.cos(angle)
            gradient[:, 2 * k - 2], gradient[:, 2 * k - 1] = sine, cosine
            turned[:, 2 * k - 2], turned[:, 2 * k - 1] = k * cosine, -k * sine
        return x + gradient @ coefficients, 1.0 + turned @ coefficients, gradient


@dataclass(frozen=True)
class Gear(MotionForm):
    """An eccentric wheel of a gear of known ratio: its first harmonic, s and c."""

    ratio: float
    """N, the sense of which the formula tells."""
    name = "gear"
    coefficient_names = ("s", "c")

    def start(self) -> Array:
        return np.zeros(2)

    def prior_std(self) -> Array:
        return np.full(2, PERIODIC_STD_RAD)

    def constants(self) -> dict[str, float]:
        return {"N": self.ratio}


@dataclass(frozen=True)
class DriveGear(Gear):
    """An eccentric gear before the last reduction N: once a turn of the gear, ``ratio`` joint turns apart."""

    formula = "x + N (s sin(x/N) + c cos(x/N))"

    def evaluate(self, x: Array, coefficients: Array) -> tuple[Array, Array, Array]:
        sine, cosine = np.sin(x / self.ratio), np.cos(x / self.ratio)
        s, c = coefficients
        value = x + self.ratio * (s * sine + c * cosine)
        return value, 1.0 + s * cosine - c * sine, self.ratio * np.stack([sine, cosine], axis=1)


@dataclass(frozen=True)
class CouplingGear(Gear):
    """Passive motion through a gear pair of ratio N with an eccentric wheel."""

    formula = "N x + s sin(N x) + c (cos(N x) - 1)"

    def evaluate(self, x: Array, coefficients: Array) -> tuple[Array, Array, Array]:
        sine, cosine = np.sin(self.ratio * x), np.cos(self.ratio * x)
        s, c = coefficients
        value = self.ratio * x + s * sine + c * (cosine - 1.0)
        return value, self.ratio * (1.0 + s * cosine - c * sine), np.stack([sine, cosine - 1.0], axis=1)


@dataclass(frozen=True)
class Arctangent(MotionForm):
    """Passive motion through a four-bar linkage: a fraction inside an arctangent."""

    gain: float = -1.0
    """Nominal slope; it tells which turn of the arctangent is meant."""
    name = "arctangent"
    coefficient_names = ("n0", "n1", "d1", "d2")
    formula = "atan((n0 sin x + n1 (cos x - 1)) / (cos x + d1 sin x + d2))"

    def start(self) -> Array:
        return np.array([self.gain, 0.0, 0.0, 0.0])

    def prior_std(self) -> Array:
        return np.array([0.02, 0.2, 0.2, 0.02])

    def evaluate(self, x: Array, coefficients: Array) -> tuple[Array, Array, Array]:
        n0, n1, d1, d2 = coefficients
        sine, cosine = np.sin(x), np.cos(x)
        top, bottom = n0 * sine + n1 * (cosine - 1.0), cosine + d1 * sine + d2
        square = top**2 + bottom**2
        by_top, by_bottom = bottom / square, -top / square
        line = self.gain * x
        value = line + wrap_angle(np.arctan2(top, bottom) - line)
        slope = by_top * (n0 * cosine - n1 * sine) + by_bottom * (d1 * cosine - sine)
        gradient = np.stack([by_top * sine, by_top * (cosine - 1.0), by_bottom * sine, by_bottom], axis=1)
        return value, slope, gradient


@dataclass(frozen=True)
class MotionFunction:
    """One function: a family with its constants, and the reading at which the function's own value is zero."""

    form: MotionForm
    coefficients: Array
    offset: float = 0.0
    """Added to the value: the transducer's offset, rad (m)."""

    def __post_init__(self) -> None:
        coefficients = np.asarray(self.coefficients, dtype=float)
        expected = (len(self.form.coefficient_names),)
        if coefficients.shape != expected:
            raise InputError(f"{self.form.name} takes {expected[0]} constants, got {coefficients.size}")
        object.__setattr__(self, "coefficients", coefficients)

    def __call__(self, x: ArrayLike) -> Array:
        """The function's value at displacements x, rad (m), any shape."""
        x = np.asarray(x, dtype=float)
        return self.form.evaluate(x.ravel(), self.coefficients)[0].reshape(x.shape) + self.offset

    def inverse(self, value: ArrayLike) -> Array:
        """The displacement at which the function has a value, by Newton's method; any shape.

        The functions rise or fall over their whole range, so there is one answer. It is found to rounding.
        """
        value = np.asarray(value, dtype=float)
        wanted = value.ravel() - self.offset
        start, slope, _ = self.form.evaluate(np.zeros(1), self.coefficients)
        x = (wanted - start) / slope
        for _ in range(40):
            now, slope, _ = self.form.evaluate(x, self.coefficients)
            step = (now - wanted) / slope
            x = x - step
            # Newton squares the error: after a step this small the next would be lost in rounding.
            if np.abs(step).max(initial=0.0) <= 1e-9:
                break
        return x.reshape(value.shape)


def transmission_form(name: str, drive_ratio: float | None = None) -> MotionForm:
    """The family of transmissions of that name.

    Raises:
        InputError: no such family, or the gear's ratio is not known.
    """
    simple: dict[str, MotionForm] = {"direct": Direct(), "ratio": Proportional(), "first_harmonic": Harmonics(1)}
    if name in simple:
        return simple[name]
    if name == "gear":
        if drive_ratio is None:
            raise InputError("the transmission form 'gear' needs the joint's drive_ratio, which is not given")
        return DriveGear(drive_ratio)
    if name.startswith("harmonics_") and name[10:].isdigit() and 1 <= int(name[10:]) <= 12:
        return Harmonics(int(name[10:]))
    known = ", ".join([*simple, "gear", "harmonics_2 ... harmonics_12", "auto"])
    raise InputError(f"there is no transmission form {name!r}; expected one of {known}")


def coupling_form(name: str, gain: float) -> MotionForm:
    """The family of couplings of that name, for a nominal gain.

    Raises:
        InputError: no such family.
    """
    forms: dict[str, MotionForm] = {
        "proportional": Proportional(gain, "proportional", "gain"),
        "gear": CouplingGear(gain),
        "arctangent": Arctangent(gain),
    }
    if name not in forms:
        raise InputError(f"there is no coupling form {name!r}; expected one of {', '.join(forms)}, auto")
    return forms[name]
