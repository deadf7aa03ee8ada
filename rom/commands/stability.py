"""`rom stability`: every method at extreme cases, and whether it says when it is wrong."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr


def add(commands: Any) -> None:
    """Add the sub-command."""
    parser = commands.add_parser("stability", help="every method at extreme cases: right, warned, refused or silent")
    parser.add_argument("--quick", action="store_true", help="tiny mesh and few extremes: a check, not a result")
    parser.add_argument("--axis", action="append", metavar="NAME", help="one axis of extremes; repeatable (default: "
                                                                        "all)")
    parser.add_argument("--methods", metavar="NAMES", help="comma-separated (default: all)")
    parser.add_argument("--output", type=Path, metavar="FOLDER", help="write results.nc, figures and a page")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Ask, judge, print, write."""
    from rom.commands.progress import bar
    from rom.stability import atlas

    if arguments.output is not None:
        arguments.output.mkdir(parents=True, exist_ok=True)  # an impossible folder is refused before the work
    methods = [name.strip() for name in arguments.methods.split(",")] if arguments.methods is not None else None
    results = atlas(quick=arguments.quick, axes=arguments.axis, methods=methods, progress=bar)
    print(_table(results))
    if arguments.output is not None:
        print(_write(results, arguments.output, arguments.quick))


def _table(results: xr.Dataset) -> str:
    """Defects one by one, then counts by axis and by method."""
    from rom.reporting.stability import OUTCOMES, counts, worst_first

    lines = []
    for i, j in worst_first(results, "silent", "crashed"):
        one = results.isel(case=i, method=j)
        error = float(one["error"])
        size = f"{error:8.1e}" if math.isfinite(error) else " unknown"
        lines.append(f"{one['outcome'].item():<8} {size}  {one['method'].item():<15} {one['axis'].item()}: "
                     f"{one['level'].item()}" + (f"  ({one['message'].item()[:80]})" if one["message"].item() else ""))
    lines = lines or ["no answer was silently wrong, nothing crashed"]
    axes = results["axis"].values
    groups = [(str(name), results.isel(case=axes == name)) for name in dict.fromkeys(axes)]
    groups += [(str(name), results.sel({"method": [name]})) for name in results["method"].values]
    lines += ["", f"{'':<30}" + "".join(f"{name:>9}" for name in OUTCOMES)]
    for name, part in [*groups, ("all", results)]:
        number = counts(part)
        if sum(number.values()):
            lines.append(f"{name:<30}" + "".join(f"{number[outcome]:>9}" for outcome in OUTCOMES))
    return "\n".join(lines)


def _write(results: xr.Dataset, folder: Path, quick: bool) -> Path:
    from rom.datasets.storage import write_netcdf
    from rom.provenance import stamp
    from rom.reporting.experiment import write_experiment
    from rom.reporting.stability import draw, findings, tables

    question = "Where does each method break, and does it say so?"
    sentences = findings(results)
    results.attrs.update(stamp(quick=str(int(quick)), question=question, finding=sentences[0], files=""))
    write_netcdf(results, folder / "results.nc")
    return write_experiment(folder, "stability", question, sentences, draw(results), tables(results), (),
                            results.attrs)
