"""The scene in a real browser: the twin of the paper's arm with everything drawn, in both themes.

Pictures are written to the folder that TRUEAXIS_SCREENSHOTS names, or to a temporary one.
"""

import os
import shutil
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from app.scene.axes import LENGTH_OF_REACH, AxesView, AxisMark, nominal_axes, tube_exaggeration
from app.scene.cameras import Camera, fly_to, presets
from app.scene.colours import GHOST, ResidualScale
from app.scene.diagnosis import DiagnosisView
from app.scene.dimensions import fitting_exaggeration
from app.scene.error_vectors import ErrorVectors
from app.scene.floor import draw_floor, floor_height, floor_under
from app.scene.link_shapes import skeleton
from app.scene.points import PointMarks, PointsView, Verdict
from app.scene.robot import RobotView
from app.scene.stage import prepare_stage
from app.scene.stations import Station, StationsView
from app.scene.targets import TargetsView
from core.arm import carry
from core.calibration import Calibration
from core.geometry import Line
from core.phi_model import axes
from tests.app.report_cases import six_joints

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.skipif(CHROMIUM is None and not os.environ.get("CI"), reason="there is no Chromium here"),
    pytest.mark.slow,
]

READY = """() => { const m = window.__viserMutable; return !!m && !!m.canvas && m.canvas.width > 0
  && !!document.querySelector('.tabler-icon-cloud-check') && !!document.querySelector('[data-testid=app-ready]') }"""
WORLD = """(name) => { const o = window.__viserMutable.nodeRefFromName[name]; if (!o) return null;
  o.updateWorldMatrix(true, false); return o.matrixWorld.elements }"""
NAMES = "() => Object.keys(window.__viserMutable.nodeRefFromName)"
FRAMES = """() => new Promise(done => { let n = 0; const from = performance.now(); const step = () => { n++;
  window.__viserMutable.requestRender?.();
  performance.now() - from > 2000 ? done(n / 2) : requestAnimationFrame(step) }; step() })"""


@dataclass
class Demo:
    """A server with everything drawn."""

    server: object
    calibration: Calibration
    robot: RobotView
    ghost: RobotView
    fitted: AxesView
    nominal: AxesView
    stations: StationsView
    points: PointsView
    errors: ErrorVectors
    targets: TargetsView
    diagnosis: DiagnosisView
    views: dict[str, Camera]
    point_m: np.ndarray
    clicked: list[int] = field(default_factory=list)


def build(dark: bool) -> Demo:
    import viser

    server = viser.ViserServer(host="127.0.0.1", port=free_port(), verbose=False)
    server.gui.configure_theme(dark_mode=dark, show_logo=False, show_share_button=False)
    scene, calibration = server.scene, six_joints()
    prepare_stage(scene)
    estimate, sliding = calibration.estimate, calibration.campaign.robot.sliding
    couplings, lines = calibration.campaign.robot.couplings, estimate.arm.axes
    ideal = axes(calibration.nominal, estimate.geometry.base)
    stations = (Station("left theodolite", np.zeros(3)), Station("right theodolite", np.array([0.0, 6.0, 0.0])))
    spots = np.array([s.position_m for s in stations])
    height = floor_height(skeleton(lines, sliding), spots)
    robot = RobotView(server, "/calibrated", lines, sliding, couplings=couplings, floor_m=height)
    more = {"couplings": couplings, "floor_m": height, "swell_m": 0.01}
    ghost = RobotView(server, "/nominal", ideal, sliding, GHOST, 0.25, **more)
    bones, length = robot.bones, LENGTH_OF_REACH * robot.bones.reach_m
    draw_floor(scene, floor_under(np.vstack([spots, bones.hubs_m]), height))
    marks = tuple(
        AxisMark(j, lines[j - 1], bones.hubs_m[j - 1], *estimate.axis_std(j), f"axis {j}") for j in range(1, 7)
    )
    wide = tube_exaggeration(marks, length, 0.05 * bones.reach_m)
    refinement, table = calibration.refinement, calibration.campaign.measurements
    residuals = refinement.residuals
    measured, verdict = table.point_m[residuals.row], np.zeros(len(residuals.row), dtype=int)
    verdict[3::17], verdict[7::19] = Verdict.DOUBTFUL, Verdict.EXCLUDED
    views = {view.name: view for view in presets(bones, np.zeros(6), stations, height)}
    demo = Demo(
        server=server,
        calibration=calibration,
        robot=robot,
        ghost=ghost,
        fitted=AxesView(server, "/axes/fitted", marks, sliding, length, exaggeration=wide),
        nominal=nominal_axes(server, "/axes/nominal", ideal, ghost.bones.hubs_m, sliding, length),
        stations=StationsView(server, stations, height),
        points=PointsView(server),
        errors=ErrorVectors(server, magnification=100.0),
        targets=TargetsView(scene, robot, calibration.campaign.targets, refinement.rest_points_m),
        diagnosis=DiagnosisView(
            server,
            calibration.nominal,
            estimate.geometry,
            estimate.geometry.base,
            bones.reach_m,
            fitting_exaggeration(calibration.nominal, estimate.geometry, bones.reach_m),
            views["Arm"].position_m - views["Arm"].look_at_m,
        ),
        views=views,
        point_m=measured,
    )
    demo.points.on_click(lambda row, client: demo.clicked.append(row))
    demo.diagnosis.visible = False
    colours = ResidualScale.over(residuals.radial_m).colours(residuals.radial_m)
    demo.points.show(PointMarks(residuals.row, measured, colours, verdict))
    demo.points.mark_last(measured[20])
    demo.points.expect(measured[25], facing=lines[4].direction)
    demo.errors.show(measured, measured - residuals.residual_m)
    demo.stations.aim(measured[20])
    server.gui.add_html("<i data-testid='app-ready' hidden></i>")
    return demo


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(scope="module")
def browser() -> Iterator:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--enable-unsafe-swiftshader"]
        running = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield running
        running.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    named = os.environ.get("TRUEAXIS_SCREENSHOTS")
    chosen = Path(named) if named else tmp_path_factory.mktemp("scene")
    chosen.mkdir(parents=True, exist_ok=True)
    return chosen


