"""How long an operator waits for the dashboard, in headless Chromium without a graphics card.

A time ends when the picture that shows the whole change has been painted: for a shot the next command, the verdict with
the residual, the point in the scene and the plot; for a solution the findings and the plot that is open.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from tests.benchmarks.tables import markdown

BROWSERS = ("/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome")
ARGUMENTS = ["--no-sandbox", "--enable-unsafe-swiftshader"]
VIEW = {"width": 1366, "height": 768}
USABLE = """() => { const m = window.__viserMutable;
  return !!m && !!m.canvas && m.canvas.width > 0 && getComputedStyle(m.canvas).opacity === '1'
    && !!document.querySelector('.tabler-icon-cloud-check') && !!document.querySelector('[data-testid=app-ready]') }"""
WATCHERS = 20
SHOTS, TURNS = 20, 2
"""Timed without and with watchers; the demo session has 44 shots that show a residual of their own."""
SOLUTIONS = 20
STEPS = 30
PATIENCE_MS = 60_000
PAUSE_MS = 250
"""Between two actions: the browser still draws when the change is already seen."""
PERSON_MS = 1000
"""What a person needs, at the least, from one tab to the next button."""


def report() -> str:
    """All times as a table in Markdown, and what the browser complained of."""
    rows, complaints = [], []
    with served() as port, chromium() as browser:
        rows.append(_row("page usable", [_load(browser, port) for _ in range(5)], "< 6000 ms"))
        page = visit(browser, port, complaints)
        tab(page, "2 Measure")
        alone, watched = [], []
        # By turns, so that what else the machine does falls on both.
        for _ in range(TURNS):
            alone += measured(page, SHOTS // TURNS)
            with watchers(port):
                watched += measured(page, SHOTS // TURNS)
        rows.append(_row("Measure to point, residual and plot", alone, "< 250 ms"))
        more = f"{np.median(watched) / np.median(alone):.2f} times, < 2"
        rows.append(_row(f"Measure while {WATCHERS} websocket clients watch", watched, more))
        finish(page)
        later = solved(page, SOLUTIONS, PERSON_MS)
        rows.append(_row("Solve to findings and plot, 1 s after the last change", later, "< 250 ms"))
        rows.append(_row("the same at once after a change", solved(page, SOLUTIONS, 0), ""))
        rows.append(_row("slider to arm moved", slid(page, STEPS), ""))
    said = "\n".join(complaints) or "none"
    load = f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    header = ("headless Chromium, software WebGL", "times", "median", "p95", "wanted")
    return f"{markdown(header, rows)}\n\nErrors in the console: {said}. {load[0].upper()}{load[1:]}.\n"


@contextmanager
def served() -> Iterator[int]:
    """A dashboard on the demo cell in a process of its own; gives its port."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "app", "serve", "--port", "0", "--sessions", folder]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                line = process.stdout.readline()
                yield int(line.split("http://127.0.0.1:")[1].split()[0])
            finally:
                process.terminate()
                process.communicate(timeout=20)


@contextmanager
def watchers(port: int) -> Iterator[None]:
    """Clients that watch, in a process of their own."""
    command = [sys.executable, "-m", "tests.benchmarks.watchers", str(port), str(WATCHERS)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline().strip() == "watching"
            yield
        finally:
            process.terminate()
            process.communicate(timeout=20)


@contextmanager
def chromium() -> Iterator:
    """A browser."""
    from playwright.sync_api import sync_playwright

    path = next(name for name in BROWSERS if Path(name).exists())
    with sync_playwright() as run:
        browser = run.chromium.launch(executable_path=path, args=ARGUMENTS)
        yield browser
        browser.close()


def visit(browser, port: int, complaints: list[str]):
    """A page on the dashboard, with the stopwatch in it."""
    page = browser.new_page(viewport=VIEW)
    page.set_default_timeout(PATIENCE_MS)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.goto(f"http://127.0.0.1:{port}/")
    page.wait_for_function(USABLE)
    page.locator(".mantine-Notification-root", has_text="Software WebGL").get_by_role("button").click()
    page.evaluate(Path(__file__).with_suffix(".js").read_text(encoding="utf-8"))
    return page


def tab(page, name: str) -> None:
    """Open a tab."""
    page.get_by_role("tab", name=name).click()
    page.wait_for_timeout(PAUSE_MS)


def measured(page, shots: int) -> list[float]:
    """Times of single shots, ms.

    Shots that begin a sweep or are of a second target have no residual yet: they are taken but not timed.
    """
    times = []
    while len(times) < shots:
        if page.evaluate("/stop [1-5] of|Joint [24]:/.test(watch.text('step'))"):
            before = page.evaluate("watch.text('step')")
            page.evaluate("watch.button('Measure').click()")
            page.wait_for_function("before => watch.text('step') !== before", arg=before)
        else:
            times.append(page.evaluate("watch.measure()"))
        page.wait_for_timeout(PAUSE_MS)
    return times


def finish(page) -> None:
    """Let the robot do the rest, solve once, and look at every tab of plots; the residuals stay open."""
    page.get_by_text("Run all", exact=True).click()
    page.wait_for_function("watch.text('step').includes('Nothing left to measure')")
    tab(page, "3 Solve")
    page.evaluate("watch.button('Solve').click()")
    page.wait_for_selector("[data-testid=findings]")
    for name in ("Drives", "Axes", "Geometry", "Residuals"):
        tab(page, name)


def solved(page, count: int, after_ms: int) -> list[float]:
    """Times of solutions, ms; some time before each the data change."""
    times = []
    for k in range(count):
        tab(page, "2 Measure")
        wanted, words = ("Include", "kept") if k % 2 else ("Exclude", "excluded")
        if wanted == "Exclude":
            page.get_by_role("combobox", name="Reason", exact=True).filter(visible=True).click()
            page.get_by_role("option", name="wrong target", exact=True).click()
        page.get_by_text(wanted, exact=True).click()
        page.wait_for_function("words => watch.text('shot').includes(words)", arg=words)
        page.get_by_role("tab", name="3 Solve").click()
        page.wait_for_timeout(after_ms)
        times.append(page.evaluate("watch.solve()"))
        page.wait_for_timeout(PAUSE_MS)
    return times


def slid(page, count: int) -> list[float]:
    """Times from a key on a slider to the arm in its new pose, ms."""
    tab(page, "View")
    page.get_by_text("Pose that is drawn", exact=True).click()
    page.wait_for_timeout(PAUSE_MS)
    thumb = page.get_by_role("slider").filter(visible=True).last
    thumb.focus()
    times = []
    for _ in range(count):
        times.append(thumb.evaluate("watch.slide"))
        page.wait_for_timeout(PAUSE_MS)
    return times


def _load(browser, port: int) -> float:
    """From the address to a page that can be used, in a browser that has seen nothing yet, ms."""
    context = browser.new_context(viewport=VIEW)
    page = context.new_page()
    start = time.perf_counter()
    page.goto(f"http://127.0.0.1:{port}/")
    page.wait_for_function(USABLE, timeout=PATIENCE_MS)
    taken = 1e3 * (time.perf_counter() - start)
    context.close()
    return taken


def _row(what: str, times_ms: list[float], wanted: str) -> list[str]:
    median, p95 = np.median(times_ms), np.quantile(times_ms, 0.95)
    return [what, str(len(times_ms)), f"{median:.0f} ms", f"{p95:.0f} ms", wanted]
