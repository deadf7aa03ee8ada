"""`rom export-page`: the interactive fingertip as one file to mail."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from rom.commands.fingertip_options import add_fingertip_options, fingertip_from
from rom.commands.progress import patient_bar


def add(commands: Any) -> None:
    """Add the command to the subparsers of `rom`."""
    parser = commands.add_parser("export-page", help="the interactive fingertip as one file that needs no server")
    parser.add_argument("file", type=Path, metavar="FILE.html")
    parser.add_argument("--quick", action="store_true", help="coarse mesh: a check, not a result")
    add_fingertip_options(parser, preset="metamodel")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Fit or read the modal model, write the file, say how far its numbers are off."""
    from rom.interactive.export import check_path, export_page

    check_path(arguments.file)
    if arguments.quick:
        arguments.preset = "quick"
    tip = fingertip_from(arguments)
    from rom.interactive.models import REFERENCE, Models

    models = Models(tip, quick=arguments.quick)
    models.prepare(patient_bar)
    found = export_page(models.model(REFERENCE, True), arguments.file)  # type: ignore[arg-type]
    print(f"{arguments.file}: {found['bytes'] / 1e6:.1f} MB; off {REFERENCE} by at most {found['field']:.1e} of the "
          f"pad's largest displacement, {found['probe']:.1e} at the loaded node")
