"""A results file becomes a folder that a person reads: figures and a page, each file whole or not there.

A page is a list of sections, a section a list of figures, sentences and tables; each looks at the results' variables,
dimensions and attributes and is left out where they say nothing to it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from html import unescape
from pathlib import Path
from typing import Any

import xarray as xr

from rom.files import whole_file
from rom.reporting import bounds, cost, fields, full_scale, html, inputs, measured, positions, tables
from rom.reporting.choices import choice_table
from rom.reporting.conclusions import conclusions, failures
from rom.reporting.figure import Figure
from rom.reporting.network_verdict import network_tables, network_verdict
from rom.reporting.regions import error_by_region
from rom.reporting.results import Results
from rom.reporting.work_precision import work_precision, work_precision_elsewhere

Drawing = Callable[[Results], Figure | None]
Writing = Callable[[Results], Iterator[str]]


@dataclass(frozen=True)
class Section:
    """A part of a page: where it is linked to, its heading, what it is about, and what may stand in it."""

    anchor: str
    title: str
    about: str
    figures: tuple[Drawing, ...] = ()
    tables: tuple[Writing, ...] = ()
    sentences: tuple[Writing, ...] = ()
    records: Callable[[Results], dict[str, dict[str, str]]] = field(default=lambda _: {})


SECTIONS = (
    Section("methods", "Every method", "errors, times, preparation of the settings that stand for them",
            (work_precision_elsewhere, cost.speed), (tables.headline_table, tables.speed_tables)),
    Section("where", "Where they err", "over the inputs, along a case, in space",
            (inputs.error_over_inputs, positions.error_over_positions, inputs.error_by_quantity, fields.worst_fields,
             positions.worst_curves)),
    Section("learners", "Methods that learn from solved cases", "from how many, at what price, how far they carry",
            (full_scale.fewer_snapshots, full_scale.error_over_population, full_scale.pad_map),
            (tables.learner_table, network_tables), (network_verdict,)),
    Section("bounds", "Error bounds", "how sharp, and whether one was ever broken",
            (bounds.effectivity,), (bounds.bound_table,)),
    Section("extrapolation", "Beyond the training", "parts of the inputs that were kept from it", (error_by_region,)),
    Section("cost", "What it costs", "preparation, break-even, spread of the timings",
            (cost.offline_cost, cost.timing)),
    Section("failures", "What did not work", "gates missed, models slower than the solver, bounds that are none",
            (), (tables.shortfall_table, tables.mode_table), (failures,)),
    Section("measured", "How it was measured", "protocol, needs, provenance",
            (), (), (measured.protocol,), measured.records),
    Section("settings", "All settings", "every number of every setting", (), (tables.settings_table,)),
)


def write_report(results: xr.Dataset, folder: str | Path) -> Path:
    """Write the figures and ``index.html`` of one comparison.

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
    figures = {draw: draw(found) for draw in (work_precision, *(draw for one in SECTIONS for draw in one.figures))}
    for figure in figures.values():
        if figure is not None:
            figure.write(folder)
    return write_page(folder, page(found, figures))


def page(found: Results, figures: dict[Drawing, Figure | None]) -> str:
    """HTML of a comparison's report; images are named relative to it, and stand where their figures were drawn."""
    sections = []
    for one in SECTIONS:
        parts: dict[str, Any] = {
            "figures": [figure for draw in one.figures if (figure := figures.get(draw)) is not None],
            "tables": [table for write in one.tables for table in write(found)],
            "sentences": [sentence for write in one.sentences for sentence in write(found)],
            "records": one.records(found)}
        if any(parts.values()):
            sections.append({"anchor": one.anchor, "title": one.title, "about": one.about, **parts})
    return html.render(
        "comparison.html", title=found.text("title", "Comparison of metamodels"), question=found.text("question"),
        quick=bool(int(found.data.attrs.get("quick", 0))), verdict=conclusions(found.data),
        lead=figures.get(work_precision), choices=choice_table(found), sections=sections)


def write_page(folder: Path, text: str) -> Path:
    """Write ``index.html``, whole or not at all, remove the images that only the page before it showed; its path."""
    path = folder / "index.html"
    before = images(path)
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    for name in set(before) - set(images(path)):
        if "/" not in name:
            (folder / name).unlink(missing_ok=True)
    return path


def images(page: Path) -> dict[str, str]:
    """Images that a page shows, in its order, and the words for those who do not see them; none if there is no page."""
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    return {name: unescape(words) for name, words in re.findall(r'<img src="([^"]+)" alt="([^"]*)"', text)}
