"""Thousands of poses at once brought to where they are wanted, by damped least squares with the analytic Jacobian.

The misfit of a pose is a vector of six: the way that is missing, in units of the arm's reach, and the rotation vector
that is missing (weighed less for an arm that cannot take every orientation). Each pose has its own damping: a step
that brings the tool nearer is taken and the damping falls, any other is refused and it grows (Levenberg 1944, doi
10.1090/qam/10666; Marquardt 1963, doi 10.1137/0111030). It goes with the square of the misfit, so that it leaves the
last steps alone (Yamashita and Fukushima 2001, doi 10.1007/978-3-7091-6217-0_18), even next to a singular pose. It
grows faster from refusal to refusal (Nielsen 1999, IMM-REP-1999-05), so that a pose out of reach is given up soon.

Next to a singular pose the way down is a bent valley, in which straight steps have to be short. There a second
derivative along the step bends it (geodesic acceleration: Transtrum and Sethna 2012, arXiv:1201.5885), at the price of
one more look at the arm.

Arrays run over the poses last, so that numpy works on long rows.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from core.driven_robot import DrivenRobot
from core.geometry import Array

DONE = 1e-14
"""Misfit at which nothing is left to be gained."""
REACHED = 1e-10
"""Misfit of a pose that counts as reached where rounding ends the way down."""
LONGEST_STEP_RAD = 1.0
PROBE = 0.1
"""Share of a step after which its bend is looked at."""
MOST_BEND = 0.75
"""A step that bends more than this share of its length is taken straight."""
BLOCK = 2048
"""Poses that are worked on together: their arrays fit into a processor's cache."""


@dataclass(frozen=True)
class Approach:
    """How near each pose was come."""

    free: Array
    """Net displacements of the joints with a motor, (m, k)."""
    misfit: Array
    """Length of the misfit, (m,)."""

    @property
    def reached(self) -> np.ndarray:
        """Which poses were reached, boolean, (m,)."""
        return self.misfit < REACHED


@dataclass(frozen=True)
class ChainState:
    """Where the chain is: everything that the Jacobian needs, poses last."""

    axes: Array
    """Directions of the joint axes, (n, 3, m)."""
    origins: Array
    """Points on them, (n, 3, m)."""
    columns: Array
    """Columns of the tool's rotation, (3 columns, 3, m)."""
    position: Array
    """(3, m)."""


def chain_state(robot: DrivenRobot, net: Array) -> ChainState:
    """Forward kinematics for net displacements (m, n)."""
    chain, m = robot.chain, len(net)
    n = chain.joint_count
    axes, origins = np.empty((n, 3, m)), np.empty((n, 3, m))
    columns = np.repeat(chain.base_transform[:3, :3].T[:, :, None], m, axis=2)
    position = np.repeat(chain.base_transform[:3, 3:], m, axis=1)
    for i in range(n):
        axes[i], origins[i] = columns[2], position
        if chain.joints[i].slides:
            position = position + net[:, i] * columns[2]
        else:
            cosine, sine = np.cos(net[:, i]), np.sin(net[:, i])
            x, y = columns[0], columns[1]
            columns = np.stack([cosine * x + sine * y, cosine * y - sine * x, columns[2]])
        # Columns of the next frame and the way to it, one product: rows of the link's transform are combinations.
        moved = chain.link_transforms[i][:3].T @ columns.reshape(3, -1)
        position = position + moved[3].reshape(3, m)
        columns = moved[:3].reshape(3, 3, m)
    return ChainState(axes, origins, columns, position)


def scaled_jacobian(robot: DrivenRobot, state: ChainState) -> Array:
    """Derivative of position (in units of the reach) and rotation by the net displacements, (6, n, m)."""
    jacobian = np.zeros((6, *state.axes.shape[::2]))
    ax, ay, az = state.axes[:, 0], state.axes[:, 1], state.axes[:, 2]
    dx, dy, dz = (state.position[k] - state.origins[:, k] for k in range(3))
    jacobian[0], jacobian[1], jacobian[2] = ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx
    jacobian[3], jacobian[4], jacobian[5] = ax, ay, az
    for i in np.flatnonzero(robot.chain.sliding):
        jacobian[:3, i], jacobian[3:, i] = state.axes[i], 0.0
    jacobian[:3] /= robot.reach_m
    jacobian[3:] *= robot.turn_weight
    return jacobian


def misfits(robot: DrivenRobot, state: ChainState, wanted: Array) -> Array:
    """What is missing to the wanted poses (4, 4, m), as (6, m)."""
    out = np.empty((6, wanted.shape[2]))
    out[:3] = (wanted[:3, 3] - state.position) / robot.reach_m
    rotation = np.einsum("ikm,kjm->ijm", wanted[:3, :3], state.columns)
    out[3:] = rotation_vectors(rotation) * robot.turn_weight
    return out


def rotation_vectors(rotation: Array) -> Array:
    """Rotation vectors of rotations (3, 3, m), as (3, m)."""
    half = 0.5 * np.stack(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = np.sqrt(np.sum(half**2, axis=0))
    cosine = 0.5 * (rotation[0, 0] + rotation[1, 1] + rotation[2, 2] - 1.0)
    angle = np.arctan2(sine, cosine)
    vectors = half * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 1.0)
    flipped = np.flatnonzero((sine < 1e-6) & (cosine < 0))
    if len(flipped):
        vectors[:, flipped] = _half_turns(rotation[:, :, flipped]) * angle[flipped]
    return vectors


