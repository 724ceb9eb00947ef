"""What weights do: drives give, links bend and twist, and the tool carries more than the sim thinks."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from core.gap.doings import Doings
from core.gap.effects.candidate import ANGLE, Candidate, Column, drive, driven, unit
from core.gap.observations import Observations
from core.gap.result import Place
from core.gap.sim import Part, Slot
from core.geometry import Array
from core.robot import Robot

TINY = 1e-9
NEARLY_ALONG = 0.99
"""Cosine beyond which a link runs along its joint's axis."""
Load = Callable[[Doings], Array]
"""What turns one motor at every point, N m or N, (m,)."""
ROUGHLY = 0.3
"""How far off masses may well be, as a share."""
NEAR_M = 0.1
"""How far from the tool's point a payload's centre may well be."""
LEAST_TORQUE = 0.02
"""Torques that change by less bend nothing, N m."""
LEAST_SHARE = 0.02
"""A load below this share of the largest of its kind is none."""


def compliances(doings: Doings) -> list[Candidate]:
    """g = q + load / stiffness, the load from gravity and payload, or as the robot reports it."""
    out = []
    if doings.drive_load is not None:
        for j in driven(doings):
            if _loaded(doings.drive_load, j):
                out.append(_compliance(doings, j, "torque from weights", _from_weights(j)))
            if _loaded(doings.drive_load, j) or _loaded_off_centre(doings, j):
                out.append(_generous_compliance(doings, j))
    torque = doings.logged("torque_nm")
    if torque is not None:
        out += [
            _compliance(doings, j, "torque as reported", _reported(j)) for j in driven(doings) if _loaded(torque, j)
        ]
    return out


def flexures(doings: Doings) -> list[Candidate]:
    """A link turns about its middle under the moment that it passes on, or bends as a beam that is clamped."""
    moment = doings.middle_moment
    if moment is None:
        return []
    largest = np.abs(moment).max()
    links = [
        i
        for i in range(min(doings.seen.joint_count, doings.seen.link.max()))
        if np.ptp(moment[:, i], axis=0).max() > LEAST_SHARE * max(largest, 1e-9)
    ]
    return [
        _flexure(doings, i, float(np.abs(moment[:, i]).max()), bend, rough)
        for i in links
        for bend in (_hinged, _clamped)
        for rough in (False, True)
    ]


def payloads(doings: Doings) -> list[Candidate]:
    """The drives give under a mass at the tool that the sim does not carry: logged, or always there."""
    per_kg = doings.kilogram_load
    if per_kg is None:
        return []
    out = []
    for logged in (False, True):
        if logged and np.ptp(doings.seen.payload_kg) == 0:
            continue
        acting = per_kg * doings.seen.payload_kg[:, None] if logged else per_kg
        heaviest = {j: float(np.abs(per_kg[:, j]).max()) for j in driven(doings) if _loaded(acting, j)}
        if heaviest:
            out += [_payload(doings, heaviest, logged, centre) for centre in (False, True)]
    return out


def _loaded_off_centre(doings: Doings, joint: int) -> bool:
    """Whether a payload beside the tool's point would load a joint that it does not load at that point."""
    offset = NEAR_M * doings.seen.payload_kg[:, None] * doings.offset_load[:, joint]
    return bool(np.ptp(offset, axis=0).max() > LEAST_TORQUE)


def _generous_compliance(doings: Doings, joint: int) -> Candidate:
    """The same where masses and the payload's centre are known roughly only, or the drive stiffens."""
    plain = _compliance(doings, joint, "torque from weights that are roughly known", _from_weights(joint))
    off = NEAR_M * doings.seen.payload_kg[:, None] * doings.offset_load[:, joint]
    largest = max(ANGLE / plain.reference[0], float(np.abs(off).max()))

    def columns(doings: Doings) -> list[Column]:
        load, own = doings.drive_load[:, joint], doings.own_load[:, joint]
        offset = doings.seen.payload_kg[:, None] * doings.offset_load[:, joint]
        extra = (own, load * np.abs(load) / largest, *offset.T)
        return plain.columns(doings) + [drive(doings, joint, feature) for feature in extra]

    name = plain.names[0]
    names = (
        name,
        *(f"{what}_{name}" for what in ("own_weight", "at_full_load", *(f"offset_{a}_times" for a in "xyz"))),
    )
    one = ANGLE / largest
    rough, near = ROUGHLY * one, NEAR_M * one
    return replace(plain, names=names, columns=columns, reference=(one, rough, rough, near, near, near))


