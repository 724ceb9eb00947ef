"""Real minus sim in 3-D: arrows from where the sim has a point, some causes added to it, to where it was measured."""

import numpy as np

from app.figures.gap_vectors import magnification
from app.figures.style import thinned
from app.scene.colours import BLUE, VERMILLION
from app.scene.error_vectors import ErrorVectors
from app.scene.group import SceneGroup, Viewer
from core.gap.ledger import difference_with
from core.gap.result import GapReport

MOST_ARROWS = 400
NOTHING = np.zeros((0, 3))


class GapView:
    """Nodes ``/gap/as_it_is`` and ``/gap/with_causes``."""

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._top = SceneGroup(viewer, "/gap")
        self._before = ErrorVectors(viewer, "/gap/as_it_is", 1.0, VERMILLION, "gap")
        self._after = ErrorVectors(viewer, "/gap/with_causes", 1.0, BLUE, "gap left")

    def show(self, report: GapReport | None, added: int) -> None:
        """Draw the arrows of a diagnosis.

        Args:
            report: None: nothing to draw.
            added: which causes are added to the sim: bit k, cause k.
        """
        with self._viewer.atomic():
            if report is None:
                self._before.show(NOTHING, NOTHING)
                self._after.show(NOTHING, NOTHING)
                return
            rows = thinned(len(report.rows), np.linalg.norm(report.difference_m, axis=1), MOST_ARROWS)
            real = report.campaign.measurements.point_m[report.rows]
            # The same factor whatever is added, so that arrows are seen to shrink.
            factor = magnification(real, report.difference_m[rows])
            start = (real - difference_with(report, added))[rows]
            for arrows, wanted in ((self._before, added == 0), (self._after, added != 0)):
                arrows.magnification = factor
                arrows.show(start if wanted else NOTHING, real[rows] if wanted else NOTHING)
