"""What stands in the cell of a session: who moves the robot, what looks at its targets, and where both stand.

    demo        a built-in simulated cell
    simulated   a simulated arm of the session's own robot
    by hand     a real robot and instrument without drivers: a person moves the one and reads the other

A driver of a real robot or instrument becomes one more source here.
"""

from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from zlib import crc32

import numpy as np

from core.by_hand import EnteredPoints, HandMovedRobot
from core.errors import InputError
from core.geometry import Array
from core.instruments import PointMeter, RobotDriver
from core.robot import Joint, JointKind, Robot
from core.session_events import Event, Fact, Setting
from core.session_state import State
from core.theodolite import Theodolite
from core.twin import irb_l6, scara
from core.twin.cell import Cell
from core.twin.instrument import DemoInstrument, DemoRobot
from core.twin.instruments import TheodolitePair
from core.twin.own_robot import own_cell

SETTING = "points_from"
"""Key of the session's setting that names the source."""
SAID = "source"
"""The fact, and so the note of an exported campaign, that says that nothing was measured."""


class Source(StrEnum):
    """Where points come from."""

    DEMO = "demo"
    SIMULATED = "simulated"
    BY_HAND = "by hand"


@dataclass(frozen=True)
class Rig:
    """Robot and instrument of a session."""

    source: Source
    driver: RobotDriver
    meter: PointMeter
    robot: Robot
    """The nominal one; a stand-in where the session has none."""
    stations: tuple[tuple[str, Array], ...]
    """Names and places of the instrument's stations, (3,) each, in its own frame."""
    cell: Cell | None
    """What is simulated; None: nothing is."""

    @property
    def theodolites(self) -> tuple[Theodolite, Theodolite] | None:
        """The stations, if they are theodolites whose places are known."""
        pair = None if self.cell is None else self.cell.instrument
        return (pair.left, pair.right) if isinstance(pair, TheodolitePair) else None

    @property
    def base(self) -> Array | None:
        """From the robot's base frame to the instrument's, (4, 4); None: only measuring tells."""
        return None if self.cell is None else self.cell.truth.base

    @property
    def moves_itself(self) -> bool:
        """Whether a sweep can be left to the robot."""
        return self.source is not Source.BY_HAND


@dataclass(frozen=True)
class RigKey:
    """What a rig depends on: it is made anew when one of these changes."""

    source: Source
    robot: tuple
    targets: tuple
    instrument: tuple
    home: tuple[float, ...] | None


def key_of(state: State, cell: Cell | None = None) -> RigKey:
    """What the rig of a session depends on now."""
    instrument = state.instrument.kind, state.instrument.sigma_m
    return RigKey(
        source_of(state, cell), (state.robot_toml, state.robot_files), state.targets, instrument, state.plan.home
    )


def source_of(state: State, cell: Cell | None = None) -> Source:
    """Where the points of a session come from: as it says, else the demo cell if it is of one."""
    said = state.settings.get(SETTING)
    if said in tuple(Source):
        return Source(said)
    return Source.BY_HAND if demo_cell(state, cell) is None else Source.DEMO


def source_events(source: Source, robot: str) -> list[Event]:
    """What gives a session a source, and has every report say so where nothing is measured."""
    simulated = "" if source is Source.BY_HAND else f"simulated: no {robot} was measured"
    return [Setting(SETTING, str(source)), Fact(SAID, simulated)]


def demo_cell(state: State, cell: Cell | None = None) -> Cell | None:
    """The simulated cell whose robot and targets a session has, ``cell`` or a built-in one; None: no such cell."""
    names = {target.name for target in state.targets}
    for one in (cell, irb_l6.cell(), scara.cell()):
        if one is not None and _toml_of(one) == state.robot_toml and names <= {t.name for t in one.targets}:
            return one
    return None


def rig_for(state: State, seed: int, cell: Cell | None = None) -> Rig:
    """The rig of a session, going on with fresh noise after the shots that there are."""
    source = source_of(state, cell)
    simulated = demo_cell(state, cell) if source is Source.DEMO else None
    if source is Source.SIMULATED:
        simulated = _own(state)
    if simulated is None:
        return _by_hand(state)
    before = len(state.shots) + sum(len(check.shots) for check in state.checks)
    driver = DemoRobot(simulated, seed, visits_before=before)
    meter = DemoInstrument(simulated, driver, seed, shots_before=before)
    return Rig(source, driver, meter, simulated.robot, _stations(simulated), simulated)


@lru_cache(maxsize=8)
def _toml_of(cell: Cell) -> str:
    return cell.robot_toml()


def _own(state: State) -> Cell | None:
    """The simulated arm of a session's own robot, the same one every time; None: it cannot be made."""
    if state.robot is None or not state.targets:
        return None
    try:
        seed = crc32(state.robot_toml.encode())
        return own_cell(state.robot, state.targets, state.instrument, state.plan.home, seed)
    except InputError:
        return None


def _by_hand(state: State) -> Rig:
    robot = _readable(state)
    home = state.plan.home or (0.0,) * robot.joint_count
    meter, stations = EnteredPoints(state.instrument), (("instrument", np.zeros(3)),)
    return Rig(Source.BY_HAND, HandMovedRobot(home), meter, robot, stations, None)


def _readable(state: State) -> Robot:
    try:
        if state.robot is not None:
            return state.robot
    except InputError:
        pass
    commands = [state.plan.home or (), *(shot.taken.commanded for shot in state.shots[:1])]
    return no_robot(max([1, *map(len, commands), *(row.joint for row in state.plan.sweeps)]))


@lru_cache(maxsize=8)
def no_robot(joints: int) -> Robot:
    """Stands in for a robot that is lost in a damaged session, so that what is intact can be looked at."""
    return Robot("no robot", (Joint(JointKind.REVOLUTE),) * joints, np.tile(np.eye(4), (joints, 1, 1)))


def _stations(cell: Cell) -> tuple[tuple[str, Array], ...]:
    pair = cell.instrument
    if not isinstance(pair, TheodolitePair):
        return (("instrument", np.zeros(3)),)
    return ("left", np.asarray(pair.left.position_m)), ("right", np.asarray(pair.right.position_m))
