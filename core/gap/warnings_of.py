"""What the data cannot answer, and why."""

import numpy as np

from core.gap.analysis import NoiseFound
from core.gap.doings import Doings
from core.gap.effects.candidate import motors
from core.gap.observations import placeless
from core.gap.sim import Part, Sim, Slot

FEW = 60
ON_AXIS_M = 2e-3
"""Targets so near to an axis hardly move when its joint turns."""


def warnings_of(doings: Doings, noise: NoiseFound, sim: Sim) -> tuple[str, ...]:
    """One sentence a question that these data leave open."""
    seen, table = doings.seen, doings.seen.campaign.measurements
    out = []
    if seen.count < FEW:
        out.append(f"There are {seen.count} points only: small effects cannot be told from noise.")
    lost = [seen.campaign.targets[t].name for t in placeless(seen.campaign)] if seen.simulated_m is None else []
    if lost:
        out.append(f"Only validation rows show {', '.join(lost)}, whose place is not known: they were left out.")
    if noise.source != "replicates":
        out.append(
            "Nothing was measured twice: the noise is estimated from what a flexible fit leaves; errors that do not "
            "repeat cannot be told from it."
        )
    if not doings.past.complete:
        out.append("No approach moves or senses were logged: lost motion cannot be tested.")
    if table.time_s is None:
        out.append("No times were logged: the order of measurement stands for them.")
    if table.arm_temperature_c is None and table.temperature_c is None:
        out.append("No temperatures were logged: thermal growth can be tested against time only.")
    if doings.loads is None:
        out.append("The robot does not say where gravity points: nothing that weights do can be tested.")
    elif not seen.campaign.robot.links:
        out.append("The robot has no masses: only what a payload does can be tested.")
    if np.ptp(seen.payload_kg) == 0:
        out.append("The payload never changed: elastic effects and once-a-turn errors are hard to tell apart.")
    if table.speed is None and table.readback is None:
        out.append("Neither speeds nor read-back values were logged: latency cannot be tested.")
    still = [str(j + 1) for j in np.flatnonzero(seen.still & seen.chain.commanded)]
    if still:
        out.append(f"Joints that never moved: {', '.join(still)}: nothing can be said of their drives.")
    held = [str(j + 1) for j in np.flatnonzero(seen.held & ~seen.still & seen.chain.commanded)]
    if held:
        out.append(
            f"Joints that were held while their motors followed others: {', '.join(held)}: whatever depends on their "
            "angles looks like a zero offset."
        )
    hidden = ", ".join(str(j + 1) for j in motors(doings) if _on_axis(sim, j))
    if hidden:
        out.append(f"All targets lie on the axis of joint {hidden}: what its drive does cannot be seen.")
    if not seen.posed.any():
        out.append("There are no poses: joints moved one at a time, so effects that need two cannot be tested.")
    if len(np.unique(seen.target)) == 1:
        out.append("There is one target: tilts and shifts of the last axes are hard to tell apart.")
    if noise.memory > 0:
        out.append(
            f"Neighbouring points have errors that are alike (correlation {noise.memory:.2f}); this is allowed for."
        )
    return tuple(out)


def _on_axis(sim: Sim, joint: int) -> bool:
    """Whether every target that a turning joint moves lies on its axis; joints count from 0."""
    lever_m = np.linalg.norm(sim.fields([Slot(Part.JOINT, joint)])[:, :, 0], axis=1)
    beyond = sim.seen.link > joint
    return not sim.seen.chain.sliding[joint] and bool(beyond.any()) and float(lever_m[beyond].max()) < ON_AXIS_M
