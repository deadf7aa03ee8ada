"""Pages and tables from templates; every text is escaped there, and what stands between backquotes becomes code."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape


class Cell(NamedTuple):
    """What stands in one cell: words, a smaller line below, a class of the style sheet, a coloured square before."""

    words: str
    below: str = ""
    kind: str = ""
    colour: str = ""


def text(words: object) -> Markup:
    """Escaped; what stands between backquotes becomes code; a number keeps to its sign."""
    kept = re.sub(r"(?<=\d) (?=[%×])|(?<=×) (?=10)", "\u00a0", str(escape(words)))
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", kept))


def cell(words: object, below: str = "", kind: str = "") -> Cell:
    """One cell, with a smaller line below where given."""
    return Cell(str(words), below, kind)


def named(words: str, below: str = "", colour: str = "") -> Cell:
    """Heading of a row or a column."""
    return Cell(words, below, colour=colour)


def table(caption: str, head: Iterable[str | Cell], rows: Iterable[tuple[str, Iterable[str | Cell]]]) -> Markup:
    """A table from plain words and cells; each row comes with a class of the style sheet, or an empty string."""
    def cells(some: Iterable[str | Cell]) -> list[Cell]:
        return [one if isinstance(one, Cell) else Cell(one) for one in some]

    pieces: Any = _environment().get_template("pieces.html").module
    return pieces.table(caption, cells(head), [(kind, cells(row)) for kind, row in rows])


def paragraph(words: str, kind: str = "") -> Markup:
    """A paragraph of a class of the style sheet."""
    return Markup('<p class="{}">{}</p>').format(kind, text(words)) if kind else Markup("<p>{}</p>").format(text(words))


def document(title: str, body: Iterable[str]) -> str:
    """A page of parts that are HTML already; it needs nothing from elsewhere."""
    return render("base.html", title=title, body=[Markup(part) for part in body])


def render(template: str, **values: Any) -> str:
    """A template of this package, filled."""
    return _environment().get_template(template).render(**values)


@cache
def _environment() -> Environment:
    made = Environment(loader=PackageLoader("rom.reporting"), autoescape=True, trim_blocks=True, lstrip_blocks=True,
                       undefined=StrictUndefined)
    made.filters["text"] = text
    return made
