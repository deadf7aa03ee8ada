"""A results file becomes a folder that a person reads: figures and a page, each file whole or not there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from rom.datasets.storage import open_netcdf, read_netcdf, whole_file
from rom.reporting import (
    checks,
    contact_errors,
    contact_paths,
    cost,
    error_over_inputs,
    fields,
    full_scale,
    page,
    regions,
    work_precision,
)
from rom.reporting.conclusions import verdict
from rom.reporting.experiment import title_of
from rom.reporting.figure import Figure
from rom.reporting.results import Results

FIGURES: dict[str, Callable[[Results], Figure | None]] = {
    "work-precision.png": work_precision.work_precision,
    "work-precision-batch-pad.png": work_precision.work_precision_elsewhere,
    "error-over-frequency.png": error_over_inputs.error_over_frequency,
    "error-over-population.png": full_scale.error_over_population,
    "pad-map.png": full_scale.pad_map,
    "fewer-snapshots.png": full_scale.fewer_snapshots,
    "error-over-forces.png": error_over_inputs.error_over_forces,
    "error-along-path.png": contact_errors.error_along_path,
    "contact-quantities.png": contact_errors.contact_quantities,
    "error-by-fibres.png": contact_errors.error_by_variant,
    "worst-paths.png": contact_paths.worst_paths,
    "worst-sections.png": contact_paths.worst_sections,
    "error-by-region.png": regions.error_by_region,
    "worst-fields.png": fields.worst_fields,
    "speed-up.png": cost.speed,
    "offline-cost.png": cost.offline_cost,
    "effectivity.png": checks.effectivity,
    "timing-spread.png": checks.timing,
}
"""Every figure that a report can have, in the order of the page; each is left out where its data are."""


def write_report(results: xr.Dataset, folder: str | Path) -> Path:
    """Write the figures and ``index.html`` of one scene.

    Parameters
    ----------
    results : xr.Dataset
        As read from ``results.nc``; complex variables are complex.
    folder : path
        Made where it does not exist; figures of an earlier report that this one lacks are removed.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    ValueError
        Where the results lack what no report can do without.
    OSError
        Where the folder cannot be written.
    """
    folder, found = Path(folder), Results(results)
    plates = []
    for file, draw in FIGURES.items():
        plate = draw(found)
        if plate is None:
            (folder / file).unlink(missing_ok=True)
        else:
            plate.write(folder)
            plates.append(plate)
    return _write_text(folder / "index.html", page.page(found, plates))


def write_index(folder: str | Path) -> Path:
    """Write the front page ``index.html`` over all comparisons and experiments whose results lie below a folder.

    Parameters
    ----------
    folder : path
        Of the folders that `write_report` and `write_experiment` wrote beside a ``results.nc``.

    Returns
    -------
    Path
        Of the front page.
    """
    scenes, experiments = [], []
    for file in sorted(Path(folder).glob("*/results.nc")):
        linked = f"{file.parent.name}/index.html"
        with open_netcdf(file) as results:
            known = {name: str(results.attrs.get(name, "")) for name in ("title", "finding")}
        if known["finding"]:
            experiments.append((title_of(file.parent.name), linked, known["finding"]))
        elif known["title"]:
            scenes.append((known["title"], linked, verdict(read_netcdf(file))))
    return _write_text(Path(folder) / "index.html", page.index(scenes, experiments))


def _write_text(path: Path, text: str) -> Path:
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path
