"""All candidates for one campaign."""

from dataclasses import replace

import numpy as np

from core.gap.doings import Doings
from core.gap.effects import drives, elastic, instrument, lost_motion, structure, thermal
from core.gap.effects.candidate import Candidate, Column
from core.gap.effects.nameless import nameless
from core.gap.sim import Part, Slot

OF_DRIVES = (
    drives.zero_offsets,
    drives.ratios,
    drives.eccentricities,
    drives.meshes,
    drives.linkages,
    drives.latencies,
    lost_motion.backlashes,
    lost_motion.hystereses,
    elastic.compliances,
    elastic.payloads,
    structure.wobbles,
)
"""What may sit behind a branching of motors, or depend on the joint's own angle there."""
FAMILIES = (
    drives.zero_offsets,
    drives.ratios,
    drives.eccentricities,
    drives.meshes,
    drives.linkages,
    drives.couplings,
    drives.latencies,
    drives.readings,
    lost_motion.backlashes,
    lost_motion.hystereses,
    elastic.compliances,
    elastic.flexures,
    elastic.payloads,
    structure.geometries,
    structure.wobbles,
    thermal.thermals,
    instrument.drifts,
    instrument.base_shifts,
    instrument.target_slips,
    instrument.scales,
)


def candidates(doings: Doings, without: frozenset[str] = frozenset()) -> list[Candidate]:
    """Named candidates, then nameless ones.

    Args:
        without: effects that are left out, to see what a diagnosis says of something that it cannot know.
    """
    named = [one for family in FAMILIES for one in family(doings)]
    named += _of_joints_alone(doings)
    return [one for one in named if one.place.effect not in without] + nameless(doings)


def _of_joints_alone(doings: Doings) -> list[Candidate]:
    """Where a motor also moves the next joint, a fault may sit behind the branching and stay with one joint."""
    gains = doings.seen.chain.coupling_gains
    if not gains.any():
        return []
    touched = {int(j) for j in np.flatnonzero(gains)} | {int(j) + 1 for j in np.flatnonzero(gains)}
    alone = [one for family in OF_DRIVES for one in family(doings.uncoupled)]
    return [joint_alone(one) for one in alone if one.place.joint is None or one.place.joint in touched]


def joint_alone(candidate: Candidate) -> Candidate:
    """The same fault of a joint instead of its motor."""

    def columns(doings: Doings) -> list[Column]:
        return [
            [(Slot(Part.JOINT, slot.index) if slot.part is Part.DRIVE else slot, feature) for slot, feature in column]
            for column in candidate.columns(doings.uncoupled)
        ]

    atom = f"{candidate.atom}, of the joint alone" if candidate.atom else "of the joint alone"
    return replace(candidate, atom=atom, columns=columns, choices=2 * candidate.choices)
