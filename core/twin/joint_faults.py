"""Faults of drives: each changes what a joint's own motor makes of its command.

Every function gives what is added to the active displacements, shape (m,) for one joint; x is the displacement of a
healthy drive, counted from home, rad or m.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.errors import InputError
from core.geometry import Array
from core.twin.cell import Cell, chain
from core.twin.effect_units import Quantity
from core.twin.effects import Effect
from core.twin.gravity import Loads, drive_loads, joint_loads, own_loads

SPINDLE_TURN_M = 0.04
"""Travel of a sliding joint for one turn of its spindle."""
MESH_ORDER = 9.5
BUILD_UP_RAD, BUILD_UP_M = np.deg2rad(5.0), 0.01
"""Travel after a reversal over which 63 % of the lost motion of hysteresis has built up."""
LINKAGE_REACH_RAD = np.deg2rad(75.0)
"""A parallelogram that stands square at home nears its dead point beyond this."""
COUPLER_CRANKS = 3.0
"""Length of a linkage's coupler and ground bar, in cranks."""


@dataclass(frozen=True)
class Motion:
    """A healthy arm going through its schedule, row by row, and what pulls at it."""

    cell: Cell
    frames_at_rest: Array
    """(n, 4, 4), in the instrument's frame."""
    extra_kg: float
    """Mass at the tool that nobody knows of."""

    @cached_property
    def stop(self) -> np.ndarray:
        return self.cell.schedule.stop

    @cached_property
    def active(self) -> Array:
        """Active displacements, (m, n)."""
        return self.cell.truth.arm.active(self.cell.schedule.commanded)[self.stop]

    @cached_property
    def links(self) -> Array:
        """How each link has moved from rest, (m, n, 4, 4)."""
        arm = self.cell.truth.arm
        return chain(arm.axes, self.cell.robot.sliding, arm.net_of_active(self.active))

    @cached_property
    def loads(self) -> Loads:
        """The weights of links and payload."""
        return own_loads(self.cell.robot, self.frames_at_rest, self.links, self.extra_kg)

    @cached_property
    def torques(self) -> Array:
        """Of all weights on the drives, (m, n), N m or N."""
        return self.held(self.loads)

    def held(self, loads: Loads) -> Array:
        """What the drives have to hold of some loads, (m, n), N m or N."""
        robot = self.cell.robot
        return drive_loads(robot, joint_loads(loads, self.frames_at_rest, self.links, robot.sliding))

    def slides(self, joint: int) -> bool:
        return self.cell.robot.joints[joint - 1].slides

    def turned(self, joint: int) -> Array:
        """x as an angle that comes round once a turn, (m,), rad."""
        x = self.active[:, joint - 1]
        return x * (2 * np.pi / SPINDLE_TURN_M) if self.slides(joint) else x


def joint_errors(effects: tuple[Effect, ...], motion: Motion) -> Array:
    """What all faults of drives add to the active displacements, (m, n)."""
    total = np.zeros_like(motion.active)
    for effect in effects:
        if effect.name in FAULTS:
            for joint in effect.joints(total.shape[1]):
                # 'all' with an angle means all that turn.
                if effect.quantity is not (Quantity.ANGLE if motion.slides(joint) else Quantity.LENGTH):
                    total[:, joint - 1] += FAULTS[effect.name](effect, motion, joint)
        elif effect.name == "payload":
            total += _payload(motion)
    return total


def _zero_offset(effect: Effect, motion: Motion, joint: int) -> Array:
    """size"""
    return np.full(len(motion.stop), effect.size)


def _ratio(effect: Effect, motion: Motion, joint: int) -> Array:
    """size x"""
    return effect.size * motion.active[:, joint - 1]


def _eccentricity(effect: Effect, motion: Motion, joint: int) -> Array:
    """size (0.8 sin u + 0.6 cos u)"""
    u = motion.turned(joint)
    return effect.size * (0.8 * np.sin(u) + 0.6 * np.cos(u))


def _mesh(effect: Effect, motion: Motion, joint: int) -> Array:
    """size sin(9.5 u + 0.5)"""
    return effect.size * np.sin(MESH_ORDER * motion.turned(joint) + 0.5)


