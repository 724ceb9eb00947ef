"""A simulated cell around any robot: somebody's own arm, a little off its drawing, for practice before the real one.

Nothing of it was measured. The errors are of the size that real arms have, drawn from a seed: axes tilted and shifted,
drives with periodic errors, couplings a little off their gains. Targets whose place is not known sit off the axis of
their link, each at a place of its own.
"""

from dataclasses import replace
from zlib import crc32

import numpy as np

from core.arm import Arm
from core.geometry import Array, Line, invert, perpendicular_basis, rotation_about, transform
from core.kinematics import link_frames
from core.measurements import Instrument, Target
from core.motion_forms import MotionForm, MotionFunction, coupling_form, transmission_form
from core.phi_convention import convention_of
from core.phi_model import PhiModel, frames, from_axes, near
from core.robot import Coupling, Joint, JointKind, Robot
from core.twin.cell import Cell, Truth, attached
from core.twin.instruments import PointInstrument
from core.twin.noise import Repeatability
from core.twin.protocol import Protocol

TILT_RAD, SHIFT_M = 1e-3, 1e-3
"""Standard deviation of the error of an axis, in each direction."""
OF_PRIOR = 0.03
"""Errors of drives and couplings, as a share of what ``MotionForm.prior_std`` allows for."""
SIGMA_M = 5e-5
"""Of an instrument that promises nothing."""
LEAST_REACH_M = 0.3
INSTRUMENT_HEIGHT_M = 1.5
"""Of the instrument above the floor on which the robot stands."""
SECONDS_A_SHOT = 20.0


