"""The suite's campaigns as a list: what is made, from which seed, and what it tests."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count, cycle, islice

import numpy as np

from tests.benchmarks.withheld.arms import ARMS
from tests.benchmarks.withheld.effects.library import NAMED
from tests.benchmarks.withheld.effects.strangers import STRANGERS
from tests.benchmarks.withheld.noises import NOISES
from tests.benchmarks.withheld.thin import THIN

SEEDS = {"dev": (100_000,), "test": (137_000_000, 140_000_000, 143_000_000)}
"""First seeds of each part. The test set, three parts of like make, is never looked at while anything is tuned."""
GAPS = (1.0, 3.0, 10.0)
IMPOSSIBLE = {("scara", "zero_offset"), ("scara", "linkage"), ("seven", "scale"), ("irb", "scale")}
"""Arms on which nothing of an effect can be seen by construction, or that cannot have it."""
ALIKE = {("scara", frozenset({"compliance", "payload"}))}
"""Pairs that are one and the same on an arm: no mixture can be made of them, and the name of either is right."""
THIN_EFFECTS = ("backlash", "compliance", None, "eccentricity", "thermal", "zero_offset")
PHYSICS_ARMS = {
    "compliance": ("irb", "ur", "seven", "l6", "ur", "scara"),
    "flexure": ("irb", "ur", "l6", "scara"),
    "payload": ("ur", "irb", "seven"),
    "backlash": ("irb", "ur", "seven", "l6", "scara", "ur", "irb", "l6"),
}
"""What MuJoCo makes, and on which arms."""


@dataclass(frozen=True)
class Case:
    """One campaign."""

    kind: str
    """``single``, ``cluttered``, ``mixture``, ``nothing``, ``other``, ``physics`` (by MuJoCo) or ``thin``."""
    arm: str
    seed: int
    effects: tuple[str, ...] = ()
    gap: float = 0.0
    """Of the strongest effect, over the noise."""
    noise: str = "stated"
    protocol: str = "rich"


KINDS = ("single", "cluttered", "mixture", "nothing", "other", "physics", "thin")


def all_cases(seeds: str) -> list[Case]:
    """Every case of the ``dev`` or the ``test`` set, in an order that does not tell which is which."""
    return [case for first in SEEDS[seeds] for case in _part(first)]


def one_and_the_same(arm: str, one: str, other: str) -> bool:
    """Whether two effects cannot be told apart on an arm by any measurement."""
    return (arm, frozenset({one, other})) in ALIKE


def _part(first_seed: int) -> list[Case]:
    numbers, rng = count(first_seed), np.random.default_rng(first_seed)
    kinds = (_singles, _cluttered, _mixtures, _nothing, _others, _physics, _thin)
    cases = [case for kind in kinds for case in kind(numbers, rng)]
    return [cases[k] for k in rng.permutation(len(cases))]


def _arms(rng: np.random.Generator, effect: str = "") -> Iterator[str]:
    """Arms that can show an effect, round and round from a random one."""
    keys = [key for key in ARMS if (key, effect) not in IMPOSSIBLE]
    start = int(rng.integers(len(keys)))
    return islice(cycle(keys), start, None)


def _singles(numbers: Iterator[int], rng: np.random.Generator) -> Iterator[Case]:
    for effect in NAMED:
        arms = _arms(rng, effect)
        for gap in (*GAPS, *GAPS):
            yield Case("single", next(arms), next(numbers), (effect,), gap)


def _cluttered(numbers: Iterator[int], rng: np.random.Generator) -> Iterator[Case]:
    for effect in NAMED:
        arms = _arms(rng, effect)
        for gap in GAPS[1:]:
            yield Case("cluttered", next(arms), next(numbers), (effect,), gap)


def _mixtures(numbers: Iterator[int], rng: np.random.Generator) -> Iterator[Case]:
    for k in range(40):
        pair = tuple(str(name) for name in rng.permutation(list(NAMED))[:2])
        arm = next(key for key in _arms(rng) if _can_have_both(key, pair))
        yield Case("mixture", arm, next(numbers), pair, GAPS[1 + k % 2])


def _can_have_both(arm: str, pair: tuple[str, ...]) -> bool:
    return (arm, frozenset(pair)) not in ALIKE and not {(arm, name) for name in pair} & IMPOSSIBLE


def _nothing(numbers: Iterator[int], rng: np.random.Generator) -> Iterator[Case]:
    for noise in NOISES:
        arms = _arms(rng)
        for _ in range(100 if noise == "stated" else 20):
            yield Case("nothing", next(arms), next(numbers), noise=noise)


def _others(numbers: Iterator[int], rng: np.random.Generator) -> Iterator[Case]:
    for stranger in STRANGERS:
        arms = _arms(rng)
        for gap in (3.0, 10.0, 3.0, 10.0, 5.0):
            yield Case("other", next(arms), next(numbers), (stranger,), gap)


def _physics(numbers: Iterator[int], rng: np.random.Generator) -> Iterator[Case]:
    for effect, arms in PHYSICS_ARMS.items():
        for k, arm in enumerate(arms):
            yield Case("physics", arm, next(numbers), (effect,), (3.0, 10.0)[k % 2])


def _thin(numbers: Iterator[int], rng: np.random.Generator) -> Iterator[Case]:
    for protocol in THIN:
        arms = _arms(rng)
        for effect in THIN_EFFECTS:
            effects = () if effect is None else (effect,)
            arm = next(key for key in arms if (key, effect) not in IMPOSSIBLE)
            yield Case("thin", arm, next(numbers), effects, protocol=protocol)
