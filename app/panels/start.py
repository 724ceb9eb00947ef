"""The cell: who measures what, with what, on which robot."""

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING

from app.words import block
from app.workbench import Workbench
from core.session_events import Fact, OperatorNamed, Titled

if TYPE_CHECKING:
    import viser

FACTS = ("Robot serial number", "Instrument serial number", "Payload", "Place")


class StartPanel:
    """Names, serial numbers, robot, targets, instrument."""

    def __init__(self, gui: "viser.GuiApi", bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        gui.add_html(
            block(
                "<h3>The cell</h3><p>This is the built-in demo cell: a <b>simulated</b> ASEA IRB L6 watched by two "
                "simulated theodolites. Say who measures, then go to <b>2 Measure</b>.</p>",
                "cell-intro",
            )
        )
        state = bench.state
        self._title = gui.add_text("Title", state.title)
        self._who = gui.add_text("Operator", state.operator)
        self._facts = {name: gui.add_text(name, state.facts.get(name, "")) for name in FACTS}
        gui.add_button("Keep these", hint="Write them into the session.").on_click(self._keep)
        self._about = gui.add_html("")

    def refresh(self) -> None:
        """Show what the session holds."""
        state = self._bench.state
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>"
            for name, value in (
                ("Robot", self._bench.cell.robot.name),
                ("Instrument", state.instrument.kind),
                ("Stated noise", f"{(state.instrument.sigma_m or 0) * 1e3:.2g} mm, one coordinate"),
                ("Operator", state.operator or "not named yet"),
                *((key, value) for key, value in state.facts.items()),
                *((f"Target {t.name}", f"on link {t.link}") for t in state.targets),
                ("Session file", self._bench.session.path.name),
            )
        )
        warnings = "".join(f"<p class='bad'>{escape(text)}</p>" for text in state.warnings)
        read_only = self._bench.session.why_read_only
        warnings += f"<p class='bad'>Read-only: {escape(read_only)}</p>" if read_only else ""
        self._about.content = block(f"{warnings}<table>{rows}</table>", "cell")

    def _keep(self, event: "viser.GuiEvent") -> None:
        who, title = self._who.value.strip(), self._title.value.strip()
        facts = {name: box.value.strip() for name, box in self._facts.items()}

        def job(client: object) -> None:
            state = self._bench.state
            events = [OperatorNamed(who)] if who != state.operator else []
            events += [Titled(title)] if title and title != state.title else []
            events += [Fact(name, value) for name, value in facts.items() if value != state.facts.get(name, "")]
            if events:
                self._bench.session.append_all(events, who or None)
                self._bench.changed()

        self._ask(event, job)
