"""An arm as MuJoCo bodies whose commands are baked into their places, so that only what gives way is free.

A motor hinge driven by overwriting its angle is unstable; here the commanded motion is part of each body's pose in
its parent, set anew for every command, and the only degrees of freedom are springs (or the play of one joint).
"""

from dataclasses import dataclass, field
from functools import cached_property

import mujoco
import numpy as np

from tests.benchmarks.withheld.arms import Arm
from tests.benchmarks.withheld.loads import G, Masses
from tests.benchmarks.withheld.rigid import Array, homogeneous, turn

LEAST_INERTIA = 1e-4


@dataclass(frozen=True)
class Springs:
    """What gives way: joints about (along) their axes, and one link at its middle."""

    joints: dict[int, float] = field(default_factory=dict)
    """Stiffness by joint from 0, Nm/rad or N/m."""
    link: int | None = None
    bending: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Stiffness of that link's middle: twist about its length and bending in two planes, Nm/rad."""
    loose: int | None = None
    """A joint with play: nothing but dry friction and moving limits hold it."""
    friction: float = 0.0
    """Nm or N."""


@dataclass(frozen=True)
class Bodies:
    """A compiled model and where its bodies go for a command."""

    arm: Arm
    model: mujoco.MjModel
    data: mujoco.MjData
    ends: Array
    """Far end of each link in its joint's frame, clutter included, (n, 4, 4)."""
    middles: Array
    """Where the bending body of each link stands in its joint's frame, (n, 4, 4); the identity where none does."""
    loose: int | None = None
    """A joint whose own angle is a degree of freedom and not baked."""

    @cached_property
    def _rest(self) -> tuple[Array, Array, Array, Array]:
        """Numbers of the axis bodies (n,), and their quaternions (n, 4), places and z-axes (n, 3) at command zero."""
        before = [np.eye(4), *(np.linalg.inv(self.middles[:-1]) @ self.ends[:-1])]
        quaternions = np.empty((len(before), 4))
        for quaternion, place in zip(quaternions, before, strict=True):
            mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(place[:3, :3]).ravel())
        numbers = np.array([self.model.body(f"axis{i}").id for i in range(self.arm.count)])
        return numbers, quaternions, np.array(before)[:, :3, 3], np.array(before)[:, :3, 2]

    @cached_property
    def _baked(self) -> tuple[Array, Array]:
        """1 where a command turns, and where it slides, a body; 0 for the loose joint, (n,) each."""
        slides = np.array(self.arm.chain.sliding, dtype=float)
        held = np.arange(self.arm.count) != (-1 if self.loose is None else self.loose)
        return (1.0 - slides) * held, slides * held

    def command(self, q: Array) -> None:
        """Put the bodies where a command (n,) wants them."""
        numbers, (w, x, y, z), places, axes = self._rest[0], self._rest[1].T, *self._rest[2:]
        turns, slides = self._baked
        c, s = np.cos(0.5 * q * turns), np.sin(0.5 * q * turns)
        self.model.body_quat[numbers] = np.stack([w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s], axis=1)
        self.model.body_pos[numbers] = places + axes * (q * slides)[:, None]

    def last_frame(self) -> Array:
        """The frame in which targets are given, (4, 4), after kinematics."""
        body = self.data.body(f"axis{self.arm.count - 1}")
        return homogeneous(body.xmat.reshape(3, 3), body.xpos) @ self.ends[-1]


def build(arm: Arm, clutter: Array, masses: Masses, payload_kg: float, springs: Springs) -> Bodies:
    """An arm with springs under its own weight and a load, kg."""
    spec = mujoco.MjSpec()
    spec.option.gravity = [0.0, 0.0, -G]
    parent = spec.worldbody
    ends = np.array([arm.chain.links[i] @ _small(clutter[i]) for i in range(arm.count)])
    middles = np.tile(np.eye(4), (arm.count, 1, 1))
    for i in range(arm.count):
        body = parent.add_body(name=f"axis{i}")
        shares = 1.0 if springs.link != i else 0.5
        _weigh(body, shares * masses.links_kg[i], masses.centres_m[i])
        if i in springs.joints:
            _hinge(body, arm.chain.sliding[i]).stiffness = _linear(springs.joints[i])
        if i == springs.loose:
            _loosen(_hinge(body, arm.chain.sliding[i]), springs.friction)
        parent = body
        if springs.link == i:
            middles[i] = _beam_middle(ends[i][:3, 3])
            parent = _bending(body, middles[i], springs.bending)
            _weigh(parent, 0.5 * masses.links_kg[i], (np.linalg.inv(middles[i]) @ [*masses.centres_m[i], 1.0])[:3])
    carried = payload_kg * masses.payload_factor
    if carried > 0:
        load = parent.add_body(name="load", pos=(np.linalg.inv(middles[-1]) @ ends[-1] @ [*masses.payload_m, 1.0])[:3])
        _weigh(load, carried, np.zeros(3))
    model = spec.compile()
    return Bodies(arm, model, mujoco.MjData(model), ends, middles, springs.loose)


def _weigh(body: mujoco.MjsBody, mass: float, centre: Array) -> None:
    body.explicitinertial = True
    body.mass = mass
    body.ipos = centre
    body.inertia = np.full(3, max(0.003 * mass, LEAST_INERTIA))


def _hinge(body: mujoco.MjsBody, slides: bool) -> mujoco.MjsJoint:
    kind = mujoco.mjtJoint.mjJNT_SLIDE if slides else mujoco.mjtJoint.mjJNT_HINGE
    return body.add_joint(type=kind, axis=[0, 0, 1])


def _linear(coefficient: float) -> Array:
    """MuJoCo's springs and dampers are polynomials; only the first term is used."""
    return np.array([coefficient, 0.0, 0.0])


def _loosen(joint: mujoco.MjsJoint, friction: float) -> None:
    """Dry friction, and limits stiff enough that a flank is a flank."""
    joint.frictionloss = friction
    joint.armature, joint.damping = 0.05, _linear(0.5)
    joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
    joint.range = [-1.0, 1.0]
    joint.solref_limit = [0.003, 1.0]
    joint.solimp_limit = [0.995, 0.9999, 1e-4, 0.5, 2.0]


def _bending(body: mujoco.MjsBody, middle: Array, stiffness: tuple[float, float, float]) -> mujoco.MjsBody:
    """A body at the middle of a link that can twist and bend: end slopes as of a uniform beam."""
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(middle[:3, :3]).ravel())
    half = body.add_body(name="half", pos=middle[:3, 3], quat=quaternion)
    for axis, k in zip(np.eye(3), stiffness, strict=True):
        half.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, stiffness=_linear(k))
    return half


def _beam_middle(end: Array) -> Array:
    """A frame halfway to a link's end, x along the link, (4, 4)."""
    x = end / np.linalg.norm(end)
    y = np.cross([0.0, 0.0, 1.0] if abs(x[2]) < 0.9 else [0.0, 1.0, 0.0], x)
    y /= np.linalg.norm(y)
    return homogeneous(np.stack([x, y, np.cross(x, y)], axis=1), end / 2)


def _small(motion: Array) -> Array:
    return homogeneous(turn(motion[:3]), motion[3:])
