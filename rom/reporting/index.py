"""The front page: a card with a picture, a question and its answer for everything that lies below a folder."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from rom.datasets.storage import open_netcdf, read_netcdf
from rom.reporting import html
from rom.reporting.conclusions import verdict
from rom.reporting.experiment import title_of
from rom.reporting.report import images, write_page

CHAPTERS = {
    "Which method answers fastest, and how wrong is it": ("static-point-forces", "harmonic-point-force",
                                                          "finger-on-glass"),
    "What the body does": ("vibration-modes", "frequency-response", "animations", "interactive", "forced-shapes",
                           "several-forces", "tissue-strain", "collagen-contact"),
    "Why these methods work": ("modal-participation", "krylov-convergence", "certificate", "stability", "networks",
                               "left-out", "tissue-loss-factors"),
    "How far the model itself can be trusted": ("mesh-convergence", "locking", "sensitivity", "surface-calibration"),
}
"""Folders in the order in which a newcomer would want them; others follow, comparisons first."""


class Card(NamedTuple):
    """A page, told in a picture, a question and an answer."""

    page: str
    title: str
    question: str
    answer: str
    image: str
    alt: str


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
    folder, cards = Path(folder), {}
    rest: dict[bool, list[str]] = {True: [], False: []}
    for file in sorted(folder.glob("*/results.nc")):
        name = file.parent.name
        with open_netcdf(file) as results:
            known = {key: str(results.attrs.get(key, "")) for key in ("title", "finding", "question")}
        if known["finding"] or known["title"]:
            answer = known["finding"] or verdict(read_netcdf(file))
            cards[name] = Card(f"{name}/index.html", known["title"] or title_of(name), known["question"], answer,
                               *_picture(file.parent))
            if not any(name in names for names in CHAPTERS.values()):
                rest[not known["finding"]].append(name)
    first, *others = CHAPTERS
    order = {first: (*CHAPTERS[first], *rest[True]), **{name: CHAPTERS[name] for name in others},
             "Further experiments": tuple(rest[False])}
    chapters = {heading: [cards[name] for name in names if name in cards] for heading, names in order.items()}
    return write_page(folder, html.render(
        "index.html", title="Reduced-order models, side by side",
        chapters={heading: some for heading, some in chapters.items() if some}))


def _picture(folder: Path) -> tuple[str, str]:
    """Path and words of the first image of a page; empty where it has none."""
    for name, words in images(folder / "index.html").items():
        return f"{folder.name}/{name}", words
    return "", ""