def _backlash(effect: Effect, motion: Motion, joint: int) -> Array:
    """-size/2 in the sense in which the motor arrived; the arm is balanced, so that no weight holds a flank"""
    return -effect.size / 2 * motion.cell.schedule.approach[motion.stop, joint - 1]


def _hysteresis(effect: Effect, motion: Motion, joint: int) -> Array:
    """Lost motion that tends to -size/2 sign(approach) with the motor's travel since it last turned round"""
    rows = motion.cell.schedule
    places, at_stop = rows.path
    scale = BUILD_UP_M if motion.slides(joint) else BUILD_UP_RAD
    travel = np.abs(np.diff(places[:, joint - 1], prepend=places[0, joint - 1]))
    limits = -effect.size / 2 * rows.path_senses[:, joint - 1]
    lost, now = np.empty(len(places)), -effect.size / 2
    for k, (limit, kept) in enumerate(zip(limits, np.exp(-travel / scale), strict=True)):
        now = limit + (now - limit) * kept
        lost[k] = now
    return lost[at_stop][motion.stop]


def _compliance(effect: Effect, motion: Motion, joint: int) -> Array:
    """size times the torque (force) of gravity on the drive; size = 1/stiffness"""
    return effect.size * motion.torques[:, joint - 1]


def _latency(effect: Effect, motion: Motion, joint: int) -> Array:
    """-size times the motor's speed"""
    return -effect.size * motion.cell.schedule.speed[motion.stop, joint - 1]


def _linkage(effect: Effect, motion: Motion, joint: int) -> Array:
    """A parallelogram at right angles at home: crank 1, coupler 3, ground 3, output crank 1 + size"""
    x = motion.active[:, joint - 1]
    if np.abs(x).max() > LINKAGE_REACH_RAD:
        turns = f"joint {joint} turns by {np.rad2deg(np.abs(x).max()):.0f} deg from home"
        raise InputError(f"effect linkage: {turns}, a parallelogram can follow {np.rad2deg(LINKAGE_REACH_RAD):.0f} deg")
    return _rocker(x, effect.size) - _rocker(np.zeros(1), effect.size) - x


def _rocker(x: Array, longer: float) -> Array:
    """Turn of the output crank, from the loop |end of crank - end of output crank| = coupler."""
    crank_end = np.exp(1j * (np.pi / 2 + x)) - COUPLER_CRANKS
    output = 1.0 + longer
    reach = np.abs(crank_end)
    cosine = (reach**2 + output**2 - COUPLER_CRANKS**2) / (2 * reach * output)
    if np.any(np.abs(cosine) > 1):
        raise InputError(f"effect linkage: with an output crank longer by {longer:g} the linkage does not reach round")
    # Of the two ways to close the loop the parallelogram's, not the crossed one.
    return np.angle(crank_end) - np.arccos(cosine) - np.pi / 2


def _quantisation(effect: Effect, motion: Motion, joint: int) -> Array:
    """What rounding x to whole steps of the encoder adds"""
    x = motion.active[:, joint - 1]
    return effect.size * np.round(x / effect.size) - x


def _payload(motion: Motion) -> Array:
    """Torque of the unknown mass over the cell's joint stiffness, (m, n)"""
    if motion.cell.stiffness is None:
        raise InputError(f"effect payload: the joints of {motion.cell.robot.name} are rigid, so no mass shows")
    cell = motion.cell
    load = own_loads(cell.robot, motion.frames_at_rest, motion.links, motion.extra_kg, links=False)
    return motion.held(load) / cell.stiffness


FAULTS: dict[str, Callable[[Effect, Motion, int], Array]] = {
    "zero_offset": _zero_offset,
    "ratio": _ratio,
    "eccentricity": _eccentricity,
    "mesh": _mesh,
    "backlash": _backlash,
    "hysteresis": _hysteresis,
    "compliance": _compliance,
    "latency": _latency,
    "linkage": _linkage,
    "quantisation": _quantisation,
}
