"""Small pieces of HTML, every text escaped in one place."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from html import escape

from rom.reporting.style import CSS


def text(words: object) -> str:
    """Escaped; what stands between backquotes becomes code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(str(words)))


def document(title: str, body: Iterable[str]) -> str:
    """A whole page that needs nothing from elsewhere."""
    return "\n".join([
        "<!DOCTYPE html>", '<html lang="en">', "<head>", '<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(title)}</title>", f"<style>{CSS}</style>", "</head>", "<body>", *body, "</body>",
        "</html>", ""])


def section(anchor: str, title: str, *body: str) -> str:
    """A heading that can be linked to, and what stands under it."""
    return "\n".join([f'<h2 id="{escape(anchor)}">{text(title)}</h2>', *body])


def paragraph(words: str, kind: str = "") -> str:
    return f'<p class="{kind}">{text(words)}</p>' if kind else f"<p>{text(words)}</p>"


def bullets(sentences: Iterable[str], kind: str = "") -> str:
    items = "\n".join(f"<li>{text(sentence)}</li>" for sentence in sentences)
    return f'<ul class="{kind}">\n{items}\n</ul>' if kind else f"<ul>\n{items}\n</ul>"


def definitions(pairs: Mapping[str, object]) -> str:
    return "<dl>\n" + "\n".join(f"<dt>{text(k)}</dt><dd>{text(v)}</dd>" for k, v in pairs.items()) + "\n</dl>"


def image(file: str, alt: str, caption: str) -> str:
    return (f'<figure id="{escape(file.rsplit(".", 1)[0])}"><img src="{escape(file)}" alt="{escape(alt)}">'
            f"<figcaption>{text(caption)}</figcaption></figure>")


def table(caption: str, head: Iterable[str], rows: Iterable[tuple[str, Iterable[str]]]) -> str:
    """``head`` and the cells are HTML already (see :func:`cell`); each row comes with its class."""
    lines = ['<div class="wide"><table>', f"<caption>{text(caption)}</caption>", "<thead><tr>"]
    lines += [f'<th scope="col">{title}</th>' for title in head]
    lines.append("</tr></thead>\n<tbody>")
    for kind, cells in rows:
        first, *others = cells
        row = f'<tr class="{kind}">' if kind else "<tr>"
        lines.append(f'{row}<th scope="row">{first}</th>{"".join(others)}</tr>')
    return "\n".join([*lines, "</tbody></table></div>"])


def cell(words: object, below: str = "", kind: str = "") -> str:
    """One cell, with a smaller line below where given."""
    small = f"<small>{text(below)}</small>" if below else ""
    return (f'<td class="{kind}">' if kind else "<td>") + text(words) + small + "</td>"


def named(words: str, below: str = "", colour: str = "") -> str:
    """Content of a row's or column's heading."""
    swatch = f'<span class="swatch" style="background:{escape(colour)}"></span>' if colour else ""
    return swatch + text(words) + (f"<small>{text(below)}</small>" if below else "")