class Stated(PointInstrument):
    """An instrument that does exactly what it promises, alike in all directions."""

    def __init__(self, instrument: Instrument) -> None:
        self._statement = instrument
        self._sigma_m = instrument.sigma_m or SIGMA_M

    @property
    def statement(self) -> Instrument:
        return self._statement

    def measure(self, points_m: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        return points_m + self._sigma_m * rng.normal(size=points_m.shape), self.covariance(points_m)

    def covariance(self, points_m: Array) -> Array:
        return np.broadcast_to(self._sigma_m**2 * np.eye(3), (len(points_m), 3, 3)).copy()


def own_cell(
    robot: Robot, targets: tuple[Target, ...], instrument: Instrument, home: tuple[float, ...] | None, seed: int
) -> Cell:
    """A simulated cell around a robot.

    Args:
        robot: its drawing.
        targets: with the links that they ride on, 0 for the floor.
        instrument: what is promised of it.
        home: commands at the arm's marks, (n,); None: zero commands are zero displacements but for the drives' errors.
        seed: of the arm's errors.

    Raises:
        RobotError: the arm has a single joint, or slides only: its phi-model cannot be written.
    """
    rng = np.random.default_rng(seed)
    nominal_lines = robot.axes_at_zero()
    rule = convention_of(robot)
    placed = _base(robot)
    nominal = from_axes(nominal_lines, rule)[1]
    base, phi = from_axes(tuple(_off(line, rng).moved(placed) for line in nominal_lines), rule)
    phi = near(phi, nominal)
    arm = _with_home(Arm(robot, _lines(phi, base), _drives(robot, rng), _couplings(robot, rng)), home)
    points = _rest_points(robot, targets, frames(phi, np.zeros(robot.joint_count), base), seed)
    links = np.array([target.link for target in targets], dtype=int)
    return Cell(
        title=f"Simulated {robot.name}",
        robot=robot,
        nominal=nominal,
        truth=Truth(arm, base, phi, points, links, arm.commanded_for(np.zeros(robot.joint_count))[0]),
        targets=targets,
        protocol=Protocol((), np.zeros((0, robot.joint_count)), (), seconds_a_shot=SECONDS_A_SHOT),
        instrument=Stated(instrument),
        repeatability=Repeatability(mean_translation_m=SIGMA_M),
        home=None if home is None else np.array(home),
        notes=(("source", f"simulated: no {robot.name} was measured"),),
    )


def reach_of(robot: Robot) -> float:
    """The length of the arm drawn out straight, m."""
    return max(float(np.linalg.norm(robot.link_transforms[:, :3, 3], axis=1).sum()), LEAST_REACH_M)


def _base(robot: Robot) -> Array:
    """From the robot's base frame to the instrument's, (4, 4): in front of it, turned, on the same floor."""
    reach = reach_of(robot)
    return transform(rotation_about([0.0, 0.0, 1.0], 0.6), [1.2 * reach + 1.0, 0.9 * reach + 0.4, -INSTRUMENT_HEIGHT_M])


def _off(line: Line, rng: np.random.Generator) -> Line:
    across = np.array(perpendicular_basis(line.direction))
    tilt, shift = rng.normal(size=(2, 2)) * [[TILT_RAD], [SHIFT_M]]
    return Line(line.point_m + shift @ across, line.direction + tilt @ across)


def _lines(phi: PhiModel, base: Array) -> tuple[Line, ...]:
    at_zero = frames(phi, np.zeros(len(phi.sliding)), base)
    return tuple(Line(frame[:3, 3], frame[:3, 2]) for frame in at_zero)


def _drives(robot: Robot, rng: np.random.Generator) -> tuple[MotionFunction, ...]:
    return tuple(_nearly(_drive_form(joint), rng) for joint in robot.joints)


def _drive_form(joint: Joint) -> MotionForm:
    if joint.kind is JointKind.PASSIVE:
        return transmission_form("direct")
    usual = "ratio" if joint.slides else "first_harmonic"
    return transmission_form(usual if joint.transmission == "auto" else joint.transmission, joint.drive_ratio)


def _couplings(robot: Robot, rng: np.random.Generator) -> tuple[MotionFunction | None, ...]:
    found = (robot.coupling_into(joint) for joint in range(1, robot.joint_count + 1))
    return tuple(None if coupling is None else _nearly(_form_of(coupling), rng) for coupling in found)


def _form_of(coupling: Coupling) -> MotionForm:
    return coupling_form("proportional" if coupling.form == "auto" else coupling.form, coupling.gain)


def _nearly(form: MotionForm, rng: np.random.Generator) -> MotionFunction:
    """A function of a family that is nearly a perfect drive's."""
    start = form.start()
    return MotionFunction(form, start + OF_PRIOR * form.prior_std() * rng.normal(size=len(start)))


def _with_home(arm: Arm, home: tuple[float, ...] | None) -> Arm:
    """The arm with transducers set so that every net displacement is zero at home."""
    if home is None:
        return arm
    offsets = np.array(home) - arm.commanded_for(np.zeros(len(home)))[0]
    drives = tuple(replace(f, offset=float(o)) for f, o in zip(arm.transmissions, offsets, strict=True))
    return replace(arm, transmissions=drives)


def _rest_points(robot: Robot, targets: tuple[Target, ...], true_frames: Array, seed: int) -> Array:
    """Where the targets are with the arm at rest, in the instrument's frame, (t, 3)."""
    if not targets:
        return np.zeros((0, 3))
    links = np.array([target.link for target in targets])
    drawn = np.array([_drawn(robot, target, seed) for target in targets])
    on_arm = attached(robot, true_frames, np.maximum(links, 1), drawn)
    on_floor = (true_frames[0] @ invert(robot.base_transform))[:3] @ np.vstack([drawn.T, np.ones(len(drawn))])
    return np.where((links > 0)[:, None], on_arm, on_floor.T)


def _drawn(robot: Robot, target: Target, seed: int) -> Array:
    """The place of a target on the drawing at rest, in the base frame, (3,)."""
    at_rest = link_frames(robot, np.zeros((1, robot.joint_count)))[0]
    frame = at_rest[target.link - 1] if target.link else robot.base_transform
    if target.point_m is not None:
        return frame[:3, :3] @ np.array(target.point_m) + frame[:3, 3]
    rng = np.random.default_rng((seed, crc32(target.name.encode()), target.link))
    turn, reach = rng.uniform(0, 2 * np.pi), reach_of(robot)
    off = reach * np.array([0.16 * np.cos(turn), 0.16 * np.sin(turn), rng.uniform(0.05, 0.12)])
    outwards = at_rest[target.link][:3, 3] if target.link else frame[:3, 3]
    return (frame[:3, 3] + outwards) / 2 + frame[:3, :3] @ off
