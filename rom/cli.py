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
from typing import Any, NoReturn

from rom.commands import explain, export_page, frf, modes, path_dataset, serve, slide, stability, train
from rom.commands.progress import bar
from rom.errors import RomError

LARGEST_SEED = 2**63 - 1
"""What fits into the attribute of a file."""


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
    parser = _Parser(prog="rom", description="Reduced-order models of the human fingertip, compared honestly.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=_Parser)

    scenes = commands.add_parser("scenes", help="list the scenes, what each needs and what it leaves out")
    scenes.set_defaults(run=_scenes)

    dataset = commands.add_parser("dataset", help="make a dataset of a scene, resumable")
    dataset.add_argument("scene", metavar="SCENE")
    which = dataset.add_mutually_exclusive_group(required=True)
    which.add_argument("--cases", type=int, help="cases within the published ranges, solved directly")
    which.add_argument("--whole", nargs="?", const="published", choices=("published", "beyond"),
                       help="harmonic-point-force alone: every case of the published grid, or also those beyond it, by "
                            "a ROM whose residual is checked in each; stored reduced")
    dataset.add_argument("--beyond", type=int, help="with --cases: further cases outside the ranges (default 0)")
    dataset.add_argument("--output", type=Path, required=True, metavar="FILE")
    dataset.add_argument("--seed", type=_seed, default=0)
    dataset.add_argument("--preset", help="mesh of the linear scenes: metamodel (default) or study")
    dataset.add_argument("--formulation", help="of the linear scenes: b-bar (default), or full as published")
    dataset.add_argument("--compress", action="store_true", help="smaller and slower to write")
    path_dataset.add_options(dataset)
    dataset.set_defaults(run=_dataset)

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

    for command in (explain, export_page, frf, modes, serve, slide, stability, train):  # each a file in rom/commands
        command.add(commands)
    return parser


def _seed(text: str) -> int:
    if not text.isdecimal() or len(text) > 19 or int(text) > LARGEST_SEED:
        shown = repr(text if len(text) <= 40 else f"{text[:40]}...")
        raise argparse.ArgumentTypeError(f"{shown} is no seed, give a whole number from zero up to {LARGEST_SEED}")
    return int(text)


def _common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="coarse mesh and few cases: a check, not a result")
    parser.add_argument("--seed", type=_seed, help="decides cases, splits and networks (default: the report's own)")


def _scenes(_: argparse.Namespace) -> None:
    from rom.comparison.settings import NOT_APPLICABLE
    from rom.metamodels import applicable
    from rom.scenes import CONTACT_SCENES, SCENES

    scenes: list[Any] = [*SCENES.values(), *CONTACT_SCENES.values()]
    for scene in scenes:
        print(f"{scene.name}: {scene.title}\n  question    {scene.question}")
        print(f"  gate        {scene.gate:.0%} at the maximum over held-out cases")
        for heading, entries in (("inputs", scene.inputs), ("needs", scene.needs), ("leaves out", scene.leaves_out)):
            for i, (name, text) in enumerate(entries.items()):
                print(f"  {heading if i == 0 else '':<11} {name}: {text}")
        print(f"  outputs     full field, or the {'contact' if scene.name in CONTACT_SCENES else 'pad surface'} alone")
        print(f"  methods     {', '.join(applicable(scene.name))}")
        for i, (name, reason) in enumerate(NOT_APPLICABLE[scene.name].items()):
            print(f"  {'not' if i == 0 else '':<11} {name}: {reason}")
        print()


def _dataset(arguments: argparse.Namespace) -> None:
    from rom.datasets import make_dataset, make_whole_dataset
    from rom.fingertip import Fingertip
    from rom.scenes import CONTACT_SCENES, get_scene

    if arguments.scene in CONTACT_SCENES:
        path_dataset.run(arguments)
        return
    path_dataset.refuse_options(arguments)
    tip = Fingertip.preset(arguments.preset or "metamodel", formulation=arguments.formulation or "b-bar")
    scene = get_scene(arguments.scene, tip)

    def progress(items):
        return bar(items, "snapshots")

    if arguments.whole:
        if arguments.beyond is not None or arguments.compress:
            raise ValueError("--whole takes neither --beyond nor --compress: say `--whole beyond` for the cases "
                             "outside the published ranges; the file is small already")
        path = make_whole_dataset(scene, arguments.output, beyond=arguments.whole == "beyond", seed=arguments.seed,
                                  progress=progress)
    else:
        path = make_dataset(scene, arguments.cases, arguments.output, beyond=arguments.beyond or 0,
                            seed=arguments.seed, compress=arguments.compress, progress=progress)
    print(path)


def _compare(arguments: argparse.Namespace) -> None:
    from rom.comparison import compare, write_results
    from rom.comparison.side_by_side import chosen_curves
    from rom.reporting import conclusions, write_report

    methods = arguments.methods.split(",") if arguments.methods else None
    chosen_curves(arguments.scene, methods, arguments.quick)
    arguments.output.mkdir(parents=True, exist_ok=True)  # an impossible folder is refused before the work, not after
    results = compare(arguments.scene, methods=methods, cases=arguments.cases, quick=arguments.quick,
                      seed=arguments.seed, progress=bar)
    write_results(results, arguments.output)
    page = write_report(results, arguments.output)
    print(*conclusions(results), page, sep="\n")


def _report(arguments: argparse.Namespace) -> None:
    from rom.comparison import compare, write_results
    from rom.comparison.settings import COMPARED
    from rom.reporting import conclusions, write_index, write_report

    arguments.output.mkdir(parents=True, exist_ok=True)
    for name in COMPARED:
        folder = arguments.output / name
        results = compare(name, quick=arguments.quick, seed=arguments.seed, progress=bar)
        write_results(results, folder)
        page = write_report(results, folder)
        print(f"\n{results.attrs['title']}", *conclusions(results), page, sep="\n")
    print(f"\n{write_index(arguments.output)}")


if __name__ == "__main__":
    sys.exit(main())