@pytest.fixture(scope="module", params=["light", "dark"])
def opened(request: pytest.FixtureRequest, browser) -> Iterator:
    demo = build(request.param == "dark")
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(f"http://127.0.0.1:{demo.server.get_port()}/")
    page.wait_for_function(READY, timeout=60_000)
    page.wait_for_function("() => !!window.__viserMutable.nodeRefFromName['/stations/sights']", timeout=60_000)
    toast = page.locator(".mantine-Notification-root", has_text="Software WebGL")
    toast.get_by_role("button").first.click()
    yield request.param, demo, page
    page.close()
    demo.server.stop()
    assert complaints == []


class NoNodeError(AssertionError):
    """A node is not in the scene, or not yet."""


def until(condition: Callable[[], bool], seconds: float = 30.0) -> None:
    """Wait for something to become true, in nodes that may only just be on their way to the browser."""
    end = time.monotonic() + seconds
    while True:
        try:
            if condition():
                return
        except NoNodeError:
            if time.monotonic() > end:
                raise
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.05)


def look(demo: Demo, page, name: str | Camera, seconds: float = 0.0) -> None:
    (client,) = demo.server.get_clients().values()
    fly_to(client, demo.views[name] if isinstance(name, str) else name, seconds)
    page.wait_for_timeout(900)


def world(page, name: str) -> np.ndarray:
    """The pose of a node in the browser, (4, 4)."""
    elements = page.evaluate(WORLD, name)
    if elements is None:
        raise NoNodeError(f"there is no node {name}")
    return np.array(elements).reshape(4, 4).T


def test_every_thing_has_its_node(opened) -> None:
    _, _, page = opened
    names = set(page.evaluate(NAMES))
    wanted = {f"/{arm}/link{k}/body" for arm in ("calibrated", "nominal") for k in range(7) if k != 4}
    wanted |= {f"/calibrated/{part}" for part in ("crank2/body", "rod2/body", "crank3/body", "rod3/body")}
    wanted |= {f"/axes/fitted/{j}/{part}" for j in range(1, 7) for part in ("arrow", "tube", "label")}
    wanted |= {f"/axes/nominal/{j}/arrow" for j in range(1, 7)}
    wanted |= {f"/points/{part}" for part in ("kept", "doubtful", "excluded", "last", "next/ring", "next/ball")}
    wanted |= {
        "/errors/arrows",
        "/errors/factor",
        "/stations/0/tripod",
        "/stations/1/head/telescope",
        "/stations/sights",
    }
    wanted |= {"/floor", "/calibrated/link6/target0/ball", "/diagnosis/dimensions/2_b_m", "/diagnosis/phi_frames"}
    assert sorted(wanted - names) == []


def test_a_joint_moves_the_nodes_as_the_core_says(opened) -> None:
    _, demo, page = opened
    lines, sliding = demo.robot.axes, demo.robot.sliding
    net = np.deg2rad([20.0, 25.0, -35.0, 30.0, 40.0, 10.0])
    rest = world(page, "/calibrated/link0")
    demo.robot.show(net)
    demo.fitted.show(net)
    expected = {k: carry(lines, sliding, net[None], np.array([k]), demo.robot.origin_m(k)[None])[0] for k in range(7)}
    # Poses of a browser are in its own upright frame; the base does not move and gives that frame.
    frame = rest.copy()
    frame[:3, 3] -= frame[:3, :3] @ demo.robot.origin_m(0)
    to_scene = np.linalg.inv(frame)
    until(lambda: np.allclose((to_scene @ world(page, "/calibrated/link6"))[:3, 3], expected[6], atol=1e-5))
    for k in range(7):
        drawn = to_scene @ world(page, f"/calibrated/link{k}")
        assert np.allclose(drawn[:3, 3], expected[k], atol=1e-5)
        beside = carry(lines, sliding, net[None], np.array([k]), demo.robot.origin_m(k)[None] + [[0.1, 0.2, 0.3]])[0]
        assert np.allclose((drawn @ [0.1, 0.2, 0.3, 1.0])[:3], beside, atol=1e-5)
    target = demo.calibration.refinement.rest_points_m[0]
    at = (to_scene @ world(page, "/calibrated/link6/target0"))[:3, 3]
    assert np.allclose(at, carry(lines, sliding, net[None], np.array([6]), target[None])[0], atol=1e-5)
    demo.robot.show(np.zeros(6))
    demo.fitted.show(np.zeros(6))
    until(lambda: np.allclose((to_scene @ world(page, "/calibrated/link6"))[:3, 3], demo.robot.origin_m(6), atol=1e-5))


