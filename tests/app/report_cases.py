"""Campaigns that a report must cope with, each made from a simulated one."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from core.calibration import Calibration, calibrate
from core.geometry import rotation_about, transform
from core.measurements import Campaign, Instrument, Measurements, Target
from core.robot import Joint, JointKind, Robot
from core.twin import scara
from core.twin.campaign import simulate_campaign

HOSTILE = "</script><script>window.broken=1</script><img src=x onerror='window.broken=2'><b>&amp;"


@lru_cache
def six_joints() -> Calibration:
    """The paper's arm: couplings, marks, every joint swept."""
    return calibrate(simulate_campaign(1))


@lru_cache
def with_slide() -> Calibration:
    """A SCARA: a sliding joint, no couplings, no marks."""
    return calibrate(simulate_campaign(1, scara.cell()))


@lru_cache
def two_joints_swept() -> Calibration:
    """Joints 5 and 6 only: the geometry of the arm is not known."""
    campaign = simulate_campaign(2)
    return calibrate(rows_kept(campaign, np.isin(campaign.measurements.joint, (5, 6))))


@lru_cache
def with_outliers() -> Calibration:
    """Three points of the SCARA are out by some millimetres."""
    campaign = simulate_campaign(3, scara.cell())
    points = campaign.measurements.point_m.copy()
    points[[5, 50, 120]] += np.array([[0.003, 0.0, 0.0], [0.0, -0.005, 0.0], [0.0, 0.0, 0.002]])
    return calibrate(replace(campaign, measurements=replace(campaign.measurements, point_m=points)))


@lru_cache
def families_compared() -> Calibration:
    """The families of drives and couplings are left to the evidence."""
    campaign = simulate_campaign(4)
    robot = campaign.robot
    joints = tuple(replace(j, transmission="auto") for j in robot.joints)
    couplings = tuple(replace(c, form="auto") for c in robot.couplings)
    return calibrate(replace(campaign, robot=replace(robot, joints=joints, couplings=couplings)))


@lru_cache
def hostile() -> Calibration:
    """Every text that comes from a file tries to run a program or to break the page."""
    campaign = simulate_campaign(5, scara.cell())
    return calibrate(
        replace(
            campaign,
            title=HOSTILE,
            robot=replace(campaign.robot, name=HOSTILE),
            targets=tuple(replace(t, name=f"{t.name}{HOSTILE}") for t in campaign.targets),
            instrument=Instrument(HOSTILE, 1e-5, {HOSTILE: HOSTILE}),
            notes={HOSTILE: HOSTILE, "source": "*/}</style><script>window.broken=3</script>"},
        )
    )


@lru_cache
def one_joint_two_turns() -> Calibration:
    """One joint turned twice round in thousands of stops, nothing stated, nothing recorded beside the points."""
    angle = np.linspace(0.0, 4 * np.pi, 3001)
    rng = np.random.default_rng(6)
    points = np.stack([0.4 * np.cos(angle), 0.4 * np.sin(angle), np.full_like(angle, 0.2)], axis=1)
    points = points @ rotation_about([0.6, 0.8, 0.0], 0.3).T + rng.normal(scale=2e-5, size=points.shape)
    robot = Robot("turntable", (Joint(JointKind.REVOLUTE),), np.eye(4)[None], transform(np.eye(3), [0.0, 0.0, 0.0]))
    commanded = (angle + 0.001 * np.sin(angle))[:, None]
    return calibrate(Campaign(robot, (Target("ball", 1),), sweep_of_joint_1(commanded, points)))


def unlabelled(campaign: Campaign) -> Campaign:
    """The campaign without title, notes and conditions."""
    bare = replace(campaign.measurements, time_s=None, temperature_c=None, arm_temperature_c=None, payload_kg=None)
    return replace(campaign, title="", notes={}, instrument=Instrument(), measurements=bare)


def sweep_of_joint_1(commanded: np.ndarray, points: np.ndarray) -> Measurements:
    """Measurements that are one sweep of the first joint seen by one target."""
    count = len(points)
    zeros, ones = np.zeros(count, dtype=int), np.ones(count, dtype=int)
    return Measurements(
        record=np.arange(1, count + 1),
        phase=np.full(count, "sweep"),
        joint=ones,
        sweep=ones,
        step=np.arange(count),
        pose=-ones,
        target=zeros,
        commanded=commanded,
        point_m=points,
        covariance_m2=np.full((count, 3, 3), np.nan),
        check=np.zeros(count, dtype=bool),
        approach=np.zeros((count, commanded.shape[1]), dtype=int),
    )


def rows_kept(campaign: Campaign, kept: np.ndarray) -> Campaign:
    """The campaign with some of its rows only."""
    table = campaign.measurements
    columns = {name: None if (v := getattr(table, name)) is None else v[kept] for name in table.__dataclass_fields__}
    return replace(campaign, measurements=Measurements(**columns))


NAMED = {
    "six joints": six_joints,
    "with slide": with_slide,
    "two joints swept": two_joints_swept,
    "with outliers": with_outliers,
    "families compared": families_compared,
    "hostile": hostile,
    "one joint, two turns": one_joint_two_turns,
}
