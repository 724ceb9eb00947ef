"""Where springs come to rest: Newton on MuJoCo's inverse dynamics, with no velocity and no acceleration."""

import mujoco
import numpy as np

from tests.benchmarks.withheld.physics.bodies import Bodies
from tests.benchmarks.withheld.rigid import Array

STEP = 1e-6
MOST_STEPS = 8
LEAST_TORQUE = 1e-9
"""Of the largest stiffness: what the springs' balance may lack, Nm or N for each Nm/rad or N/m."""


def resting_frames(bodies: Bodies, q: Array) -> Array:
    """The last frame at rest for each command (m, n), shape (m, 4, 4).

    Raises:
        RuntimeError: springs and weight do not come to terms.
    """
    return np.array([_rest(bodies, command) for command in q])


def _rest(bodies: Bodies, command: Array) -> Array:
    model, data = bodies.model, bodies.data
    bodies.command(command)
    data.qvel[:], data.qacc[:] = 0.0, 0.0
    enough = LEAST_TORQUE * max(model.jnt_stiffness.max(initial=0.0), 1.0)
    for _ in range(MOST_STEPS):
        lack = _lack(bodies, data.qpos.copy())
        if np.abs(lack).max(initial=0.0) < enough:
            mujoco.mj_kinematics(model, data)
            return bodies.last_frame()
        data.qpos[:] = data.qpos - np.linalg.solve(_stiffness(bodies, data.qpos.copy(), lack), lack)
    raise RuntimeError(f"springs find no rest: {np.abs(lack).max():.3g} Nm are missing")


def _lack(bodies: Bodies, qpos: Array) -> Array:
    """Torque that would have to be added at given spring angles, (dofs,)."""
    bodies.data.qpos[:] = qpos
    mujoco.mj_inverse(bodies.model, bodies.data)
    return bodies.data.qfrc_inverse.copy()


def _stiffness(bodies: Bodies, qpos: Array, lack: Array) -> Array:
    """Slope of that torque by finite differences, (dofs, dofs); leaves the spring angles as they were."""
    columns = [(_lack(bodies, qpos + STEP * unit) - lack) / STEP for unit in np.eye(len(qpos))]
    bodies.data.qpos[:] = qpos
    return np.stack(columns, axis=1)
