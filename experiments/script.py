"""What every experiment script shares: its options, and a folder with results, figures and a page to read."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import xarray as xr

from rom.commands.progress import bar
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.fingertip import Fingertip
from rom.provenance import stamp
from rom.reporting import write_index
from rom.reporting.experiment import write_experiment
from rom.reporting.figure import Figure

Progress = Callable[[Iterable, str], Iterable]
"""Wraps an iteration and its title, to show a bar."""


def silent(items: Iterable, _: str) -> Iterable:
    """No bar: for callers who watch by other means."""
    return items


def fingertip(quick: bool, preset: str = "metamodel") -> Fingertip:
    """A preset, or a coarse mesh of the same anatomy.

    `study` comes with full integration: so the modal study computed, and so the surfaces were calibrated to it.
    """
    return Fingertip.preset("quick" if quick else preset, formulation="full" if preset == "study" else "b-bar")


def spoken(tip: Fingertip) -> str:
    """Size and elements of a fingertip, for the page."""
    return f"{tip.mesh.n_nodes:,} nodes, {len(tip.free_dofs):,} free degrees of freedom, {tip.formulation}"


def run(
    main: Callable[..., xr.Dataset],
    draw: Callable[[xr.Dataset], Sequence[Figure]],
    findings: Callable[[xr.Dataset], Sequence[str]],
    name: str,
    *,
    tables: Callable[[xr.Dataset], Sequence[str]] = lambda _: (),
    extra: Callable[[xr.Dataset, Path], Sequence[Path]] = lambda *_: (),
    options: Callable[[argparse.ArgumentParser], None] = lambda _: None,
) -> None:
    """Run an experiment from the command line and leave results, figures and page in its folder.

    Parameters
    ----------
    main : callable
        ``main(quick=..., progress=...) -> xr.Dataset``; the first line of its docstring heads the page.
    draw, findings : callable
        Results to figures, and to sentences with their numbers.
    name : str
        Folder below ``reports``.
    tables : callable
        Results to tables of HTML (:func:`rom.reporting.html.table`).
    extra : callable
        Writes further files (animations, scenes, VTU) into the folder and returns their paths; the page links them.
    options : callable
        Adds further options to the command line, which become arguments of ``main``.
    """
    question = (main.__doc__ or "").strip().splitlines()[0]
    parser = argparse.ArgumentParser(description=question)
    parser.add_argument("--quick", action="store_true", help="coarse mesh: a check, not a result")
    parser.add_argument("--output", type=Path, metavar="FOLDER",
                        help=f"default: reports/{name}, or reports/quick/{name} with --quick")
    parser.add_argument("--redraw", action="store_true", help="figures and page anew from the results that lie there")
    options(parser)
    arguments = parser.parse_args()
    further = {key: value for key, value in vars(arguments).items() if key not in ("quick", "output", "redraw")}
    folder = arguments.output or Path("reports", *(["quick"] if arguments.quick else []), name)
    folder.mkdir(parents=True, exist_ok=True)
    if arguments.redraw:
        results = read_netcdf(folder / "results.nc")
        files = [folder / file for file in results.attrs["files"].split()]
        sentences = list(findings(results))
    else:
        results = _answered(parser, lambda: main(quick=arguments.quick, progress=bar, **further))
        files = list(extra(results, folder))
        sentences = list(findings(results))
        results.attrs.update(stamp(quick=str(int(arguments.quick)), question=question, finding=sentences[0],
                                   files=" ".join(file.name for file in files)))
        write_netcdf(results, folder / "results.nc")
    page = write_experiment(folder, name, question, sentences, draw(results), tables(results), files, results.attrs)
    if arguments.output is None:
        write_index(folder.parent)
    print(*sentences, page, sep="\n")


def _answered(parser: argparse.ArgumentParser, work: Callable[[], xr.Dataset]) -> xr.Dataset:
    """The results; one sentence and exit code 2 for input that cannot be."""
    try:
        return work()
    except ValueError as error:
        parser.exit(2, f"{' '.join(str(error).split())}\n")
