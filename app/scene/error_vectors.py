"""Errors as arrows from where points were measured to where the model has them, magnified, with the factor written."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from app.scene.colours import ERROR_VECTOR, Rgb
from app.scene.group import SceneGroup, Viewer, add_solid
from app.scene.solids import Solid, arrow, merged
from core.geometry import Array

if TYPE_CHECKING:
    import viser


def magnified_ends(measured_m: ArrayLike, predicted_m: ArrayLike, magnification: float) -> Array:
    """Tails and tips of arrows, (k, 2, 3), for the points of which both places are known.

    Args:
        measured_m: (m, 3).
        predicted_m: (m, 3).
        magnification: how many times too long the arrows are.
    """
    measured, predicted = np.asarray(measured_m, dtype=float), np.asarray(predicted_m, dtype=float)
    known = np.isfinite(measured).all(axis=1) & np.isfinite(predicted).all(axis=1)
    start = measured[known]
    return np.stack([start, start + magnification * (predicted[known] - start)], axis=1)


def arrows(ends_m: Array, radius_m: float = 0.0028) -> Solid:
    """Arrows (k, 2, 3) as one solid; those of no length are left out."""
    return merged([arrow(start, end, radius_m, 6) for start, end in ends_m])


def factor_text(magnification: float) -> str:
    """How a magnification is written: x 200."""
    return f"\N{MULTIPLICATION SIGN} {magnification:g}"


class ErrorVectors(SceneGroup):
    """Nodes ``root/arrows`` and ``root/factor``."""

    def __init__(
        self,
        viewer: Viewer,
        root: str = "/errors",
        magnification: float = 200.0,
        colour: Rgb = ERROR_VECTOR,
        name: str = "residuals",
    ) -> None:
        """``name`` is written with the factor, so that one tells several kinds of errors apart."""
        super().__init__(viewer, root)
        self._name = name
        self._colour, self._magnification = colour, magnification
        self._measured, self._predicted = np.zeros((0, 3)), np.zeros((0, 3))
        self._label_m = np.zeros(3)
        self._drawn: list[viser.SceneNodeHandle] = []
        self._fresh = True

    def show(self, measured_m: ArrayLike, predicted_m: ArrayLike, label_m: ArrayLike | None = None) -> None:
        """Draw the errors of points, (m, 3) each; the factor is written at ``label_m``, else above the points."""
        self._measured, self._predicted = np.asarray(measured_m, dtype=float), np.asarray(predicted_m, dtype=float)
        self._label_m = _above(self._measured) if label_m is None else np.asarray(label_m, dtype=float)
        self._draw()

    @property
    def magnification(self) -> float:
        return self._magnification

    @magnification.setter
    def magnification(self, factor: float) -> None:
        self._magnification = factor
        self._draw()

    @property
    def visible(self) -> bool:
        return self._top.visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._top.visible = visible
        if visible and not self._fresh:
            self._draw()

    def _draw(self) -> None:
        """Draw if anybody sees it; else when it is shown."""
        self._fresh = self._top.visible
        if not self._fresh:
            return
        solid = arrows(magnified_ends(self._measured, self._predicted, self._magnification))
        with self._together():
            if len(solid.faces) == 0:
                for node in self._drawn:
                    node.remove()
                self._drawn = []
                return
            text = f"{self._name} {factor_text(self._magnification)}"
            mesh = add_solid(self._scene, f"{self._root}/arrows", solid, self._colour)
            label = self._scene.add_label(
                f"{self._root}/factor", text, position=self._label_m, anchor="bottom-center", font_screen_scale=1.1
            )
            self._drawn = [mesh, label]


def _above(points_m: Array) -> Array:
    known = points_m[np.isfinite(points_m).all(axis=1)]
    if len(known) == 0:
        return np.zeros(3)
    middle = (known.min(axis=0) + known.max(axis=0)) / 2
    return np.array([middle[0], middle[1], known[:, 2].max() + 0.12])
