"""`rom serve`: the interactive fingertip on loopback."""

from __future__ import annotations

import argparse
import threading
from typing import Any

from rom.commands.fingertip_options import add_fingertip_options, fingertip_from
from rom.commands.progress import bar, patient_bar

LAST_PORT = 65535


def add(commands: Any) -> None:
    """Add the command to the subparsers of `rom`."""
    parser = commands.add_parser("serve", help="the interactive fingertip: a page on this machine")
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (default 127.0.0.1, loopback)")
    parser.add_argument("--port", type=_port, default=8000, help="port (default 8000; 0 picks a free one)")
    parser.add_argument("--open", action="store_true", help="open the page in the browser")
    parser.add_argument("--fit", action="store_true",
                        help="first fit POD and networks too where the cache lacks them (takes minutes)")
    parser.add_argument("--quick", action="store_true", help="coarse mesh: a check, not a result")
    add_fingertip_options(parser, preset="metamodel")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Prepare the models, print the address, serve until interrupted."""
    from rom.interactive.server import address_of, listen

    if arguments.quick:
        arguments.preset = "quick"
    tip = fingertip_from(arguments)
    bound = listen(arguments.host, arguments.port)
    try:
        from rom.interactive.engine import Engine
        from rom.interactive.models import Models
        from rom.interactive.server import make_application, serve

        models = Models(tip, quick=arguments.quick)
        models.prepare(patient_bar)
        if arguments.fit:
            models.fit_all(bar)
        engine = Engine(models)
        address = address_of(bound)

        def ready() -> None:
            print(f"the interactive fingertip is at {address} (Ctrl-C ends it)", flush=True)
            if arguments.open:
                import webbrowser

                threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

        serve(make_application(engine, arguments.host), bound, ready)
    finally:
        bound.close()


def _port(text: str) -> int:
    if not (text.isascii() and text.isdecimal()) or len(text) > 5 or int(text) > LAST_PORT:
        raise argparse.ArgumentTypeError(f"{text[:20]!r} is no port, give a whole number from 0 to {LAST_PORT}")
    return int(text)