def approach(
    robot: DrivenRobot,
    wanted: Array,
    start: Array,
    most_steps: int = 40,
    bent: bool = False,
    held: int | None = None,
) -> Approach:
    """Bring the tool to poses.

    Args:
        wanted: T_tool_to_base, (m, 4, 4).
        start: net displacements of the joints with a motor, (m, k).
        most_steps: of each pose.
        bent: whether steps follow the bend of the way, which helps next to singular poses and costs half as much again.
        held: which of the joints with a motor stays as it is; None: none.
    """
    blocks = [slice(first, first + BLOCK) for first in range(0, len(start), BLOCK)]
    if not blocks:
        return Approach(np.empty(start.shape), np.empty(0))

    def work(block: slice) -> tuple[Array, Array]:
        poses = np.ascontiguousarray(np.moveaxis(wanted[block], 0, 2))
        return _approach_block(robot, poses, start[block], most_steps, bent, held)

    if len(blocks) == 1:
        return Approach(*work(blocks[0]))
    with ThreadPoolExecutor(os.cpu_count() or 1) as threads:
        done = list(threads.map(work, blocks))
    return Approach(*(np.concatenate(parts) for parts in zip(*done, strict=True)))


def _approach_block(
    robot: DrivenRobot, wanted: Array, start: Array, most_steps: int, bent: bool, held: int | None
) -> tuple[Array, Array]:
    best, best_misfit = np.array(start, dtype=float), np.full(len(start), np.inf)
    left = np.arange(len(start))
    free, damping, growth = best.copy(), np.ones(len(start)), np.full(len(start), 2.0)
    missing, jacobian = _evaluate(robot, wanted, free, held)
    size = np.sqrt(np.sum(missing**2, axis=0))
    best_misfit[:] = size
    for _ in range(most_steps):
        step = _steps(missing, jacobian, damping * size**2)
        if bent:
            step += _bend(robot, wanted, free, step, missing, jacobian, damping * size**2)
        trial = free + step
        new_missing, new_jacobian = _evaluate(robot, wanted, trial, held)
        new_size = np.sqrt(np.sum(new_missing**2, axis=0))
        better = new_size < size
        damping = np.where(better, np.maximum(damping * 0.3, 1e-8), damping * growth)
        growth = np.where(better, 2.0, growth * 2.0)
        free = np.where(better[:, None], trial, free)
        missing, jacobian = np.where(better, new_missing, missing), np.where(better, new_jacobian, jacobian)
        size = np.where(better, new_size, size)
        # Down to rounding, or no way down: both are the end of it.
        over = (size < DONE) | (damping * size**2 > 1e4) | ((size < REACHED) & ~better)
        if over.any():
            best[left[over]], best_misfit[left[over]] = free[over], size[over]
            stay = ~over
            left, free, size = left[stay], free[stay], size[stay]
            damping, growth = damping[stay], growth[stay]
            missing, jacobian, wanted = missing[:, stay], jacobian[:, :, stay], wanted[:, :, stay]
            if len(left) == 0:
                break
    best[left], best_misfit[left] = free, size
    return best, best_misfit


def _bend(
    robot: DrivenRobot, wanted: Array, free: Array, step: Array, missing: Array, jacobian: Array, damping: Array
) -> Array:
    """What the second derivative along a step adds to it, (m, k); 0 where that is too much to be trusted."""
    probe, _ = _evaluate(robot, wanted, free + PROBE * step)
    second = (2 / PROBE) * ((missing - probe) / PROBE - np.einsum("ikm,mk->im", jacobian, step))
    bend = -0.5 * _steps(second, jacobian, damping)
    length = np.linalg.norm(step, axis=1)
    return bend * (np.linalg.norm(bend, axis=1) < MOST_BEND / 2 * length)[:, None]


def _evaluate(robot: DrivenRobot, wanted: Array, free: Array, held: int | None = None) -> tuple[Array, Array]:
    """Misfits (6, m), and their negative derivative by the free displacements, (6, k, m); none by the one held."""
    state = chain_state(robot, robot.net(free))
    jacobian, slopes = scaled_jacobian(robot, state), robot.slopes(free)
    if slopes is not None:
        jacobian = np.einsum("inm,mnk->ikm", jacobian, slopes)
    if held is not None:
        jacobian[:, held] = 0.0
    return misfits(robot, state, wanted), jacobian


def _steps(missing: Array, jacobian: Array, damping: Array) -> Array:
    """Damped least-squares steps, (m, k), none longer than a radian; the smaller of the two normal equations."""
    rows = np.ascontiguousarray(np.moveaxis(jacobian, 2, 0))
    across, wide = np.swapaxes(rows, 1, 2), rows.shape[2] > 6
    right = np.ascontiguousarray(missing.T)[..., None]
    normal = rows @ across if wide else across @ rows
    size = normal.shape[1]
    scale = np.einsum("mii->m", normal) / size + 1e-300
    normal[:, np.arange(size), np.arange(size)] += (np.maximum(damping, 1e-15) * scale)[:, None]
    solved = np.linalg.solve(normal, right if wide else across @ right)
    step = (across @ solved if wide else solved)[..., 0]
    longest = np.abs(step).max(axis=1, initial=0.0)
    return step * np.minimum(1.0, LONGEST_STEP_RAD / np.maximum(longest, 1e-300))[:, None]


def _half_turns(rotation: Array) -> Array:
    """Axes (3, m) of rotations (3, 3, m) by half a turn: the longest column of R + 1."""
    whole = rotation + np.eye(3)[:, :, None]
    longest = np.argmax(np.sum(whole**2, axis=0), axis=0)
    axis = whole[:, longest, np.arange(rotation.shape[2])]
    return axis / np.linalg.norm(axis, axis=0)
