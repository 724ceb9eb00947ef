"""The arms of the suite: nominal geometry and masses, as a robot file and as a chain of this package."""

from dataclasses import dataclass
from functools import cache
from math import cos, pi, sin

import numpy as np

from tests.benchmarks.withheld.chains import Chain
from tests.benchmarks.withheld.rigid import Array


@dataclass(frozen=True)
class Arm:
    """A nominal arm and how a careful user would move it."""

    key: str
    toml: str
    """Text of robot.toml."""
    chain: Chain
    limits: Array
    """Lowest and highest command, rad or m, (n, 2)."""
    homes: Array
    """Two configurations to sweep from, the second with a load, (2, n)."""
    reach: Array
    """Half width of sweeps about them, (n,)."""
    masses_kg: Array
    centres_m: Array
    """Centres of mass in the frame after joint i has moved, (n, 3)."""
    payload_kg: float
    payload_m: Array
    """Where the load hangs, in the last frame, (3,)."""
    softness: Array
    """Rough nominal windup of each joint, rad/Nm or m/N, (n,)."""
    couplings: dict[int, tuple[int, float]]
    """Nominal: to -> (from, gain), joints counted from 0."""
    elbow: int | None
    """The joint (from 0) that a four-bar might drive: its range keeps clear of dead points."""

    @property
    def count(self) -> int:
        return self.chain.count

    def active(self, q: Array) -> Array:
        """What each motor does, (m, n): net commands less the passive motion that the controller undoes."""
        out = q.copy()
        for to, (source, gain) in sorted(self.couplings.items()):
            out[:, to] = q[:, to] - gain * out[:, source]
        return out


def _phi_link(phi: float, a: float, b: float, alpha: float, theta: float) -> Array:
    """T_phi(phi, 0) . T_link(a, b, alpha, theta) of Sultan and Wager's appendix, written as the products there."""
    turn_in = np.array([[-sin(phi), 0, cos(phi), 0], [cos(phi), 0, sin(phi), 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
    return turn_in @ _screw_z(theta, a) @ _screw_x(alpha, b)


def _screw_z(angle: float, along: float) -> Array:
    c, s = cos(angle), sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, along], [0, 0, 0, 1.0]])


def _screw_x(angle: float, along: float) -> Array:
    c, s = cos(angle), sin(angle)
    return np.array([[1, 0, 0, along], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])


def _dh_link(theta_deg: float, d_mm: float, a_mm: float, alpha_deg: float) -> Array:
    return _screw_z(theta_deg * pi / 180, d_mm / 1e3) @ _screw_x(alpha_deg * pi / 180, a_mm / 1e3)


@cache
def arm_named(key: str) -> Arm:
    """One of ``ARMS``."""
    return ARMS[key]()


def _l6() -> Arm:
    """The paper's arm: phi-model, three couplings undone by the controller."""
    frames = [(90, 0, 0, 90, -90), (0, -690, 0, 90, -180), (0, -670, 0, 90, -180), (0, 0, 0, 90, -90)]
    frames.append((0, 0, -232.5, 90, -90))
    links = [_phi_link(p * pi / 180, a / 1e3, b / 1e3, al * pi / 180, t * pi / 180) for p, a, b, al, t in frames]
    kinds = ["revolute"] * 6
    limits = [(-170, 170), (-50, 50), (-60, 60), (-90, 90), (-180, 180), (-180, 180)]
    masses = [42, 18, 14, 4, 3, 1.5]
    centres = [(20, -50, -300), (-310, -20, 0), (-240, 0, 0), (0, -20, 0), (0, 0, 130), (0, 0, 60)]
    couplings = [(2, 3, -1.0), (3, 4, -1.0), (4, 5, 1.6842105263157894)]
    rows = "".join(
        f"[[frame]]\nphi_deg = {p}\na_mm = {a}\nb_mm = {b}\nalpha_deg = {al}\ntheta_deg = {t}\n"
        for p, a, b, al, t in frames
    )
    rows += "".join(f"[[coupling]]\nfrom = {i}\nto = {j}\ngain = {g}\n" for i, j, g in couplings)
    return Arm(
        key="l6",
        toml=_head("ASEA IRB L6", kinds, limits) + rows + _masses(masses, centres),
        chain=Chain((False,) * 6, np.array([*links, np.eye(4)])),
        limits=np.radians(limits),
        homes=np.radians([(5, -8, -5, 10, -20, 10), (-25, 10, 12, -30, 35, -40)]),
        reach=np.radians([60, 36, 42, 55, 80, 80]),
        masses_kg=np.array(masses, dtype=float),
        centres_m=np.array(centres) / 1e3,
        payload_kg=5.0,
        payload_m=np.array([0.02, 0.0, 0.1]),
        softness=np.array([2, 2, 3, 8, 12, 15]) * 1e-6,
        couplings={j - 1: (i - 1, g) for i, j, g in couplings},
        elbow=2,
    )


def _ur() -> Arm:
    """A light 6R arm with three parallel axes."""
    dh = [(0, 127.3, 0, 90), (0, 0, -612, 0), (0, 0, -572.3, 0), (0, 163.941, 0, 90), (0, 115.7, 0, -90)]
    dh.append((0, 92.2, 0, 0))
    return _dh_arm(
        "ur",
        "light 6R",
        dh,
        limits=[(-360, 360)] * 6,
        homes=[(20, -70, 80, -60, -80, 10), (-35, -115, 95, -45, -65, 35)],
        reach=[60, 50, 55, 60, 60, 75],
        masses=[7.1, 12.7, 4.27, 2.0, 2.0, 0.365],
        centres=[(21, 0, 27), (380, 0, 158), (240, 0, 68), (0, 7, 18), (0, 7, 18), (0, 0, -26)],
        payload_kg=5.0,
        softness=[8, 8, 10, 25, 30, 30],
        elbow=2,
    )