def _loaded(load: Array, joint: int) -> bool:
    return bool(np.ptp(load[:, joint]) > LEAST_SHARE * max(float(np.abs(load).max()), 1e-9))


def _from_weights(joint: int) -> Load:
    return lambda doings: doings.drive_load[:, joint]


def _reported(joint: int) -> Load:
    def torque(doings: Doings) -> Array:
        logged = doings.logged("torque_nm")
        return np.zeros(doings.count) if logged is None else logged[:, joint]

    return torque


def _compliance(doings: Doings, joint: int, atom: str, load: Load) -> Candidate:
    of, force = unit(doings, joint), "n" if doings.seen.chain.sliding[joint] else "nm"
    largest = max(float(np.abs(load(doings)).max()), 1e-9)

    def columns(doings: Doings) -> list[Column]:
        return [drive(doings, joint, load(doings))]

    return Candidate(
        Place("compliance", joint=joint + 1), atom, (f"give_{of}_per_{force}",), columns, 1, (ANGLE / largest,)
    )


BEAM = ("its_length", "its_side", "its_height")
Bend = Callable[[Doings, int, Array, Array, Array], list[Column]]
"""How a link gives about each of its axes, for a moment at its middle, a force that it carries and its own weight, each
(m, 3)."""


def _flexure(doings: Doings, link: int, largest: float, bend: Bend, rough: bool) -> Candidate:
    clamped, tilting = bend is _clamped, _tilting(doings.seen.chain, link)
    unsure = _height_is_unknown(doings.seen)

    def columns(doings: Doings) -> list[Column]:
        loads, payload_kg = doings.loads, doings.seen.payload_kg[:, None]
        one_kg, carried_kg = loads.force_kilogram[:, link], loads.carried_kg[link]
        own, none = loads.link_kg[link] * one_kg, 0.0 * one_kg
        force = (carried_kg + payload_kg) * one_kg
        out = bend(doings, link, doings.middle_moment[:, link], force, own if clamped else none)
        if rough:
            out += bend(doings, link, loads.middle_own[:, link], carried_kg * one_kg, none)
            # Its own weight does not twist a link.
            out += bend(doings, link, none, none, own)[1:]
            offset = payload_kg[:, :, None] * loads.middle_offset[:, link]
            out += [one for c in range(3) for one in bend(doings, link, offset[:, :, c], none, none)]
            if unsure:
                out += _higher(doings, link, own if clamped else none, tilting)
        return out

    names = tuple(f"give_about_{axis}_rad_per_nm" for axis in BEAM)
    reference = (ANGLE / max(largest, 1e-9),) * 3
    if rough:
        names += tuple(f"own_weight_give_about_{axis}_rad_per_nm" for axis in BEAM)
        names += tuple(f"link_weight_give_about_{axis}_rad_per_nm" for axis in BEAM[1:])
        names += tuple(f"offset_{c}_times_give_about_{axis}_rad_per_nm" for c in "xyz" for axis in BEAM)
        reference += (ROUGHLY * reference[0],) * 3
        reference += ((ROUGHLY if clamped else 1.0) * reference[0],) * 2 + (NEAR_M * reference[0],) * 9
        if unsure:
            names += tuple(f"height_times_give_about_{BEAM[k]}_m_per_nm" for k in tilting)
            reference += (NEAR_M * reference[0],) * len(tilting)
    words = (["as a clamped beam"] if clamped else []) + (["weights roughly known"] if rough else [])
    return Candidate(Place("flexure", joint=link + 1), ", ".join(words), names, columns, 4, reference)


def _height_is_unknown(seen: Observations) -> bool:
    """Whether all axes are parallel and no target's place is known: the base may be higher and the targets lower."""
    along = np.abs(seen.chain.link_transforms[:-1, 2, 2])
    free = all(seen.campaign.targets[t].point_m is None for t in np.unique(seen.target))
    return bool(free and (along > 1 - TINY).all())


