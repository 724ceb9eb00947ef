"""A small valid campaign as texts, for tests of reading: three joints, a sweep of six points, two poses and a move."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from core.measurements import Campaign, Measurements

ROBOT_TOML = """format = "trueaxis-robot/1"
name = "small arm"

[[joint]]
kind = "revolute"
limits = [-170, 170]

[[joint]]
kind = "revolute"
drive_ratio = [32, 19]
transmission = "gear"

[[joint]]
kind = "prismatic"
limits = [-10, 500]

[[frame]]
phi_deg = 90.0
a_mm = 10.0
b_mm = 0.0
alpha_deg = 90.0
theta_deg = -90.0

[[frame]]
phi_deg = 0.0
a_mm = 0.0
b_mm = 0.0
alpha_deg = 80.0
theta_deg = -170.0

[tool]
phi_deg = 20.0
a_mm = 3.0
b_mm = 4.0
alpha_deg = 50.0
theta_deg = 60.0
gamma_deg = 70.0
h_mm = 8.0

[[coupling]]
from = 1
to = 2
gain = -1.0
compensated = false
form = "proportional"

[[link]]
mass_kg = 12.0
com_mm = [0.0, 0.0, 100.0]
[[link]]
mass_kg = 6.0
com_mm = [1.0, 2.0, 3.0]
[[link]]
mass_kg = 1.0
com_mm = [0.0, 0.0, 0.0]

[gravity]
direction = [0.0, 0.0, -2.0]
"""

CAMPAIGN_TOML = """format = "trueaxis-campaign/1"
title = "small"
robot = "robot.toml"
joint_values = "commanded"
operator = "R. Müller"
shift = 2

[instrument]
kind = "laser-tracker"
sigma_mm = 0.02
model = "AT960"

[sim]
place = false

[home]
q = [0.0, 10.0, 20.0]

[notes]
hall = "4"

[[target]]
name = "T1"
link = 2
xyz_mm = [10.0, 20.0, 30.0]
xyz_sigma_mm = 0.1

[[target]]
name = "floor"
link = 0
"""

HEADER = (
    "record,phase,joint,sweep,step,pose,use,approach,approach1,approach2,approach3,target,q1_deg,q2_deg,q3_mm,"
    "x_mm,y_mm,z_mm,sigma_mm,time_s,temperature_c,arm_temperature_c,payload_kg,speed1_deg_s,tau1_nm,read1_deg,"
    "target_qw,target_qx,target_qy,target_qz,sim_x_mm,sim_y_mm,sim_z_mm,remark"
)
_REST = "21.5,30.0,5.0,0.5,3.25,10.01,0.6,0.8,0,0,1.0,2.0,3.0,fine"
_NO_REST = "21.5,,,,,,,,,,,,,"

ROWS = [
    *(
        f"{k + 1},sweep,2,1,{k},,fit,1,,,-1,T1,0,{10 * k},100,{100 + k}.5,{200 - k},{5 * k},,{k}.5,{_REST}"
        for k in range(6)
    ),
    f"7,sweep,2,1,6,,check,-1,,,,floor,0,60,100,,,,,7,{_REST}",
    f"8,pose,,,,0,,,1,-1,0,T1,-30.5,20,0,1,2,3,0.5,8,{_REST}",
    f"9,pose,,,,0,,,1,-1,0,T1,-30.5,20,0,1.1,2,3,,9,{_REST}",
    f"10,move,,,,,,,,,,,10,20,0,,,,,10,{_NO_REST}",
]
MEASUREMENTS_CSV = "\n".join([HEADER, *ROWS]) + "\n"

FILES = {"campaign.toml": CAMPAIGN_TOML, "robot.toml": ROBOT_TOML, "measurements.csv": MEASUREMENTS_CSV}


def write_files(folder: Path, **changed: str) -> Path:
    """The small campaign in a folder; ``measurements``, ``campaign`` or ``robot`` replace a file's text."""
    for name, text in FILES.items():
        (folder / name).write_text(changed.get(name.partition(".")[0], text), encoding="utf-8")
    return folder


def with_cell(row: int, column: str, value: str, text: str = MEASUREMENTS_CSV) -> str:
    """The table with one cell replaced; row 1 is the header, as in messages."""
    lines = text.splitlines()
    cells = lines[row - 1].split(",")
    cells[lines[0].split(",").index(column)] = value
    lines[row - 1] = ",".join(cells)
    return "\n".join(lines) + "\n"


def with_header(old: str, new: str) -> str:
    """The table with one column renamed."""
    header = ",".join(new if name == old else name for name in HEADER.split(","))
    return MEASUREMENTS_CSV.replace(HEADER, header)


def without(*columns: str) -> str:
    """The table without some columns."""
    keep = [i for i, name in enumerate(HEADER.split(",")) if name not in columns]
    return "\n".join(",".join(line.split(",")[i] for i in keep) for line in MEASUREMENTS_CSV.splitlines()) + "\n"


def with_columns(cells: dict[str, list[str]]) -> str:
    """The table with columns added, a cell for each row; short lists are filled with empty cells."""
    lines = MEASUREMENTS_CSV.splitlines()
    for name, values in cells.items():
        lines[0] += f",{name}"
        for k in range(len(lines) - 1):
            lines[k + 1] += f",{values[k] if k < len(values) else ''}"
    return "\n".join(lines) + "\n"


def assert_same(one: Campaign, other: Campaign) -> None:
    """Two campaigns agree in all but the digest of their files, numbers to 1e-12."""
    for field in fields(Measurements):
        a, b = getattr(one.measurements, field.name), getattr(other.measurements, field.name)
        assert (a is None) == (b is None), field.name
        if a is not None and a.dtype.kind == "f":
            np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-18, err_msg=field.name)
        elif a is not None:
            np.testing.assert_array_equal(a, b, err_msg=field.name)
    for a, b in zip(one.targets, other.targets, strict=True):
        assert (a.name, a.link, a.point_m is None) == (b.name, b.link, b.point_m is None)
        assert a.sigma_m == pytest.approx(b.sigma_m, rel=1e-12)
        assert a.point_m is None or a.point_m == pytest.approx(b.point_m, rel=1e-12)
    np.testing.assert_allclose(one.home, other.home, rtol=1e-12)
    assert one.instrument.sigma_m == pytest.approx(other.instrument.sigma_m, rel=1e-12)
    assert one.instrument.description == other.instrument.description
    assert (one.title, one.joint_values, one.notes) == (other.title, other.joint_values, other.notes)
    assert one.place_simulated == other.place_simulated
    np.testing.assert_allclose(one.robot.link_transforms, other.robot.link_transforms, atol=1e-12)