def _irb() -> Arm:
    """A stiff 6R arm with a spherical wrist."""
    dh = [(0, 475, 150, -90), (-90, 0, 600, 0), (0, 0, 120, -90), (0, 720, 0, 90), (0, 0, 0, -90), (180, 85, 0, 0)]
    return _dh_arm(
        "irb",
        "6R with spherical wrist",
        dh,
        limits=[(-180, 180), (-90, 120), (-160, 70), (-200, 200), (-120, 120), (-360, 360)],
        homes=[(10, 10, -10, 15, 40, -20), (-30, 30, -35, -40, -45, 40)],
        reach=[60, 45, 50, 60, 55, 80],
        masses=[75, 48, 40, 15, 6, 1.5],
        centres=[(-80, 60, -20), (-280, 0, 90), (-60, 10, 60), (0, -260, 0), (0, 0, 15), (0, 0, -15)],
        payload_kg=8.0,
        softness=[1, 1, 1.5, 6, 8, 10],
        elbow=2,
    )


def _seven() -> Arm:
    """A 7R arm, shoulder, elbow and wrist on points."""
    dh = [(0, 340, 0, -90), (0, 0, 0, 90), (0, 400, 0, 90), (0, 0, 0, -90), (0, 400, 0, -90), (0, 0, 0, 90)]
    dh.append((0, 126, 0, 0))
    return _dh_arm(
        "seven",
        "7R",
        dh,
        limits=[(-170, 170), (-120, 120), (-170, 170), (-120, 120), (-170, 170), (-120, 120), (-175, 175)],
        homes=[(10, 30, -15, -60, 20, 45, 10), (-30, 50, 25, -80, -35, 60, -40)],
        reach=[60, 45, 60, 38, 60, 45, 80],
        masses=[4.0, 4.0, 3.0, 2.7, 1.7, 1.8, 0.3],
        centres=[(0, 120, 30), (0, 40, 60), (0, -120, 30), (0, -50, 40), (0, 120, 20), (0, 10, 60), (0, 0, -20)],
        payload_kg=4.0,
        softness=[15, 15, 20, 20, 30, 35, 35],
        elbow=3,
    )


def _scara() -> Arm:
    """Two turning joints, a slide, a turning joint; all upright."""
    dh = [(0, 387, 400, 0), (0, 60, 350, 180), (0, 0, 0, 0), (0, 120, 0, 0)]
    return _dh_arm(
        "scara",
        "SCARA",
        dh,
        limits=[(-130, 130), (-140, 140), (0, 300), (-360, 360)],
        homes=[(15, 40, 130, 20), (-25, -55, 170, -50)],
        reach=[65, 65, 105, 120],
        masses=[14, 11, 3.0, 0.8],
        centres=[(-210, 0, 30), (-160, 0, 50), (0, 0, 80), (0, 0, -40)],
        payload_kg=4.0,
        softness=[6, 10, 3, 60],
        elbow=None,
        slides=(2,),
    )


def _dh_arm(
    key: str,
    name: str,
    dh: list[tuple[float, float, float, float]],
    limits: list[tuple[float, float]],
    homes: list[tuple[float, ...]],
    reach: list[float],
    masses: list[float],
    centres: list[tuple[float, float, float]],
    payload_kg: float,
    softness: list[float],
    elbow: int | None,
    slides: tuple[int, ...] = (),
) -> Arm:
    """An arm by standard Denavit-Hartenberg rows: frame i lies at the far end of link i."""
    n = len(dh)
    unit = np.array([1e-3 if i in slides else pi / 180 for i in range(n)])
    links = np.array([_dh_link(*row) for row in dh])
    rows = "".join(f"[[dh]]\ntheta_deg = {t}\nd_mm = {d}\na_mm = {a}\nalpha_deg = {al}\n" for t, d, a, al in dh)
    kinds = ["prismatic" if i in slides else "revolute" for i in range(n)]
    at_end = np.array(centres) / 1e3
    return Arm(
        key=key,
        toml=_head(name, kinds, limits) + rows + _masses(masses, centres),
        chain=Chain(tuple(i in slides for i in range(n)), links),
        limits=np.array(limits) * unit[:, None],
        homes=np.array(homes) * unit,
        reach=np.array(reach) * unit,
        masses_kg=np.array(masses, dtype=float),
        centres_m=np.einsum("nij,nj->ni", links[:, :3, :3], at_end) + links[:, :3, 3],
        payload_kg=payload_kg,
        payload_m=np.array([0.02, 0.0, 0.08]),
        softness=np.array(softness) * 1e-6,
        couplings={},
        elbow=elbow,
    )


def _head(name: str, kinds: list[str], limits: list[tuple[float, float]]) -> str:
    joints = "".join(
        f'[[joint]]\nkind = "{kind}"\nlimits = [{low}, {high}]\n'
        for kind, (low, high) in zip(kinds, limits, strict=True)
    )
    return f'format = "trueaxis-robot/1"\nname = "{name}"\n{joints}'


def _masses(masses: list[float], centres: list[tuple[float, float, float]]) -> str:
    links = "".join(
        f"[[link]]\nmass_kg = {mass}\ncom_mm = [{x}, {y}, {z}]\n"
        for mass, (x, y, z) in zip(masses, centres, strict=True)
    )
    return f"{links}[gravity]\ndirection = [0.0, 0.0, -1.0]\n"


ARMS = {"l6": _l6, "ur": _ur, "irb": _irb, "seven": _seven, "scara": _scara}
"""The paper's arm, a light and a stiff 6R, a 7R, a SCARA with a slide."""
