"""``trueaxis serve``: the dashboard in a browser."""

import argparse
import signal
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.session import Session


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "session",
        nargs="?",
        type=Path,
        metavar="SESSION",
        help="session file, or a campaign folder, which becomes a new session (default: the demo cell)",
    )
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (default: this machine only)")
    parser.add_argument("--port", type=int, default=8080, metavar="N", help="port (default: 8080)")
    parser.add_argument("--sessions", type=Path, metavar="DIR", help="folder of the session files")


def run(arguments: argparse.Namespace) -> None:
    """Serve until interrupted.

    Raises:
        InputError: the session cannot be opened, or the address cannot be used.
    """
    from app.dashboard import Dashboard, run_until
    from app.log_file import keep_log
    from app.workbench import Workbench

    dashboard = Dashboard(Workbench(_session(arguments)), arguments.host, arguments.port)
    session = dashboard.bench.session
    if arguments.host not in ("127.0.0.1", "localhost", "::1"):
        print(
            "Anybody who reaches this address can see and change the session: there is no password. "
            "Use it in a network that you trust.",
            file=sys.stderr,
        )
    log = keep_log(session.path.parent)
    kept = f"session {session.path}" + ("" if log is None else f", log {log}")
    print(f"trueaxis dashboard: http://{arguments.host}:{dashboard.port}  ({kept})", flush=True)
    stop = threading.Event()
    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, lambda *_: stop.set())
    run_until(stop, dashboard)


def _session(arguments: argparse.Namespace) -> "Session":
    """The session that is asked for: a file, a campaign folder, or the demo cell's own.

    Raises:
        InputError: it cannot be opened.
    """
    from app.dashboard import session_folder
    from app.rigs import SETTING, Source
    from core.session import Session
    from core.session_events import Setting
    from core.session_import import campaign_events
    from core.session_library import free_path
    from core.session_store import SUFFIX
    from core.twin import irb_l6
    from core.twin.demo import demo_events

    asked: Path | None = arguments.session
    if asked is None:
        path = session_folder(arguments.sessions) / f"demo{SUFFIX}"
        return Session.open(path) if path.exists() else Session.create(path, demo_events(irb_l6.cell()))
    if not asked.is_dir():
        return Session.open(asked)
    # What was measured goes on by hand, whatever robot it was measured on.
    events = [*campaign_events(asked), Setting(SETTING, str(Source.BY_HAND))]
    return Session.create(free_path(session_folder(arguments.sessions), asked.resolve().name), events)
