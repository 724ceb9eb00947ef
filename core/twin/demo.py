"""A simulated cell as the beginning of a session: what an operator would enter, table 1 and test poses as the plan."""

from core.kinematics import active_commands
from core.session_events import (
    Event,
    Fact,
    InstrumentChosen,
    Planned,
    PosesPlanned,
    RobotChosen,
    TargetEntry,
    TargetsNamed,
    Titled,
)
from core.session_plan import Plan, PlannedSweep, commands_for
from core.twin.cell import Cell


def plan_for(cell: Cell) -> Plan:
    """The sweeps of a cell's protocol in their order, about its home; for the paper's arm, table 1: joint 6 first."""
    sweeps, counts = [], dict[int, int]()
    for row in cell.protocol.sweeps:
        counts[row.joint] = counts.get(row.joint, 0) + 1
        sweeps.append(
            PlannedSweep(
                joint=row.joint,
                sweep=counts[row.joint],
                low=float(row.low),
                high=float(row.high),
                stops=row.points,
                targets=row.targets,
                both_ways=cell.protocol.both_ways,
            )
        )
    return Plan(tuple(sweeps), None if cell.home is None else tuple(float(value) for value in cell.home))


def poses_for(cell: Cell) -> tuple[tuple[float, ...], ...]:
    """The test poses of a cell's protocol, as commands."""
    motors = active_commands(cell.robot, cell.centre) + cell.protocol.poses
    return tuple(tuple(row) for row in commands_for(cell.robot, motors).tolist())


def demo_events(cell: Cell) -> list[Event]:
    """What a session on a simulated cell begins with."""
    plan, instrument = plan_for(cell), cell.instrument.statement
    return [
        Titled(cell.title),
        RobotChosen(cell.robot_toml()),
        TargetsNamed(tuple(TargetEntry(t.name, t.link, t.point_m, t.sigma_m) for t in cell.targets)),
        InstrumentChosen(instrument.kind, instrument.sigma_m, instrument.description),
        Planned(plan.sweeps, plan.home),
        *([PosesPlanned(poses_for(cell), cell.protocol.pose_targets)] if len(cell.protocol.poses) else []),
        *(Fact(key, value) for key, value in cell.notes),
    ]
