"""The calibrated arm in three dimensions as one document of HTML, to be turned in a report without any server."""

import contextlib
import io
import socket

import numpy as np
import viser

from app.scene.axes import LENGTH_OF_REACH, AxesView, AxisMark
from app.scene.cameras import Camera, presets
from app.scene.colours import ResidualScale
from app.scene.diagnosis import DiagnosisView
from app.scene.dimensions import fitting_exaggeration
from app.scene.floor import draw_floor, floor_height, floor_under
from app.scene.points import PointMarks, PointsView, Verdict
from app.scene.robot import RobotView
from app.scene.stage import prepare_stage
from core.calibration import Calibration

QUIET = ".mantine-Notifications-root{display:none}"
"""No word of how the browser draws: nobody can do anything about it in a report."""
SEE_THROUGH = 0.2
"""Opacity of the arm behind the drawing of its differences."""


def scene_html(calibration: Calibration) -> str:
    """A page that shows the arm, its axes, the measured points and, where the geometry is known, every difference.

    Raises:
        OSError: this machine lets nobody listen on its own loopback address, which the drawing needs for a moment.
    """
    with contextlib.closing(socket.socket()) as probe:
        # viser itself would wait for ever where no address can be had.
        probe.bind(("127.0.0.1", 0))
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        try:
            _draw(server, calibration)
            page = server.get_scene_serializer().as_html()
        finally:
            server.stop()
    return page.replace("<head>", f"<head><style>{QUIET}</style>", 1)


def residual_scale(calibration: Calibration) -> ResidualScale:
    """How the points of the scene are coloured: by their radial residuals."""
    residuals = calibration.refinement.residuals
    return ResidualScale.over(residuals.radial_m[residuals.used])


def _draw(server: viser.ViserServer, calibration: Calibration) -> None:
    prepare_stage(server.scene)
    robot, estimate = calibration.campaign.robot, calibration.estimate
    arm = RobotView(server, "/arm", estimate.arm.axes, robot.sliding, couplings=robot.couplings)
    height = floor_height(arm.bones, np.zeros((0, 3)))
    draw_floor(server.scene, floor_under(np.vstack([arm.bones.hubs_m, arm.bones.base_m]), height))
    _draw_points(server, calibration)
    camera = next(c for c in presets(arm.bones, np.zeros(robot.joint_count)) if c.name == "Arm")
    if estimate.geometry is None or calibration.nominal is None:
        _draw_axes(server, calibration, arm)
        _look(server, camera)
        return
    arm.opacity = SEE_THROUGH
    reach, way = arm.bones.reach_m, camera.position_m - camera.look_at_m
    swell = fitting_exaggeration(calibration.nominal, estimate.geometry, reach)
    direction = way / np.linalg.norm(way)
    geometry = estimate.geometry
    diagnosis = DiagnosisView(server, calibration.nominal, geometry, geometry.base, reach, swell, direction)
    _look(server, diagnosis.overview())


def _draw_axes(server: viser.ViserServer, calibration: Calibration, arm: RobotView) -> None:
    estimate, sliding = calibration.estimate, calibration.campaign.robot.sliding
    marks = tuple(
        AxisMark(j, estimate.arm.axes[j - 1], arm.bones.hubs_m[j - 1], *estimate.axis_std(j), f"axis {j}")
        for j in calibration.found.swept
    )
    if len(marks) == len(sliding):
        AxesView(server, "/axes", marks, sliding, LENGTH_OF_REACH * arm.bones.reach_m)


def _draw_points(server: viser.ViserServer, calibration: Calibration) -> None:
    residuals = calibration.refinement.residuals
    points = calibration.campaign.measurements.point_m[residuals.row]
    verdict = np.where(residuals.used, Verdict.KEPT, Verdict.EXCLUDED)
    colours = residual_scale(calibration).colours(residuals.radial_m)
    PointsView(server).show(PointMarks(residuals.row, points, colours, verdict))


def _look(server: viser.ViserServer, camera: Camera) -> None:
    first = server.initial_camera
    first.position, first.look_at, first.up = (tuple(v) for v in (camera.position_m, camera.look_at_m, camera.up))
    first.fov = camera.field_of_view_rad
