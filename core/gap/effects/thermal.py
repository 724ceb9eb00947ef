"""Links that grow: with a logged temperature, or as an arm warms up in time or at work."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import Candidate, Column
from core.gap.result import Place
from core.gap.sim import Part, Slot
from core.geometry import Array

Law = Callable[[Doings], Array]
"""A rise of temperature at every point, K, or how warm something is, 0..1, (m,)."""
WARM_UP_SHARES = (0.1, 0.3, 1.0)
"""Time constants of warming up, as shares of the whole time."""
SHARPER = 25
"""Time constants that are tried where one has been found."""


@dataclass(frozen=True)
class WarmUp:
    """How something warms up from the first record on: 1 - exp(-t / constant)."""

    constant_s: float
    at_work: bool
    """Whether it cools as fast where the arm rests."""

    def __post_init__(self) -> None:
        if not self.constant_s > 0:
            raise ValueError(f"a time constant of {self.constant_s:g} s: more than 0 s was expected")

    @property
    def words(self) -> str:
        return f"warming up over {self.constant_s / 60:.4g} min{' of work' if self.at_work else ''}"

    def __call__(self, doings: Doings) -> Array:
        elapsed = doings.elapsed_s
        if elapsed is None:
            return np.zeros(doings.count)
        return doings.warmth(self.constant_s) if self.at_work else 1.0 - np.exp(-elapsed / self.constant_s)


@dataclass(frozen=True, eq=False)
class Thermal(Candidate):
    """Growth of links by a law."""

    warm_up: WarmUp | None = None
    """None: by a logged temperature."""


def thermals(doings: Doings) -> list[Candidate]:
    """Links grow with a logged temperature, or as something does that warms up."""
    laws: list[tuple[str, Law]] = [*_temperatures(doings), *((law.words, law) for law in _warm_ups(doings))]
    return [_thermal(which, doings, name, law, len(laws)) for name, law in laws for which in _growing(doings)]


def warmed(doings: Doings, law: WarmUp) -> list[Candidate]:
    """The same of one law whose time constant was found."""
    fixed = (("time_constant_s", law.constant_s),)
    return [replace(_thermal(which, doings, law.words, law, SHARPER), fixed=fixed) for which in _growing(doings)]


def _growing(doings: Doings) -> list[list[int]]:
    """Each link that has a length, from 0, and all of them."""
    lengths = np.linalg.norm(doings.seen.chain.link_transforms[:, :3, 3], axis=1)
    links = [i for i in range(min(doings.seen.joint_count, int(doings.seen.link.max()))) if lengths[i] > 0.01]
    return [*([i] for i in links), links]


def _temperatures(doings: Doings) -> list[tuple[str, Law]]:
    out = []
    for column, name in (("arm_temperature_c", "arm"), ("temperature_c", "air")):
        logged = doings.logged(column)
        if logged is not None and np.ptp(logged) > 0.05:
            out.append((f"with the temperature of the {name}", _above(column, float(logged[0]))))
    return out


def _warm_ups(doings: Doings) -> list[WarmUp]:
    elapsed = doings.elapsed_s
    if elapsed is None or not np.ptp(elapsed) > 0:
        return []
    times = [share * float(np.ptp(elapsed)) for share in WARM_UP_SHARES]
    return [WarmUp(time_s, at_work) for at_work in (False, True)[: 1 + doings.rested] for time_s in times]


def _above(column: str, first: float) -> Law:
    def rise(doings: Doings) -> Array:
        logged = doings.logged(column)
        return np.zeros(doings.count) if logged is None else logged - first

    return rise


def _thermal(links: list[int], doings: Doings, law_name: str, law: Law, laws: int) -> Thermal:
    everywhere = links == _growing(doings)[-1]

    def columns(doings: Doings) -> list[Column]:
        rise = law(doings)
        steps = doings.seen.chain.link_transforms[:, :3, 3]
        one = [[(Slot(Part.BEYOND, i, 3 + c), rise * steps[i, c]) for c in range(3) if steps[i, c]] for i in links]
        together = [term for column in one for term in column]
        return [together, *one] if everywhere and len(links) > 1 else one

    warm_up = law if isinstance(law, WarmUp) else None
    per, size = ("when_warm_1", 1e-4) if warm_up else ("per_k", 1e-5)
    names = tuple(f"growth_of_link_{i + 1}_{per}" for i in links)
    if everywhere and len(links) > 1:
        names = (f"growth_of_all_{per}", *names)
    reference = (size, *(0.5 * size,) * (len(names) - 1))
    place = Place("thermal", joint=None if everywhere else links[0] + 1)
    return Thermal(place, law_name, names, columns, laws, reference, warm_up=warm_up)
