"""The cell in 3-D: the arm as it stands, its nominal ghost, instruments, shots and axes, kept up with the workbench."""

import threading

import numpy as np

from app.scene.axes import LENGTH_OF_REACH, AxesView, AxisMark, tube_exaggeration
from app.scene.cameras import Camera, presets
from app.scene.colours import GHOST, ResidualScale
from app.scene.diagnosis import DiagnosisView
from app.scene.dimensions import fitting_exaggeration
from app.scene.error_vectors import ErrorVectors
from app.scene.floor import draw_floor, floor_height, floor_under
from app.scene.group import Viewer
from app.scene.points import PointMarks, PointsView, Verdict
from app.scene.robot import RobotView
from app.scene.stage import prepare_stage
from app.scene.stations import Station, StationsView
from app.scene.sweep_circle import SweepCircle
from app.spots import Spot
from app.workbench import Workbench
from core.arm import Arm
from core.calibration import Calibration
from core.estimate import ArmEstimate
from core.geometry import Array, Line
from core.robot import Joint

BLUE = (0, 114, 178)
TUBE_OF_REACH = 0.02
"""Greatest radius of the tubes about the axes, as a share of the arm's reach."""
GHOST_SWELL_M = 0.01
"""The ghost is that much thicker, so that it does not flicker with the arm inside it."""
SEEN_MOVING_M = 1e-3
"""A base that is found elsewhere by less than this stays where it is drawn."""
MEASURED = ("points", "circle", "errors", "stations")
"""What stands out of the way of the geometry against design."""
FAR = 0.3
"""Share of the arm's reach by which it moves out of the picture."""


