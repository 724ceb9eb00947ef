"""``trueaxis serve``: the dashboard in a browser."""

import argparse
import signal
import sys
import threading
from pathlib import Path


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "session", nargs="?", type=Path, metavar="SESSION", help="session file (default: the demo cell)"
    )
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (default: this machine only)")
    parser.add_argument("--port", type=int, default=8080, metavar="N", help="port (default: 8080)")
    parser.add_argument("--sessions", type=Path, metavar="DIR", help="folder of the session files")


def run(arguments: argparse.Namespace) -> None:
    """Serve until interrupted.

    Raises:
        InputError: the session cannot be opened, or the address cannot be used.
    """
    from app.dashboard import Dashboard, run_until, session_folder
    from app.workbench import Workbench
    from core.session import Session
    from core.session_store import SUFFIX
    from core.twin import irb_l6
    from core.twin.demo import demo_events

    cell = irb_l6.cell()
    if arguments.session is not None:
        session = Session.open(arguments.session)
    else:
        path = session_folder(arguments.sessions) / f"demo{SUFFIX}"
        session = Session.open(path) if path.exists() else Session.create(path, demo_events(cell))
    dashboard = Dashboard(Workbench(session, cell), arguments.host, arguments.port)
    if arguments.host not in ("127.0.0.1", "localhost", "::1"):
        print(
            "Anybody who reaches this address can see and change the session: there is no password. "
            "Use it in a network that you trust.",
            file=sys.stderr,
        )
    print(f"trueaxis dashboard: http://{arguments.host}:{dashboard.port}  (session {session.path})", flush=True)
    stop = threading.Event()
    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, lambda *_: stop.set())
    run_until(stop, dashboard)
