"""Single-joint sweeps placed to tell the most: spans, steps, where the other joints stand, targets, number of shots.

The method needs sweeps, not free poses (section 2 of the paper): one motor moves, all others stand still. What is free
is where they stand, how far the motor goes, which target is watched, and how the shots are shared out. All of it is
chosen by coordinate exchange (Meyer and Nachtsheim 1995, Technometrics 37(1), 60): one sweep after the other is
replaced by the best of many random proposals while all others stay, then stops are moved from sweep to sweep as long as
that helps; both again for some rounds. Stops stand at equal steps over the longest stretch that limits and sight allow,
the first one half a step above the limit, so that all are reached in one sense.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from core.errors import InputError
from core.geometry import Array
from core.kinematics import active_commands
from core.planning.information import whitened
from core.planning.prior import vague
from core.planning.rounding import command_steps, rounded
from core.planning.site import Site
from core.planning.visibility import visible, within_limits
from core.session_plan import PlannedSweep, commands_for

SWEEPS_A_JOINT = 2
FEWEST_STOPS, FEWEST_PASSIVE_STOPS = 6, 8
"""Of a sweep: four unknowns of a circle and two to spare; four of a linkage more where a passive motion is watched."""
SHORTEST_RAD, SHORTEST_M = np.deg2rad(20.0), 0.05
"""A sweep that can be seen over less than this is not proposed."""
GRID = 61
MARGIN = 0.02
"""Share of a joint's range that is kept off its stops at either end."""


@dataclass(frozen=True)
class Effort:
    """How long is searched."""

    rounds: int = 3
    proposals: int = 60
    """For each sweep in each round."""


THOROUGH = Effort()


@dataclass(frozen=True)
class Slot:
    """One sweep of the plan that is to be: what is settled before the search."""

    joint: int
    watched: tuple[tuple[int, ...], ...]
    """Sets of targets, any one of which may be watched at each stop."""
    fewest: int
    """Stops."""

    @property
    def cost(self) -> int:
        """Shots a stop."""
        return len(self.watched[0])


@dataclass(frozen=True)
class Placed:
    """A sweep as proposed."""

    targets: tuple[int, ...]
    held: Array
    """Commands of all joints where the motor's displacement is 0, (n,)."""
    low: float
    high: float
    stops: int
    information: Array
    """(p, p)."""


def sweep_plan(
    site: Site, shots: int, rng: np.random.Generator, loss: Array | None = None, effort: Effort = THOROUGH
) -> tuple[PlannedSweep, ...]:
    """Place sweeps of all joints, the last joint first.

    Args:
        shots: sightings of targets altogether; two a stop where a passive motion is watched.
        loss: of the I-criterion (``Required.loss``); None: D.

    Raises:
        InputError: too few shots, a joint that no target shows, or one that cannot be seen moving.
    """
    slots = slots_for(site, shots)
    search = _Search(site, slots, _shared(slots, shots), rng, loss)
    search.begin(effort)
    for _ in range(effort.rounds):
        search.place(effort.proposals)
        search.share()
    return search.sweeps()


def least_shots(site: Site) -> int:
    """The fewest sightings that sweeps of all joints take."""
    return sum(slot.fewest * slot.cost for slot in _slots(site, 1))


def slots_for(site: Site, shots: int) -> tuple[Slot, ...]:
    """The sweeps to be placed, the last joint first: two of each joint where the shots allow it.

    Raises:
        InputError: too few shots, or a joint that no target shows.
    """
    for sweeps in range(SWEEPS_A_JOINT, 0, -1):
        slots = _slots(site, sweeps)
        if sum(slot.fewest * slot.cost for slot in slots) <= shots:
            return slots
    raise InputError(f"{shots} shots are too few for sweeps of all joints, expected at least {least_shots(site)}")


def _slots(site: Site, sweeps: int) -> tuple[Slot, ...]:
    joints = np.flatnonzero(site.robot.commanded)[::-1] + 1
    return tuple(slot for joint in joints for slot in _slots_of(site, int(joint))[:sweeps])


def _slots_of(site: Site, joint: int) -> list[Slot]:
    """A sweep that shows all of a joint, its coupling included, and one for its axis and drive alone."""
    coupling = site.robot.coupling_from(joint)
    placed = np.flatnonzero(site.placed)
    own = [int(t) for t in placed if site.links[t] == joint or (coupling is None and site.links[t] > joint)]
    if not own:
        where = f"link {joint} itself" if coupling else f"link {joint} or beyond"
        raise InputError(f"no target with a known place shows joint {joint}, expected one on {where}")
    alone = Slot(joint, tuple((t,) for t in own), FEWEST_STOPS)
    if coupling is None or not site.coupled[joint]:
        return [alone, alone]
    beyond = [int(t) for t in placed if site.links[t] > joint]
    if not beyond:
        raise InputError(
            f"no target with a known place shows what joint {joint} does to joint {joint + 1}, expected one on link "
            f"{joint + 1} or beyond"
        )
    return [Slot(joint, tuple((t, b) for t in own for b in beyond), FEWEST_PASSIVE_STOPS), alone]


