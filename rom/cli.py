"""The command `rom`: scenes, methods, datasets, comparisons, the report; natural modes and frequency responses.

Anything wrong with the input ends with one sentence on standard error and exit code 2; a full disk or an unwritable
folder likewise. Progress bars go to standard error.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
import warnings
from pathlib import Path
from typing import NoReturn

from rom.commands import body, dataset, explain, export_page, frf, modes, scenes, serve, slide, train
from rom.commands.progress import bar
from rom.commands.seed import seed
from rom.errors import RomError


def main(argv: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    arguments = _parser().parse_args(argv)
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s: %(message)s")
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn  # type: ignore[assignment]  # it takes whatever comes after the message
            arguments.run(arguments)
        sys.stdout.flush()
    except BrokenPipeError:  # whoever reads the output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (RomError, ValueError, OSError, OverflowError) as error:
        print(f"rom: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except MemoryError as error:
        print(f"rom: there is not enough memory: {' '.join(str(error).split()) or 'ask for less'}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("rom: interrupted; finished pieces are kept, the same command goes on from them", file=sys.stderr)
        return 130
    return 0


def _warn(message: Warning | str, *_: object) -> None:
    """A warning as one sentence, without the line of code that gave it."""
    print(f"rom: warning: {' '.join(str(message).split())}", file=sys.stderr)


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:  # one sentence, not the whole usage
        message = " ".join(message.split())
        self.exit(2, f"rom: {message}; `{self.prog} --help` lists what there is\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="rom", description="Reduced-order models side by side: how wrong, how fast, for how much.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=_Parser)

    compare = commands.add_parser("compare", help="compare the metamodels of a scene and write its report")
    compare.add_argument("scene", metavar="SCENE")
    compare.add_argument("--output", type=Path, required=True, metavar="FOLDER")
    compare.add_argument("--methods", help="comma-separated names (default: all that apply)")
    compare.add_argument("--cases", type=int, help="cases within the published ranges, held-out ones included")
    _common(compare)
    compare.set_defaults(run=_compare)

    report = commands.add_parser("report", help="compare all scenes and write the report's pages")
    report.add_argument("--output", type=Path, default=Path("reports"), metavar="FOLDER")
    _common(report)
    report.set_defaults(run=_report)

    # each a file in rom/commands
    for command in (body, dataset, explain, export_page, frf, modes, scenes, serve, slide, train):
        command.add(commands)
    return parser


def _common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="coarse mesh and few cases: a check, not a result")
    parser.add_argument("--seed", type=seed, help="decides cases, splits and networks (default: the report's own)")


def _compare(arguments: argparse.Namespace) -> None:
    from rom.comparison import chosen_curves, compare, scene_of, write_results
    from rom.reporting import conclusions, write_report

    methods = arguments.methods.split(",") if arguments.methods else None
    scene = scene_of(arguments.scene, quick=arguments.quick)
    chosen_curves(scene, methods, arguments.quick)
    arguments.output.mkdir(parents=True, exist_ok=True)  # an impossible folder is refused before the work, not after
    results = compare(scene, methods=methods, cases=arguments.cases, quick=arguments.quick, seed=arguments.seed,
                      workers=None, progress=bar)
    write_results(results, arguments.output)
    page = write_report(results, arguments.output)
    print(*conclusions(results), page, sep="\n")


def _report(arguments: argparse.Namespace) -> None:
    from rom.comparison import COMPARED, compared, write_results
    from rom.reporting import conclusions, write_index, write_report

    arguments.output.mkdir(parents=True, exist_ok=True)
    for name in COMPARED:
        folder = arguments.output / name
        results = compared(name, quick=arguments.quick, seed=arguments.seed, workers=None, progress=bar)
        write_results(results, folder)
        page = write_report(results, folder)
        print(f"\n{results.attrs['title']}", *conclusions(results), page, sep="\n")
    print(f"\n{write_index(arguments.output)}")


if __name__ == "__main__":
    sys.exit(main())
