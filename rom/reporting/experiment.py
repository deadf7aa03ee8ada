"""An experiment's folder as a page: the question, what was found, figures, tables, files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rom.reporting import html
from rom.reporting.figure import Figure
from rom.reporting.measured import provenance
from rom.reporting.report import write_page


def title_of(name: str) -> str:
    """Heading of an experiment from the name of its folder."""
    return name.replace("-", " ").capitalize()


def write_experiment(
    folder: Path,
    name: str,
    question: str,
    findings: Sequence[str],
    figures: Sequence[Figure],
    tables: Sequence[str] = (),
    files: Sequence[Path] = (),
    attributes: Mapping[str, Any] | None = None,
) -> Path:
    """Write the figures and ``index.html`` of one experiment; each file whole or not at all.

    Parameters
    ----------
    folder : Path
        Exists; figures of an earlier run that this one lacks are removed.
    name, question : str
        Head of the page.
    findings : sequence of str
        Sentences with their numbers, the most important first.
    figures : sequence of Figure
    tables : sequence of str
        HTML already (:func:`rom.reporting.html.table`).
    files : sequence of Path
        Further files in the folder that the page links.
    attributes : mapping
        Of the results: commit and software are printed.

    Returns
    -------
    Path
        Of the page.
    """
    attributes = attributes or {}
    for figure in figures:
        figure.write(folder)
    return write_page(folder, html.render(
        "experiment.html", title=title_of(name), question=question, findings=findings, figures=figures, tables=tables,
        quick=str(attributes.get("quick", "0")) == "1", files=[path.name for path in (*files, folder / "results.nc")],
        provenance=provenance(attributes)))
