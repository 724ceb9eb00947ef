"""Where the targets of a simulated cell truly are, with whatever faults were added to it."""

from dataclasses import replace

import numpy as np

from core.errors import InputError
from core.geometry import Array, invert, joint_motion, rotation_about
from core.phi_model import PhiModel, axes, frames
from core.twin.cell import Cell, Truth, carried
from core.twin.effect_units import Quantity
from core.twin.effects import Effect, check_effect
from core.twin.joint_faults import Motion, joint_errors
from core.twin.structure_faults import flexure, grown_link, growth, wobble

DRIFT_DIRECTION = np.array([0.6, -0.64, 0.48])
BASE_DIRECTION = np.array([0.48, 0.64, 0.6])
SLIP_DIRECTION = np.array([0.64, 0.48, -0.6])
"""Unit vectors in which drifting, shifted and slipped things go; the last one in the frame of the target's link."""


def true_points(cell: Cell, effects: tuple[Effect, ...] = ()) -> Array:
    """Where the target of each row truly is, (m, 3), in the instrument's frame.

    Raises:
        InputError: an effect names something that the cell has not, or cannot be made.
    """
    if not effects:
        return cell.points_m
    _check(cell, effects)
    faulty = replace(cell, truth=_with_geometry(cell.truth, effects))
    extra_kg = sum(effect.size for effect in effects if effect.name == "payload")
    motion = Motion(faulty, faulty.truth.frames_at_rest(), extra_kg)
    arm = faulty.truth.arm
    active = motion.active + joint_errors(effects, motion)
    net = arm.net_of_active(active) + _new_couplings(effects, active)
    rest = _rest_points(faulty, effects, motion)
    links = cell.target_links[cell.schedule.target]
    return _outside(cell, effects, carried(_chain(effects, motion, net), links, rest), links)


def faulty_truth(cell: Cell, effects: tuple[Effect, ...] = ()) -> Truth:
    """The arm with the faults of its geometry; all others are left out.

    Raises:
        InputError: an effect names something that the cell has not.
    """
    _check(cell, effects)
    return _with_geometry(cell.truth, effects)


def _check(cell: Cell, effects: tuple[Effect, ...]) -> None:
    names, count = [target.name for target in cell.targets], len(cell.schedule.stop)
    for effect in effects:
        check_effect(effect, cell.robot)
        if effect.target is not None and effect.target not in names:
            raise InputError(
                f"effect {effect.name}: there is no target {effect.target!r}; expected one of {', '.join(names)}"
            )
        if effect.record is not None and not 1 <= effect.record <= count:
            raise InputError(f"effect {effect.name}: there is no record {effect.record}, expected 1..{count}")


def _with_geometry(true: Truth, effects: tuple[Effect, ...]) -> Truth:
    """geometry: a parameter of a frame + size; axes and targets beyond it move along."""
    values = true.phi.parameters.copy()
    for effect in effects:
        if effect.name == "geometry":
            values[effect.joint - 1, ("a", "b", "alpha", "theta").index(effect.parameter)] += effect.size
    if np.array_equal(values, true.phi.parameters):
        return true
    phi = PhiModel(true.phi.phi_rad, *values.T, sliding=true.phi.sliding)
    carry = frames(phi, np.zeros(len(phi.sliding)), true.base) @ invert(true.frames_at_rest())
    points = carried(carry[None].repeat(len(true.links), axis=0), true.links, true.rest_points_m)
    return replace(true, phi=phi, rest_points_m=points, arm=replace(true.arm, axes=axes(phi, true.base)))


def _new_couplings(effects: tuple[Effect, ...], active: Array) -> Array:
    """coupling: the net displacement of a joint + size times the active one of another."""
    added = np.zeros_like(active)
    for effect in effects:
        if effect.name == "coupling":
            added[:, effect.joint - 1] += effect.size * active[:, effect.source - 1]
    return added


def _rest_points(cell: Cell, effects: tuple[Effect, ...], motion: Motion) -> Array:
    """The target of each row with the arm at rest, (m, 3): slipped or on a link that grew."""
    rows, true = cell.schedule, cell.truth
    rest = true.rest_points_m[rows.target]
    links = cell.target_links[rows.target]
    for effect in effects:
        if effect.name == "target_slip":
            which = [target.name for target in cell.targets].index(effect.target)
            begins = effect.record or _middle_record(rows.target, which)
            slipped = (rows.target == which) & (np.arange(1, len(rest) + 1) >= begins)
            axes_of_link = motion.frames_at_rest[cell.target_links[which] - 1][:3, :3]
            rest[slipped] += effect.size * (axes_of_link @ SLIP_DIRECTION)
        elif effect.name == "thermal":
            grows = np.isin(links, effect.joints(cell.robot.joint_count))
            origins = motion.frames_at_rest[links - 1, :3, 3]
            rest += np.where(grows, growth(effect, motion), 0.0)[:, None] * (rest - origins)
    return rest


def _middle_record(seen: np.ndarray, which: int) -> int:
    """The record in the middle of those that show a target."""
    records = np.flatnonzero(seen == which) + 1
    return int(records[len(records) // 2])


def _chain(effects: tuple[Effect, ...], motion: Motion, net: Array) -> Array:
    """How each link moves, (m, n, 4, 4), with the faults of bearings and links in between."""
    out, so_far = np.empty_like(motion.links), np.eye(4)
    lines, count = motion.cell.truth.arm.axes, net.shape[1]
    for i, line in enumerate(lines):
        for effect in effects:
            if effect.name == "axis_wobble" and effect.joint == i + 1:
                so_far = so_far @ wobble(effect, motion, i + 1)
        so_far = so_far @ joint_motion(line, net[:, i], motion.slides(i + 1))
        out[:, i] = so_far
        for effect in effects:
            if i + 1 not in effect.joints(count):
                continue
            if effect.name == "thermal":
                so_far = so_far @ grown_link(growth(effect, motion), motion, i + 1)
            elif effect.name == "flexure":
                so_far = so_far @ flexure(effect, motion, i + 1)
                if i + 1 == count:
                    out[:, i] = so_far
    return out


def _outside(cell: Cell, effects: tuple[Effect, ...], points_m: Array, links: np.ndarray) -> Array:
    """base_shift, drift and scale: what happens to base and instrument, in this order."""
    points, records = points_m.copy(), np.arange(1, len(points_m) + 1)
    for effect in effects:
        if effect.name == "base_shift":
            moved = (records >= effect.record) & (links > 0)
            points[moved] = _shifted_base(effect, cell.truth.base, points[moved])
    for effect in effects:
        if effect.name == "drift":
            points += effect.size * cell.schedule.time_s[:, None] * DRIFT_DIRECTION
    return points * (1.0 + sum(effect.size for effect in effects if effect.name == "scale"))


def _shifted_base(effect: Effect, base: Array, points_m: Array) -> Array:
    if effect.quantity is Quantity.LENGTH:
        return points_m + effect.size * BASE_DIRECTION
    origin, up = base[:3, 3], base[:3, 2]
    return origin + (points_m - origin) @ rotation_about(up, effect.size).T
