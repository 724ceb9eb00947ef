"""An operator's whole way in pictures, light and dark, one for each step, to be looked at.

They are written to the folder that TRUEAXIS_SCREENSHOTS names, else to ``out/screenshots``.
"""

import os
from pathlib import Path

import pytest
from test_dashboard import chromium, group, measure, press, started, tab, visit, wait_for_text  # noqa: F401
from test_own_cell import ROBOT, begin, folder, send, typed

from core.session_store import SUFFIX

FOLDER = Path(os.environ.get("TRUEAXIS_SCREENSHOTS") or Path(__file__).parents[2] / "out" / "screenshots")
LEAST_BYTES = 20_000
"""An empty page takes less."""
RIGHT = ("Residuals", "Drives", "Axes", "Geometry")


@pytest.fixture
def dashboard(tmp_path):
    running = started(tmp_path / f"demo{SUFFIX}")
    yield running
    running.stop()


class Camera:
    """Takes pictures in their order."""

    def __init__(self, page, theme: str) -> None:
        self._page, self._theme, self._count = page, theme, 0
        FOLDER.mkdir(parents=True, exist_ok=True)

    def __call__(self, name: str) -> None:
        self._count += 1
        # The scene and the plots need a moment after the words.
        self._page.wait_for_timeout(900)
        path = FOLDER / f"way_{self._theme}_{self._count:02d}_{name.replace(' ', '_').lower()}.png"
        self._page.screenshot(path=path)
        assert path.stat().st_size > LEAST_BYTES, name


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_whole_way_on_the_demo_cell(chromium, dashboard, theme):  # noqa: F811
    page = visit(chromium, dashboard)
    page.set_viewport_size({"width": 1440, "height": 900})
    if theme == "dark":
        tab(page, "View")
        page.get_by_label("Dark theme", exact=True).filter(visible=True).check()
    picture = Camera(page, theme)
    tab(page, "1 Cell")
    picture("cell")
    tab(page, "Check")
    press(page, "Check")
    wait_for_text(page, "check", "8 shots at T1")
    picture("check")
    tab(page, "2 Measure")
    picture("before the first shot")
    measure(page, 5)
    picture("arc too short")
    measure(page, 5)
    picture("measuring")
    group(page, "Run all")
    wait_for_text(page, "step", "Nothing left to measure")
    picture("all measured")
    tab(page, "3 Solve")
    press(page, "Solve")
    page.wait_for_selector("[data-testid=noise]")
    picture("solved")
    for name in RIGHT:
        page.get_by_role("tab", name=name, exact=True).last.click()
        picture(name)
    page.locator("[data-testid=findings] li").first.click()
    picture("a finding in the scene")
    tab(page, "View")
    page.get_by_label("Geometry against design", exact=True).filter(visible=True).check()
    picture("geometry against design")
    tab(page, "4 Export")
    picture("export")
    tab(page, "Help")
    picture("help")
    assert page.problems == []
    page.close()


def test_a_robot_of_ones_own_by_hand(chromium, dashboard):  # noqa: F811
    page = visit(chromium, dashboard)
    picture = Camera(page, "own")
    folder(page, "New session")
    send(page, "robot.toml", ROBOT)
    wait_for_text(page, "tray", "press Begin")
    picture("files")
    begin(page)
    wait_for_text(page, "cell-intro", "Three axes")
    picture("new session")
    tab(page, "2 Measure")
    typed(page, "2500 300 200")
    picture("typed")
    press(page, "Measure")
    wait_for_text(page, "step", "stop 2 of")
    picture("first shot")
    assert page.problems == []
    page.close()
