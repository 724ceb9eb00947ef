"""How the arm came to each point: the path of its motors through all records, also those where nothing was measured."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from core.gap.loads import Loads, loads
from core.gap.observations import Observations
from core.geometry import Array
from core.kinematics import active_commands, nominal_net

STILL = 1e-9
"""A motor that moves by less stands still, rad or m."""
FEWEST_STEPS, MOST_STEPS, MOST_PLACES = 2, 10, 80_000
"""Places between two records at which gravity is asked which flank of a gear it presses on."""


@dataclass(frozen=True, eq=False)
class History:
    """The path of the motors, in the order of the records."""

    active: Array
    """Where the motors were asked to be, record by record, (w, n)."""
    payload_kg: Array
    """(w,)"""
    logged_sense: np.ndarray
    """Sense in which each motor reached the record as somebody wrote it down, +1, -1, 0: not said, (w, n)."""
    last: np.ndarray
    """The place on the path of each point of the gap, (m,)."""
    complete: bool
    """Whether approach moves or senses were logged at all."""
    seen: Observations

    @cached_property
    def step(self) -> Array:
        """How far each motor went to reach a record, 0 where it stood still, (w, n)."""
        step = np.diff(self.active, axis=0, prepend=self.active[:1])
        step = np.where(np.abs(step) < STILL, 0.0, step)
        contradicted = (self.logged_sense != 0) & (np.sign(step) != self.logged_sense)
        return np.where(contradicted, self.logged_sense * np.maximum(np.abs(step), 10 * STILL), step)

    @cached_property
    def sense(self) -> np.ndarray:
        """Sense in which each motor last moved before a record, (w, n); 0 before the first motion."""
        return _last_event(np.sign(self.step))

    @cached_property
    def travel(self) -> Array:
        """How far each motor has gone since it last turned round, rad or m, (w, n)."""
        previous = np.vstack([np.zeros((1, self.step.shape[1])), self.sense[:-1]])
        turned = (self.step != 0) & (np.sign(self.step) != previous)
        gone = np.cumsum(np.abs(self.step), axis=0)
        before = np.where(turned, gone - np.abs(self.step), -1.0)
        return gone - np.maximum(np.maximum.accumulate(before, axis=0), 0.0)

    def dragged(self, joint: int, way: float) -> Array:
        """How far a joint trails its motor at each point of the gap, -1 to 1, (m,), where that builds up along a way.

        Every motion takes it nearer to the side it comes from, by the share 1 - exp(-|motion| / way), and short
        reversals take back but a part of it (Dahl 1968, a solid friction model). Joints count from 0; way in rad or m.
        """
        step = self.step[:, joint]
        kept = np.exp(-np.abs(step) / way)
        return running(kept, np.sign(step) * (1.0 - kept))[self.last]

    @cached_property
    def _between(self) -> tuple[Array, Array]:
        """Loads that turn each motor at places on the way to each record, (w, steps, n), and the senses of motion."""
        w, n = self.active.shape
        steps = int(np.clip(MOST_PLACES // max(w, 1), FEWEST_STEPS, MOST_STEPS))
        share = (np.arange(1, steps + 1) / steps)[None, :, None]
        way = np.diff(self.active, axis=0, prepend=self.active[:1])
        places = (self.active - way)[:, None] + way[:, None] * share
        flat = places.reshape(-1, n)
        found = loads(self.seen.chain, net_of(self.seen, flat))
        if found is None:
            return np.zeros((w, steps, n)), np.sign(self.step)
        kg = np.repeat(self.payload_kg, steps)
        return drive_load(self.seen, found, kg).reshape(w, steps, n), np.sign(self.step)

    def flank(self, joint: int, friction: float) -> Array:
        """The flank of a drive's gear that the joint rests on at each point of the gap, +1 or -1, (m,).

        A load above the friction of the joint (N m, N) presses it on its own flank; below, the motor drags the joint
        behind it; at rest it stays where it is; 0 before anything moved it. Joints count from 0.
        """
        load, sense = self._between
        load, sense = load[:, :, joint], sense[:, None, joint]
        event = np.where(np.abs(load) > friction, np.sign(load), -sense).ravel()
        state = _last_event(event[:, None])[:, 0].reshape(load.shape)[:, -1]
        logged = self.logged_sense[:, joint]
        loose = np.abs(load[:, -1]) <= friction
        state = np.where((logged != 0) & loose, -logged, state)
        return state[self.last]

    def part(self, keep: np.ndarray) -> "History":
        """The same path for some of the points of the gap."""
        return replace(self, last=self.last[keep], seen=self.seen.part(keep))


def history(seen: Observations) -> History:
    """The path of the motors of a campaign."""
    table = seen.campaign.measurements
    order = np.argsort(table.record, kind="stable")
    order = order[np.isfinite(table.commanded[order]).all(axis=1)]
    place = np.full(table.count, -1)
    place[order] = np.arange(len(order))
    kg = np.zeros(len(order)) if table.payload_kg is None else np.nan_to_num(table.payload_kg[order], nan=-1.0)
    known = np.where(kg >= 0, np.arange(len(kg)), 0)
    return History(
        active=motors_of(seen, table.commanded[order]),
        payload_kg=np.maximum(kg[np.maximum.accumulate(known)], 0.0),
        logged_sense=table.approach[order],
        last=place[seen.rows],
        complete=bool((table.phase == "move").any() or (table.approach != 0).any()),
        seen=seen,
    )


def motors_of(seen: Observations, commanded: Array) -> Array:
    """What commands, or their rates, ask of each motor, (w, n); of an arm seen without couplings: of each joint."""
    robot = seen.campaign.robot
    active = active_commands(robot, commanded)
    if seen.chain.couplings or not robot.couplings:
        return active
    return nominal_net(robot, commanded)


def net_of(seen: Observations, active: Array) -> Array:
    """Net displacements for what the motors do, (m, n)."""
    net = active.copy()
    net[:, 1:] += seen.chain.coupling_gains[1:] * active[:, :-1]
    return net


def drive_load(seen: Observations, found: Loads, payload_kg: Array) -> Array:
    """The load that turns each motor in its positive sense, N m or N, (m, n)."""
    turning = found.joint_own[:, :, 2] + payload_kg[:, None] * found.joint_kilogram[:, :, 2]
    sliding = found.force_own[:, :, 2] + payload_kg[:, None] * found.force_kilogram[:, :, 2]
    on_joints = np.where(seen.chain.sliding, sliding, turning)
    held = on_joints.copy()
    held[:, :-1] += seen.chain.coupling_gains[1:] * on_joints[:, 1:]
    return held


def running(kept: Array, added: Array) -> Array:
    """x_k = kept_k x_{k-1} + added_k from x = 0, (w,), by doubling the stretch that is summed up."""
    kept, out, stretch = kept.copy(), added.copy(), 1
    while stretch < len(out):
        out[stretch:] = out[stretch:] + kept[stretch:] * out[:-stretch]
        kept[stretch:] = kept[stretch:] * kept[:-stretch]
        stretch *= 2
    return out


def _last_event(event: Array) -> Array:
    """The last value other than 0 up to each row, 0 before the first, (w, n)."""
    rows = np.where(event != 0, np.arange(len(event))[:, None], -1)
    last = np.maximum.accumulate(rows, axis=0)
    return np.where(last >= 0, np.take_along_axis(event, np.maximum(last, 0), axis=0), 0.0)
