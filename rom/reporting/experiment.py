"""An experiment's folder as a page: the question, what was found, figures, tables, files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rom.datasets.storage import whole_file
from rom.reporting import html
from rom.reporting.figure import Figure

PROVENANCE = {"commit": "commit", "software_versions": "software", "machine": "machine", "fingertip": "fingertip"}


def title_of(name: str) -> str:
    """Heading of an experiment from the name of its folder."""
    return name.replace("-", " ").capitalize()


def write_experiment(
    folder: Path,
    name: str,
    question: str,
    findings: Sequence[str],
    plates: Sequence[Figure],
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
    plates : sequence of Figure
    tables : sequence of str
        HTML already.
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
    for old in set(folder.glob("*.png")) - {folder / plate.file for plate in plates}:
        old.unlink()
    for plate in plates:
        plate.write(folder)
    title = title_of(name)
    body = [f"<h1>{html.text(title)}</h1>", html.paragraph(question, "question")]
    if str(attributes.get("quick", "0")) == "1":
        body.append(html.paragraph("Coarse mesh and few cases: a check that everything runs, not a result.", "notice"))
    body.append(html.bullets(findings, "verdict"))
    body += [html.image(plate.file, plate.alt, plate.caption) for plate in plates]
    if tables:
        body.append(html.section("tables", "In numbers", *tables))
    links = [f'<li><a href="{path.name}">{html.text(path.name)}</a></li>' for path in (*files, folder / "results.nc")]
    body.append(html.section("files", "Files", "<ul>", *links, "</ul>"))
    known = {title: attributes[key] for key, title in PROVENANCE.items() if key in attributes}
    body.append(html.section("provenance", "Where it came from", html.definitions(known)))
    path = folder / "index.html"
    with whole_file(path) as temporary:
        temporary.write_text(html.document(title, body), encoding="utf-8")
    return path