def _shared(slots: tuple[Slot, ...], shots: int) -> list[int]:
    """Stops of each sweep to begin with: as even as the shots allow."""
    stops = [slot.fewest for slot in slots]
    left = shots - sum(slot.fewest * slot.cost for slot in slots)
    while True:
        affordable = [k for k, slot in enumerate(slots) if slot.cost <= left]
        if not affordable:
            return stops
        k = min(affordable, key=lambda k: stops[k])
        stops[k] += 1
        left -= slots[k].cost


class _Search:
    """The sweeps so far and what they tell together."""

    def __init__(
        self, site: Site, slots: tuple[Slot, ...], stops: list[int], rng: np.random.Generator, loss: Array | None
    ) -> None:
        self._site, self._slots, self._stops, self._rng, self._loss = site, slots, stops, rng, loss
        self._prior = vague(site)
        self._placed: list[Placed] = []

    def begin(self, effort: Effort) -> None:
        """For each sweep the longest of some random ones."""
        for slot, stops in zip(self._slots, self._stops, strict=True):
            found = self._proposals(slot, stops, effort.proposals)
            found = found or self._proposals(slot, stops, 20 * effort.proposals)
            if not found:
                raise InputError(
                    f"joint {slot.joint} cannot be seen moving by {np.rad2deg(SHORTEST_RAD):.0f} deg "
                    f"({SHORTEST_M * 1e3:.0f} mm where it slides) from where the stations stand"
                )
            self._placed.append(max(found, key=lambda p: p.high - p.low))

    def place(self, proposals: int) -> None:
        """Replace each sweep by the best of some random ones, if that is better."""
        for k, slot in enumerate(self._slots):
            rest = self._total() - self._placed[k].information
            tried = [self._placed[k], *self._proposals(slot, self._placed[k].stops, proposals)]
            self._placed[k] = tried[int(np.argmin(self._values(rest + np.stack([p.information for p in tried]))))]

    def share(self) -> None:
        """Move stops from one sweep to another as long as that helps."""
        best = self._values(self._total()[None])[0]
        near = [self._nearby(k) for k in range(len(self._slots))]
        while True:
            moves = list(self._moves(near))
            if not moves:
                return
            values = self._values(self._total() + np.stack([change for _, _, change in moves]))
            k = int(np.argmin(values))
            if not values[k] < best - 1e-9 * abs(best):
                return
            best = values[k]
            for index, placed in moves[k][:2]:
                self._placed[index] = placed
                near[index] = self._nearby(index)

    def sweeps(self) -> tuple[PlannedSweep, ...]:
        """The plan: numbered by joint."""
        out, counts = [], dict[int, int]()
        for slot, placed in zip(self._slots, self._placed, strict=True):
            counts[slot.joint] = counts.get(slot.joint, 0) + 1
            names = tuple(self._site.targets[t].name for t in placed.targets)
            held = tuple(float(v) for v in placed.held)
            out.append(
                PlannedSweep(slot.joint, counts[slot.joint], placed.low, placed.high, placed.stops, names, held=held)
            )
        return tuple(out)

    def _total(self) -> Array:
        return self._prior + np.sum([placed.information for placed in self._placed], axis=0)

    def _values(self, matrices: Array) -> Array:
        """The criterion of some information matrices (k, p, p), the less the better, (k,)."""
        if self._loss is None:
            return -np.linalg.slogdet(matrices)[1]
        return np.einsum("kij,ji->k", np.linalg.inv(matrices), self._loss)

    def _nearby(self, k: int) -> dict[int, Placed]:
        """A sweep with one or two stops more or fewer, as far as it can be made and seen so."""
        slot, placed = self._slots[k], self._placed[k]
        allowed = [by for by in (-2, -1, 1, 2) if placed.stops + by >= slot.fewest]
        return {by: found for by in allowed if (found := self._with_stops(slot, placed, by))}

    def _moves(self, near: list[dict[int, Placed]]) -> Iterator[tuple[tuple[int, Placed], tuple[int, Placed], Array]]:
        """Every way to take a stop or two from one sweep for another: both anew, and the change of information."""
        cost = [slot.cost for slot in self._slots]
        for i, k in permutations(range(len(near)), 2):
            for less, more in ((-1, 1), (-1, 2), (-2, 1)):
                if less in near[i] and more in near[k] and less * cost[i] + more * cost[k] == 0:
                    change = near[i][less].information + near[k][more].information
                    yield (i, near[i][less]), (k, near[k][more]), change - self._told(i) - self._told(k)

    def _told(self, k: int) -> Array:
        return self._placed[k].information

    def _with_stops(self, slot: Slot, placed: Placed, more: int) -> Placed | None:
        """The same sweep with more or fewer stops; None: not all of them can be seen."""
        ends = np.array([[placed.low, placed.high]])
        return next(iter(self._fitted(slot, placed.targets, placed.held[None], ends, placed.stops + more)), None)

    def _proposals(self, slot: Slot, stops: int, count: int) -> list[Placed]:
        """Random sweeps that can be made and seen."""
        site, out = self._site, []
        low, high = site.limits.T
        each = -(-count // len(slot.watched))
        shortest = SHORTEST_M if site.robot.sliding[slot.joint - 1] else SHORTEST_RAD
        for targets in slot.watched:
            held = self._rng.uniform(low, high, (each, len(low)))
            held[:, slot.joint - 1] = np.clip(site.centre[slot.joint - 1], low[slot.joint - 1], high[slot.joint - 1])
            held = rounded(site.robot, held)
            ends = visible_stretch(site, slot.joint, held, targets, stops)
            good = np.flatnonzero(ends[:, 1] - ends[:, 0] >= shortest)
            out += self._fitted(slot, targets, held[good], ends[good], stops)
        return out

    def _fitted(self, slot: Slot, targets: tuple[int, ...], held: Array, ends: Array, stops: int) -> list[Placed]:
        """Sweeps with what they tell, as far as every shot of theirs can be seen."""
        places = ends[:, :1] + np.linspace(0.0, 1.0, stops) * (ends[:, 1:] - ends[:, :1])
        commands = np.repeat(sweep_commands(self._site, slot.joint, held, places), len(targets), axis=0)
        target = np.tile(targets, len(held) * stops)
        seen = visible(self._site, commands, target).reshape(len(held), stops * len(targets)).all(axis=1)
        shots = np.repeat(seen, stops * len(targets))
        rows = whitened(self._site, commands[shots], target[shots])
        rows = rows.reshape(int(seen.sum()), 3 * stops * len(targets), len(self._prior))
        matrices = np.swapaxes(rows, 1, 2) @ rows
        return [
            Placed(targets, h, float(e[0]), float(e[1]), stops, m)
            for h, e, m in zip(held[seen], ends[seen], matrices, strict=True)
        ]


def sweep_commands(site: Site, joint: int, held: Array, places: Array) -> Array:
    """Commands (b * k, n) of sweeps held at commands (b, n), the motor displaced by places (b, k)."""
    motors = np.repeat(active_commands(site.robot, held)[:, None, :], places.shape[1], axis=1)
    motors[:, :, joint - 1] += places
    return commands_for(site.robot, motors.reshape(-1, held.shape[1]))


def visible_stretch(site: Site, joint: int, held: Array, targets: tuple[int, ...], stops: int) -> Array:
    """The longest stretch of the motor's displacement over which a sweep can be made and seen, (b, 2); empty: 0, 0.

    Args:
        held: commands of all joints where the displacement is 0, (b, n).
        stops: of the sweep, for half a step of way before the first one.
    """
    span = np.ptp(site.limits[joint - 1]) * (1 - 2 * MARGIN)
    grid = np.linspace(-span, span, 2 * GRID - 1)
    places = np.tile(grid, (len(held), 1))
    commands = sweep_commands(site, joint, held, places)
    allowed = within_limits(site, commands)
    seen = allowed.copy()
    for target in targets:
        rows = np.flatnonzero(seen)
        seen[rows] = visible(site, commands[rows], np.full(len(rows), target))
    allowed, seen = allowed.reshape(places.shape), seen.reshape(places.shape)
    out, unit = np.zeros((len(held), 2)), command_steps(site.robot)[joint - 1]
    for row in range(len(held)):
        first, last = longest_run(seen[row])
        if last <= first:
            continue
        half = (grid[last] - grid[first]) / (stops - 1) / 2
        lowest = grid[np.argmax(allowed[row])]
        low, high = max(grid[first], lowest + half), grid[last]
        out[row] = np.ceil(low / unit) * unit, np.floor(high / unit) * unit
    return out


def longest_run(flags: np.ndarray) -> tuple[int, int]:
    """First and last index of the longest run of True; (0, -1) without any."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    if len(edges) == 0:
        return 0, -1
    starts, ends = edges[::2], edges[1::2] - 1
    k = int(np.argmax(ends - starts))
    return int(starts[k]), int(ends[k])
