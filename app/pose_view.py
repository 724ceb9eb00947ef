"""Wanted poses in 3-D: where they are, which can be clicked, and how far the tool ended from them, before and after."""

from collections.abc import Callable
from enum import StrEnum

import numpy as np
from scipy.spatial.transform import Rotation

from app.scene.colours import BLUE, VERMILLION, Rgb, round_down
from app.scene.error_vectors import ErrorVectors
from app.scene.group import SceneGroup, Viewer
from app.scene.points import PointMarks, PointsView, Verdict
from core.geometry import Array
from core.pose_loop import Attempts, PoseLoop

LONGEST_M = 0.25
"""Of an arrow whose magnification fits."""
LARGEST_FACTOR = 1000.0
AXES_M, THICK_M, THIN_M = 0.09, 0.0022, 0.0012
"""Length and radii of the axes of wanted and reached tools."""


class Shown(StrEnum):
    """Whose errors are drawn."""

    BEFORE = "before"
    AFTER = "after"
    BOTH = "both"
    NONE = "none"


class PoseView:
    """Nodes ``/poses``, ``/pose_errors/before``, ``/pose_errors/after``, ``/pose_frames``."""

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self.points = PointsView(viewer, "/poses", radius_m=0.013)
        self._top = SceneGroup(viewer, "/pose_errors")
        self._errors = {
            Shown.BEFORE: ErrorVectors(viewer, "/pose_errors/before", 1.0, VERMILLION, "pose errors"),
            Shown.AFTER: ErrorVectors(viewer, "/pose_errors/after", 1.0, BLUE, "pose errors left"),
        }
        self._frames = SceneGroup(viewer, "/pose_frames")
        self._drawn: list = []

    def on_click(self, callback: Callable[[int, int], None]) -> None:
        """Call back with the index of the wanted pose and the client who clicked it."""
        self.points.on_click(callback)

    def show(self, loop: PoseLoop | None, shown: Shown, factor: float | None, chosen: int | None) -> None:
        """Draw what came of the poses.

        Args:
            loop: None: nothing to draw.
            shown: whose errors.
            factor: magnification of the arrows; None: one that fits.
            chosen: index of the wanted pose to be marked, with the axes of the wanted and the reached tool.
        """
        ways = _ways(loop, shown)
        fitting = fitting_factor([a for a in ways.values()]) if factor is None else factor
        with self._viewer.atomic():
            for way, errors in self._errors.items():
                start, end = _ends(ways.get(way))
                errors.show(start, end)
                if errors.magnification != fitting:
                    errors.magnification = fitting
            self._show_places(loop, shown, chosen)
            self._show_frames(loop, ways, chosen)

    def place_m(self, loop: PoseLoop, chosen: int) -> Array | None:
        """Where a wanted pose is, (3,), in the instrument's frame; None: it was never visited."""
        for attempts in (loop.nominal, loop.compensated):
            row = attempts.last(chosen)
            if row is not None:
                return attempts.errors.predicted[row, :3, 3]
        return None

    def _show_places(self, loop: PoseLoop | None, shown: Shown, chosen: int | None) -> None:
        places = [] if loop is None else [self.place_m(loop, k) for k in range(len(loop.wanted))]
        points = np.array([p for p in places if p is not None]).reshape(-1, 3)
        rows = np.array([k for k, p in enumerate(places) if p is not None], dtype=int)
        colour = np.tile(np.array(_colour(shown), dtype=np.uint8), (len(rows), 1))
        # Another shape than that of shots.
        self.points.show(PointMarks(rows, points, colour, np.full(len(rows), Verdict.DOUBTFUL)))
        place = places[chosen] if chosen is not None and chosen < len(places) else None
        self.points.mark_last(place)

    def _show_frames(self, loop: PoseLoop | None, ways: dict[Shown, Attempts], chosen: int | None) -> None:
        for node in self._drawn:
            node.remove()
        self._drawn = []
        if loop is None or chosen is None:
            return
        for way, attempts in ways.items():
            row = attempts.last(chosen)
            if row is not None:
                self._axes(f"{way}/wanted", attempts.errors.predicted[row], THIN_M)
                self._axes(f"{way}/reached", loop.found.measured.pose[attempts.row[row]], THICK_M)

    def _axes(self, name: str, pose: Array, radius_m: float) -> None:
        if np.isfinite(pose).all():
            wxyz = Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True)
            frame = self._viewer.scene.add_frame(
                f"/pose_frames/{name}",
                wxyz=wxyz,
                position=pose[:3, 3],
                axes_length=AXES_M,
                axes_radius=radius_m,
                origin_radius=2 * radius_m,
            )
            self._drawn.append(frame)


def fitting_factor(all_attempts: list[Attempts]) -> float:
    """A round magnification at which the longest of some errors is seen well."""
    sizes = np.concatenate([a.errors.position.known for a in all_attempts]) if all_attempts else np.zeros(0)
    longest = float(sizes.max(initial=0.0))
    return min(round_down(LONGEST_M / longest), LARGEST_FACTOR) if longest > 1e-9 else 1.0


def _ways(loop: PoseLoop | None, shown: Shown) -> dict[Shown, Attempts]:
    if loop is None:
        return {}
    both = {Shown.BEFORE: loop.nominal, Shown.AFTER: loop.compensated}
    return {way: attempts for way, attempts in both.items() if shown in (way, Shown.BOTH) and attempts.count}


def _ends(attempts: Attempts | None) -> tuple[Array, Array]:
    """From where the tool was wanted to where it was measured, (a, 3) each."""
    if attempts is None:
        return np.zeros((0, 3)), np.zeros((0, 3))
    wanted = attempts.errors.predicted[:, :3, 3]
    return wanted, wanted + attempts.errors.shift_m


def _colour(shown: Shown) -> Rgb:
    return BLUE if shown is Shown.AFTER else VERMILLION
