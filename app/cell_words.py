"""Small pieces of HTML about the cell and its sessions. Whatever comes from people or files is escaped here."""

from html import escape
from zlib import crc32

from app.clicks import listening, saying
from app.glossary import term
from app.rigs import Source
from app.words import block
from app.workbench import Workbench
from core.import_tray import Tray
from core.robot import Robot
from core.session_library import SessionSummary
from core.session_state import State
from core.suggested_plan import unseen_joints
from core.wording import fixed, with_capital

SESSION_WORD = "session-"
SOURCES = {
    Source.DEMO: "the built-in demo cell: a <b>simulated</b> robot and instrument",
    Source.SIMULATED: "a <b>simulated</b> arm of this robot, for practice: nothing is measured",
    Source.BY_HAND: "a real robot: you move it, and enter what the instrument shows",
}


def intro_words(bench: Workbench) -> str:
    """What this step is for and what comes next."""
    warnings = "".join(f"<p class='bad'>{escape(with_capital(text))}</p>" for text in bench.state.warnings)
    read_only = bench.session.why_read_only
    warnings += f"<p class='bad'>Read-only: {escape(read_only)}. Nothing can be changed here.</p>" if read_only else ""
    return block(
        f"<h3>The cell</h3>{warnings}<p>{escape(bench.nominal.name)}: {SOURCES[bench.rig.source]}.</p>"
        "<p class='soft'>Say who measures and what stands here, so that the report can tell. "
        "For a robot of your own open <b>New session</b>. Next: <b>Check</b> the instrument, then "
        "<b>2 Measure</b>.</p>",
        "cell-intro",
    )


def about_words(bench: Workbench) -> str:
    """What the session holds, as the program has it."""
    state = bench.state
    rows = (
        ("Robot", f"{bench.nominal.name}, {_joints(bench.nominal)}"),
        ("Instrument", state.instrument.kind.replace("-", " ")),
        ("Stated noise", _noise(state)),
        ("Operator", state.operator or "not named yet"),
        *((key[:1].upper() + key[1:], value) for key, value in state.facts.items()),
        *((_condition(key), f"{value:g}") for key, value in state.settings.items() if key in CONDITIONS),
        *((f"Target {t.name}", _place(t.link)) for t in state.targets),
        ("Session file", bench.session.path.name),
    )
    body = "".join(f"<tr><td class='name'>{escape(name)}</td><td>{escape(value)}</td></tr>" for name, value in rows)
    return block(f"<table>{body}</table>", "cell")


CONDITIONS = {"temperature_c": "Air temperature [°C]", "payload_kg": "Payload [kg]"}


def targets_words(state: State) -> str:
    """The targets with their links, and what they do not show."""
    rows = "".join(
        f"<tr><td>{escape(t.name)}</td><td>{_place(t.link)}</td><td class='soft'>{_known(t.point_m)}</td></tr>"
        for t in state.targets
    )
    missing = () if state.robot is None else unseen_joints(state.robot, state.target_links)
    warned = "".join(f"<p class='doubt'>{escape(sentence[:1].upper() + sentence[1:])}.</p>" for sentence in missing)
    text = (
        f"<p class='soft'>A {term('target', 'Target')} rides on a {term('link', 'Link')} and shows the joints below. "
        "For each joint one is needed that moves with it.</p>"
    )
    return block(f"{text}<table data-testid='targets'>{rows}</table>{warned}", "target-list")


def tray_words(tray: Tray, robot: Robot | None, wrong: str) -> str:
    """The files that were sent, what they make, and what is missing."""
    if not tray.files:
        text = (
            "robot.toml or a URDF file of your robot; a campaign as a ZIP file, or its three files one by one; or a "
            "session file."
        )
        return block(f"<p class='soft'>{text}</p>", "tray")
    names = ", ".join(map(escape, tray.names))
    words = f"<p>Files here: {names}.</p>"
    if wrong:
        words += f"<p class='bad'>{escape(wrong)}.</p>"
    elif tray.missing():
        words += f"<p class='doubt'>{escape(tray.missing())}.</p>"
    elif robot is not None:
        words += f"<p class='ok'>✔ {escape(robot.name)}, {_joints(robot)}: press <b>Begin</b>.</p>"
    if tray.campaign is not None and not tray.missing():
        words += "<p class='ok'>✔ A whole campaign: press <b>Open the campaign</b>.</p>"
    return block(words, "tray")


def sessions_words(summaries: tuple[SessionSummary, ...], chosen: str, most: int = 12) -> str:
    """The sessions of the folder, the last changed one first."""
    if not summaries:
        return block("<p class='soft'>No session holds these words. Empty the box to see all.</p>", "session-list")
    rows = "".join(_session_row(one, one.path.name == chosen) for one in summaries[:most])
    more = f"<p class='soft'>and {len(summaries) - most} more; search for them.</p>" if len(summaries) > most else ""
    head = "<tr><th>Session</th><th class='n'>Shots</th><th>Changed (UTC)</th></tr>"
    return block(listening(f"<table>{head}{rows}</table>") + more, "session-list")


def session_word(name: str) -> str:
    """What the row of a session says when it is clicked; short, however long the name of its file is."""
    return f"{SESSION_WORD}{crc32(name.encode()):08x}"


def _session_row(one: SessionSummary, chosen: bool) -> str:
    who = ", ".join(escape(word) for word in (one.robot, one.operator) if word)
    told = f"{escape(one.title)}<br><span class='soft'>{escape(one.path.name)}<br>{who}</span>"
    told += f"<br><span class='bad'>{escape(one.problem[:160])}</span>" if one.problem else ""
    return (
        f"<tr class='{'now' if chosen else ''}' {saying(session_word(one.path.name), 'Choose this session')}>"
        f"<td>{told}</td>"
        f"<td class='n'>{one.shots}/{one.planned}</td><td>{escape(one.changed_utc[:16].replace('T', ' '))}</td></tr>"
    )


def _joints(robot: Robot) -> str:
    sliding = int(robot.sliding.sum())
    return f"{robot.joint_count} joints" + (f", {sliding} of them sliding" if sliding else "")


def _place(link: int) -> str:
    return f"on link {link}" if link else "on the floor"


def _known(point_m: tuple[float, float, float] | None) -> str:
    return "" if point_m is None else ", ".join(fixed(v * 1e3, 1) for v in point_m) + " mm"


def _noise(state: State) -> str:
    sigma = state.instrument.sigma_m
    return "not stated" if sigma is None else f"{sigma * 1e3:.2g} mm, one coordinate"


def _condition(key: str) -> str:
    return CONDITIONS[key]
