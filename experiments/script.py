"""What every experiment script shares: `--quick`, `--output`, results and figure beside each other."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from rom.comparison.side_by_side import QUICK_DENSITY
from rom.datasets.storage import whole_file, write_netcdf
from rom.fingertip import Fingertip
from rom.provenance import stamp


def fingertip(quick: bool) -> Fingertip:
    """The `metamodel` preset, or a coarse mesh of the same anatomy."""
    tip = Fingertip.preset("metamodel")
    return replace(tip, density=QUICK_DENSITY) if quick else tip


def run(main: Callable[..., xr.Dataset], draw: Callable[[xr.Dataset], Figure], name: str) -> None:
    """Run an experiment from the command line and leave ``results.nc`` and ``figure.png`` in its folder."""
    parser = argparse.ArgumentParser(description=(main.__doc__ or "").strip().splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="coarse mesh: a check, not a result")
    parser.add_argument("--output", type=Path, default=Path("reports") / name, metavar="FOLDER")
    arguments = parser.parse_args()
    results = main(quick=arguments.quick)
    results.attrs.update(stamp(quick=str(int(arguments.quick))))
    write_netcdf(results, arguments.output / "results.nc")
    with whole_file(arguments.output / "figure.png") as temporary:
        draw(results).savefig(temporary, format="png", dpi=150)
    print(results.to_dataframe().to_string(max_rows=60))
    print(arguments.output)