class CellView:
    """All nodes of the scene, and how they follow the workbench."""

    def __init__(self, viewer: Viewer, bench: Workbench) -> None:
        self._viewer, self._bench = viewer, bench
        prepare_stage(viewer.scene)
        self._stations = tuple(Station(name, place) for name, place in bench.rig.stations)
        self._base = bench.known.base().base
        self.out_of_sight = False
        """Whether the arm was drawn elsewhere than where anybody looks."""
        self._draw_arms()
        self.points = PointsView(viewer)
        self.circle = SweepCircle(viewer)
        self._circled: object = None
        self.errors = ErrorVectors(viewer)
        self.errors.visible = False
        self._axes: AxesView | None = None
        self._diagnosis: DiagnosisView | None = None
        self._diagnosed = False
        self._put_away: tuple[str, ...] = ()
        self._exaggeration = 20.0
        self._moving = threading.Lock()
        self.commanded: tuple[float, ...] = self._bench.robot.commanded
        """Where the arms are drawn."""
        self._calibrated: Arm | None = None
        """The arm as it is, once all of it is known."""
        self.drawn: Calibration | None = None
        """The calibration that is shown."""
        self.lit: Spot | None = None
        """What is drawn in the colour of attention."""
        self.tube_exaggeration = 1.0
        """How many times too wide the tubes of uncertainty about the axes are."""
        self.scale = ResidualScale(1e-3)
        """Colours of residuals since the last solution."""
        self.chosen: int | None = None
        """Id of the shot that somebody has clicked."""
        self.shown_shots: tuple[int, ...] = ()
        """Ids of the shots in the rows of ``points``."""

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Of the robot that is drawn."""
        return self._bench.nominal.joints

    def _draw_arms(self) -> None:
        """Draw the nominal arm and its ghost where the base stands, with floor and instrument about them."""
        robot, viewer = self._bench.nominal, self._viewer
        nominal = tuple(line.moved(self._base) for line in robot.axes_at_zero())
        look = {"couplings": robot.couplings}
        self.arm = RobotView(viewer, "/arm", nominal, robot.sliding, **look)
        self.ghost = RobotView(viewer, "/nominal", nominal, robot.sliding, GHOST, 0.25, swell_m=GHOST_SWELL_M, **look)
        self.ghost.visible = False
        positions = np.array([s.position_m for s in self._stations]).reshape(-1, 3)
        self._floor_m = floor_height(self.arm.bones, positions)
        corners = np.concatenate([positions, self.arm.bones.hubs_m])
        draw_floor(viewer.scene, floor_under(corners, self._floor_m))
        self.stations = StationsView(viewer, self._stations, self._floor_m)

    def _draw_as_calibrated(self) -> None:
        """Draw the arm with the axes and motions that it really has once all are known, else as designed."""
        found = self.drawn
        known = found is not None and not found.not_swept and found.refinement.tied
        self._calibrated = found.estimate.arm if known else None
        axes = self._calibrated.axes if known else self.ghost.axes
        if all(_look_alike(one, other) for one, other in zip(axes, self.arm.axes, strict=True)):
            return
        opacity, visible, robot = self.arm.opacity, self.arm.visible, self._bench.nominal
        self.arm.remove()
        self.arm = RobotView(self._viewer, "/arm", axes, robot.sliding, couplings=robot.couplings)
        self.arm.opacity, self.arm.visible = opacity, visible

    def _stand(self) -> None:
        """Draw the arms anew where the base is found to stand, if that is elsewhere by more than the eye sees."""
        base = self._bench.known.base().base
        if np.abs(base - self._base).max() < SEEN_MOVING_M:
            return
        jump = float(np.linalg.norm(base[:3, 3] - self._base[:3, 3]))
        self.out_of_sight = self.out_of_sight or jump > FAR * self.arm.bones.reach_m
        self._base, ghost = base, self.ghost.visible
        for view in (self.arm, self.ghost, self.stations):
            view.remove()
        self._draw_arms()
        self._draw_as_calibrated()
        self.ghost.visible = ghost

    def refresh(self) -> None:
        """Show what the workbench has now."""
        found = self._bench.calibration
        if found is None:
            self.forget()
        elif found is not self.drawn:
            self.show_calibration(found)
        self.show_shots()
        self.follow_robot()

    def cameras(self) -> tuple[Camera, ...]:
        """Where to look from, for the arm as it stands."""
        return presets(self.arm.bones, self.arm.net, self._stations, self._floor_m, self._extremes())

    def _view(self) -> Array:
        """From the arm to the eye that sees it as a whole, unit, (3,)."""
        camera = next(c for c in self.cameras() if c.name == "Arm")
        way = camera.position_m - camera.look_at_m
        return way / np.linalg.norm(way)

    def _extremes(self) -> tuple[Array, ...]:
        """Net displacements at both ends of every planned sweep, (n,) each: the view should hold all of them."""
        first, last = {}, {}
        for step in self._bench.state.steps:
            sweep = (step.joint, step.sweep)
            first.setdefault(sweep, step.commanded)
            last[sweep] = step.commanded
        return tuple(self._bench.nominal_net(end) for end in (*first.values(), *last.values()))

    def follow(self, commanded: tuple[float, ...]) -> None:
        """Show the arms where commands put them."""
        with self._moving:
            self.commanded = tuple(commanded)
            nominal = self._bench.nominal_net(commanded)
            actual = nominal if self._calibrated is None else self._calibrated.net(np.array(commanded))[0]
            with self._viewer.atomic():
                self.ghost.show(nominal)
                for view in (self.arm, self._axes):
                    if view is not None:
                        view.show(actual)

    def follow_robot(self) -> None:
        """Show the arms where the robot is, or where it has to be sent."""
        self.follow(self._bench.standing)

    def show_shots(self) -> None:
        """Show every shot of the session, coloured by verdict; the last one marked."""
        self._stand()
        shots = [s for s in self._bench.state.shots if s.taken.point_m is not None and s.superseded_by is None]
        self.shown_shots = tuple(s.id for s in shots)
        points = np.array([s.taken.point_m for s in shots]).reshape(-1, 3)
        verdicts = np.array([_verdict(s.verdict) for s in shots], dtype=int)
        self.points.show(PointMarks(np.arange(len(shots)), points, self._colours([s.record for s in shots]), verdicts))
        self.points.mark_last(points[-1] if len(points) else None)
        self.choose(self.chosen)
        self.stations.aim(points[-1] if len(points) else None)
        self._show_circle()
        expected = self._bench.known.expected()
        if expected is None:
            self.points.expect(None)
        else:
            self.points.expect(expected.point_m, expected.axis)

    def choose(self, number: int | None) -> None:
        """Mark a shot that somebody has clicked; None, or one that is not shown: none."""
        self.chosen = number
        shot = None if number is None or number not in self.shown_shots else self._bench.state.shot(number)
        if shot is None:
            self.points.mark_chosen(None)
        else:
            self.points.mark_chosen(shot.taken.point_m, f"record {shot.record}")

    def _show_circle(self) -> None:
        """The circle of the sweep that was measured last, as far as it is known."""
        last = next((s for s in reversed(self._bench.state.shots) if s.taken.phase == "sweep"), None)
        so_far = None if last is None else self._bench.known.so_far(last.taken.joint, last.taken.sweep)
        if so_far is self._circled:
            return
        self._circled = so_far
        if so_far is None:
            self.circle.show(None, np.zeros((0, 3)), np.zeros(0, dtype=int))
        else:
            self.circle.show(so_far.live.fit, so_far.points_m, so_far.target)

    def show_calibration(self, found: Calibration) -> None:
        """Show the fitted axes with their uncertainty, the nominal arm as a ghost, and the residuals."""
        self.drawn, self.lit = found, None
        self._draw_as_calibrated()
        self.scale = ResidualScale.over(found.refinement.residuals.radial_m)
        geometry = found.estimate.geometry
        if geometry is not None and found.nominal is not None:
            self._exaggeration = fitting_exaggeration(found.nominal, geometry, self.arm.bones.reach_m)
        self._show_axes(found.estimate)
        residuals = found.refinement.residuals
        measured = found.campaign.measurements.point_m[residuals.row]
        self.errors.show(measured, measured - residuals.residual_m)
        if self._diagnosis is not None:
            self._diagnosis.remove()
            self._diagnosis = None
        self.diagnose(self._diagnosed)

    def _show_axes(self, estimate: ArmEstimate) -> None:
        reach = self.arm.bones.reach_m
        marks, length = axis_marks(estimate, self.arm.bones.hubs_m), LENGTH_OF_REACH * reach
        self.tube_exaggeration = tube_exaggeration(marks, length, TUBE_OF_REACH * reach)
        if self._axes is not None:
            self._axes.place(marks, self.tube_exaggeration)
            return
        sliding = self._bench.nominal.sliding
        look = {"radius_m": 0.0022 * reach, "exaggeration": self.tube_exaggeration, "view": self._view()}
        self._axes = AxesView(self._viewer, "/axes", marks, sliding, length, **look)

    def forget(self) -> None:
        """Take away what a solution has drawn."""
        if self.drawn is None:
            return
        self.drawn = None
        self._draw_as_calibrated()
        self._clear_for_diagnosis(False)
        if self._axes is not None:
            self._axes.remove()
            self._axes = None
        if self._diagnosis is not None:
            self._diagnosis.remove()
            self._diagnosis = None
        self.arm.opacity = None
        self.errors.show(np.zeros((0, 3)), np.zeros((0, 3)))

    @property
    def exaggeration(self) -> float:
        """How many times too large the differences of the geometry are drawn."""
        return self._exaggeration

    @exaggeration.setter
    def exaggeration(self, factor: float) -> None:
        self._exaggeration = factor
        if self._diagnosis is not None:
            self._diagnosis.exaggeration = factor

    def diagnose(self, wanted: bool) -> None:
        """Show nominal and actual geometry together, every significant difference as a dimension with its value."""
        self._diagnosed = wanted
        found = self.drawn
        if found is None or found.estimate.geometry is None or found.nominal is None:
            return
        if self._diagnosis is None and wanted:
            geometry, reach = found.estimate.geometry, self.arm.bones.reach_m
            self._diagnosis = DiagnosisView(
                self._viewer, found.nominal, geometry, geometry.base, reach, self._exaggeration, self._view()
            )
        if self._diagnosis is not None:
            self._diagnosis.visible = wanted
            self.light(None)
        shown = wanted and self._diagnosis is not None
        self._clear_for_diagnosis(shown)
        self.arm.opacity = 0.2 if shown else None
        if self._axes is not None:
            self._axes.visible = not shown

    def _clear_for_diagnosis(self, shown: bool) -> None:
        """While differences are shown, what was measured stands out of their way."""
        if shown == bool(self._put_away):
            return
        if shown:
            self._put_away = tuple(name for name in MEASURED if getattr(self, name).visible)
        for name in self._put_away:
            getattr(self, name).visible = not shown
        self._put_away = self._put_away if shown else ()

    def light(self, spot: Spot | None) -> None:
        """Draw what a result speaks of in the colour of attention: a dimension, or the axis of a joint; None: none."""
        self.lit = spot
        if self._diagnosis is not None:
            shown = spot is not None and self._diagnosis.has(spot.number, spot.parameter)
            self._diagnosis.highlight(spot.number if shown else None, spot.parameter if shown else "")
        if self._axes is not None:
            joint = spot is not None and not spot.parameter and spot.number <= len(self.arm.axes)
            self._axes.highlight(spot.number if joint else None)

    def camera_at(self, spot: Spot | None) -> Camera | None:
        """Where to see it from, None: where all of it is seen; None if it is not drawn."""
        if spot is None:
            return None if self._diagnosis is None else self._diagnosis.overview()
        if not spot.parameter:
            return next((c for c in self.cameras() if c.name == f"Joint {spot.number}"), None)
        if self._diagnosis is None or not self._diagnosis.has(spot.number, spot.parameter):
            return None
        return self._diagnosis.camera(spot.number, spot.parameter)

    def _colours(self, records: list[int]) -> Array:
        """Colours of shots: by radial residual of the last solution, plain before there is one, (k, 3)."""
        if self.drawn is None:
            return np.tile(np.array(BLUE, dtype=np.uint8), (len(records), 1))
        residuals, table = self.drawn.refinement.residuals, self.drawn.campaign.measurements
        radial = dict(zip(table.record[residuals.row].tolist(), residuals.radial_m.tolist(), strict=True))
        return self.scale.colours(np.array([radial.get(record, np.nan) for record in records]))


def axis_marks(estimate: ArmEstimate, hubs_m: Array) -> tuple[AxisMark, ...]:
    """The calibrated axes as the scene takes them; ``hubs_m``: where the joints are drawn, (n, 3)."""
    marks = []
    for joint, line in enumerate(estimate.arm.axes, 1):
        direction_std, place_std = estimate.axis_std(joint)
        marks.append(AxisMark(joint, line, hubs_m[joint - 1], direction_std, place_std, text=f"axis {joint}"))
    return tuple(marks)


def _look_alike(one: Line, other: Line) -> bool:
    """Whether two axes are nearer to each other than the eye sees."""
    turned = np.abs(one.direction - other.direction).max()
    return bool(max(turned, np.linalg.norm(one.foot_of(other.point_m) - other.point_m)) < SEEN_MOVING_M)


def _verdict(word: str) -> Verdict:
    return {"kept": Verdict.KEPT, "doubtful": Verdict.DOUBTFUL, "excluded": Verdict.EXCLUDED}[word]