def test_a_click_on_a_point_names_its_row(opened) -> None:
    _, demo, page = opened
    residuals = demo.calibration.refinement.residuals
    index = int(np.flatnonzero(residuals.joint == 2)[0])
    point = demo.point_m[index]
    hide(demo, True)
    eye = Camera("close", point + np.array([0.5, 0.35, 0.25]), point, np.array([0.0, 0.0, 1.0]))
    look(demo, page, eye)
    x, y = page.viewport_size["width"] / 2, page.viewport_size["height"] / 2
    page.mouse.move(x, y)
    page.wait_for_timeout(400)
    page.mouse.click(x, y)
    until(lambda: len(demo.clicked) > 0)
    hide(demo, False)
    assert demo.clicked.pop() == residuals.row[index]
    demo.clicked.clear()


def hide(demo: Demo, hidden: bool) -> None:
    for view in (demo.robot, demo.ghost, demo.fitted, demo.nominal, demo.errors):
        view.visible = not hidden


def test_a_highlight_a_factor_and_a_new_exaggeration_arrive(opened) -> None:
    _, demo, page = opened
    demo.fitted.highlight(3)
    demo.errors.magnification = 250.0
    demo.diagnosis.exaggeration = 10.0
    demo.targets.highlight(1)
    state = "(n) => window.__viserMutable.nodeRefFromName[n] != null"
    until(lambda: page.evaluate(state, "/errors/arrows") and page.evaluate(state, "/axes/fitted/3/arrow"))
    assert demo.server.scene.get_handle_by_name("/errors/factor").text == "residuals × 250"
    assert demo.server.scene.get_handle_by_name("/diagnosis/factor").text == "differences × 10"
    demo.fitted.highlight(None)
    demo.errors.magnification = 100.0
    demo.targets.highlight(None)


def test_pictures(opened, folder: Path) -> None:
    theme, demo, page = opened
    factor = fitting_exaggeration(
        demo.calibration.nominal, demo.calibration.estimate.geometry, demo.robot.bones.reach_m
    )
    for name in ("All", "Arm", "Joint 3", "Tool", "left theodolite"):
        look(demo, page, name, 0.3 if name == "Arm" else 0.0)
        page.screenshot(path=folder / f"scene_{name.lower().replace(' ', '_')}_{theme}.png")
    look(demo, page, "Arm")
    assert page.evaluate(FRAMES) > 2.0
    for view in (demo.points, demo.errors, demo.nominal, demo.fitted, demo.ghost, demo.stations):
        view.visible = False
    demo.targets.labels_visible = False
    demo.robot.opacity = 0.25
    demo.diagnosis.exaggeration = factor
    demo.diagnosis.visible = True
    look(demo, page, demo.diagnosis.overview())
    page.screenshot(path=folder / f"scene_diagnosis_{theme}.png")
    demo.diagnosis.highlight(2, "b_m")
    look(demo, page, demo.diagnosis.camera(2, "b_m"))
    page.screenshot(path=folder / f"scene_highlight_{theme}.png")


def test_an_arm_that_is_drawn_anew_stands_where_it_should(opened) -> None:
    _, demo, page = opened
    lines = (Line([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), Line([0.4, 0.0, 0.0], [0.0, 0.0, 1.0]))
    first = RobotView(demo.server, "/other", lines, np.zeros(2, dtype=bool))
    first.show([1.0, 0.5])
    before = world(page, "/calibrated/link0")
    frame = before.copy()
    frame[:3, 3] -= frame[:3, :3] @ demo.robot.origin_m(0)
    until(lambda: page.evaluate(WORLD, "/other/link2") is not None)
    until(lambda: not np.allclose((np.linalg.inv(frame) @ world(page, "/other/link1"))[:3, :3], np.eye(3), atol=1e-5))
    first.remove()
    second = RobotView(demo.server, "/other", lines, np.zeros(2, dtype=bool))
    until(lambda: np.allclose((np.linalg.inv(frame) @ world(page, "/other/link1"))[:3, :3], np.eye(3), atol=1e-5))
    until(lambda: np.allclose((np.linalg.inv(frame) @ world(page, "/other/link2"))[:3, 3], [0.4, 0.0, 0.0], atol=1e-5))
    second.remove()
