"""Export: one click each, file names that sort."""

from collections.abc import Callable

import viser

from app.exports import RESULTS, ROBOTS, Export, stamped
from app.words import block
from app.workbench import Workbench
from core.errors import InputError
from core.session_archive import campaign_archive
from core.session_store import SUFFIX

NOT_SOLVED = "Nothing is solved yet: go to 3 Solve and press Solve, then export."


class ExportPanel:
    """Buttons that send a file to the browser that asked."""

    def __init__(self, gui: viser.GuiApi, bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._intro = gui.add_html("")
        for export in RESULTS:
            self._button(gui, export)
        with gui.add_folder("The calibrated robot for other tools", expand_by_default=False):
            for export in ROBOTS:
                self._button(gui, export)
        hint = "campaign.toml, robot.toml, measurements.csv: for the command line, and to open again here."
        gui.add_button("Campaign (ZIP)", icon=viser.Icon.DOWNLOAD, hint=hint).on_click(self._send_campaign)

    def refresh(self) -> None:
        """Say whether there is something to export."""
        self._intro.content = intro_words(self._bench.calibration is not None, self._bench.solving.since_solved)

    def _button(self, gui: viser.GuiApi, export: Export) -> None:
        button = gui.add_button(export.label, icon=viser.Icon.DOWNLOAD, hint=export.hint)
        button.on_click(lambda event: self._send(event, export))

    def _send(self, event: viser.GuiEvent, export: Export) -> None:
        def job(client: viser.ClientHandle | None) -> None:
            found = self._bench.calibration
            if found is None:
                raise InputError(NOT_SOLVED)
            data = export.made(found)
            if client is not None:
                client.send_file_download(stamped(export.what, export.ending), data, save_immediately=True)

        self._ask(event, job, operator=False)

    def _send_campaign(self, event: viser.GuiEvent) -> None:
        def job(client: viser.ClientHandle | None) -> None:
            data = campaign_archive(self._bench.state, self._bench.session.path.name.removesuffix(SUFFIX))
            if client is not None:
                client.send_file_download(stamped("trueaxis_campaign", "zip"), data, save_immediately=True)

        self._ask(event, job, operator=False)


def intro_words(solved: bool, since: int) -> str:
    """What this step is for, and whether it can be done."""
    if not solved:
        now = "<p class='doubt'>Nothing is solved yet: press <b>Solve</b> under <b>3 Solve</b> first.</p>"
    elif since:
        count = "One shot or decision" if since == 1 else f"{since} shots or decisions"
        now = f"<p class='doubt'>{count} came after the solution; solve again to have them in the report.</p>"
    else:
        now = "<p class='ok'>✔ The solution is up to date.</p>"
    text = "<p class='soft'>Each file goes to this browser's downloads; its name begins with date and time (UTC).</p>"
    return block(f"<h3>Export</h3>{now}{text}", "export-intro")