def _tilting(chain: Robot, link: int) -> list[int]:
    """The axes of a beam about which it tilts its joint's axis."""
    beam = beam_axes(chain.link_transforms[link, :3, 3])
    return [k for k, about in enumerate(beam) if np.hypot(about[0], about[1]) > TINY]


def _higher(doings: Doings, link: int, weight: Array, tilting: list[int]) -> list[Column]:
    """What a link's turns move more where the arm stands higher than it is thought to, by a metre."""
    along, moment = 2 * doings.loads.middle_m[link], doings.middle_moment[:, link]
    out = []
    for about in beam_axes(along)[tilting]:
        angle, shift = moment @ about + weight @ np.cross(about, along) / 6, np.cross([0.0, 0.0, 1.0], about)
        out.append([(Slot(Part.BEYOND, link, 3 + c), angle * shift[c]) for c in range(3) if abs(shift[c]) > TINY])
    return out


def _hinged(doings: Doings, link: int, moment: Array, force: Array, weight: Array) -> list[Column]:
    """The link turns about its middle; half of its own weight lies beyond, on average a quarter of its length away."""
    middle = doings.loads.middle_m[link]
    out = []
    for about in beam_axes(middle):
        angle = moment @ about + weight @ np.cross(about, 2 * middle) / 8
        motion = np.concatenate([about, np.cross(middle, about)])
        out.append([(Slot(Part.BEYOND, link, c), angle * motion[c]) for c in range(6) if abs(motion[c]) > TINY])
    return out


def _clamped(doings: Doings, link: int, moment: Array, force: Array, weight: Array) -> list[Column]:
    """The link bends as a cantilever (Euler and Bernoulli): its slope is a turn about the middle, its tip goes farther.

    For a stiffness of one a force f at the end of a length l makes a slope f l^2 / 2 and a shift f l^3 / 3, of which a
    turn about the middle by that slope makes f l^3 / 4. A weight w spread evenly makes w l^2 / 6 and w l^3 / 8, and the
    turn w l^3 / 12 of it.
    """
    along = 2 * doings.loads.middle_m[link]
    out = []
    for about in beam_axes(along):
        across = np.cross(about, along)
        slope = moment @ about + weight @ across / 6
        farther = (force @ across / 12 + weight @ across / 24)[:, None] * across
        turn, shift = slope[:, None] * about, farther + slope[:, None] * np.cross(along / 2, about)
        motion = np.concatenate([turn, shift], axis=1)
        moves = np.abs(np.concatenate([about, np.maximum(np.abs(across), np.abs(np.cross(along, about)))])) > TINY
        out.append([(Slot(Part.BEYOND, link, int(c)), motion[:, c]) for c in np.flatnonzero(moves)])
    return out


def beam_axes(along: Array) -> Array:
    """Axes that a link bends and twists about, in its frame: along it, across its joint's axis, and square to both."""
    length = float(np.linalg.norm(along))
    x = along / length if length > TINY else np.array([1.0, 0.0, 0.0])
    side = np.cross([0.0, 0.0, 1.0] if abs(x[2]) < NEARLY_ALONG else [0.0, 1.0, 0.0], x)
    y = side / np.linalg.norm(side)
    return np.array([x, y, np.cross(x, y)])


def _payload(doings: Doings, heaviest: dict[int, float], logged: bool, centre: bool) -> Candidate:
    def columns(doings: Doings) -> list[Column]:
        kg = doings.seen.payload_kg if logged else np.ones(doings.count)
        out = [drive(doings, j, kg * doings.kilogram_load[:, j]) for j in heaviest]
        if centre:
            for k in range(3):
                shares = [(j, kg * doings.offset_load[:, j, k] / heaviest[j]) for j in heaviest]
                out.append([term for j, feature in shares for term in drive(doings, j, feature)])
        return out

    atom = ("of the logged payload" if logged else "always there") + (", its centre elsewhere" if centre else "")
    names = tuple(
        f"give_of_joint_{j + 1}_{unit(doings, j)}_per_{'n' if doings.seen.chain.sliding[j] else 'nm'}" for j in heaviest
    )
    reference = tuple(ANGLE / h for h in heaviest.values())
    if centre:
        names += tuple(f"offset_{axis}_times_give_rad" for axis in "xyz")
        reference += (ANGLE * NEAR_M,) * 3
    return Candidate(Place("payload"), atom, names, columns, 4, reference)
