"""What every figure shares: a file name, words for the page, fonts and log axes that people can read."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rom.files import whole_file
from rom.reporting import palette, words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure as MatplotlibFigure

DPI = 150
WIDTH = 10.0
"""Inches; 1,500 pixels, shown at about 1,000."""
COLUMN = 5.8
"""Width [inches] of figures that stand in columns, and over the whole of a telephone."""
SMALLEST = 1e-16
"""Errors below this, exact zeros among them, are drawn here."""


@dataclass(frozen=True)
class Figure:
    """A figure with the words that stand by it on the page."""

    file: str
    figure: MatplotlibFigure
    caption: str
    alt: str
    points: Sequence[tuple[Axes, float, float, str]] = field(default=(), kw_only=True)
    """What is told under the pointer: axes, place in their data, words."""

    def write(self, folder: Path) -> None:
        """Save as PNG, whole or not at all."""
        with whole_file(folder / self.file) as temporary:
            self.figure.savefig(temporary, format="png", dpi=DPI, metadata={"Software": None})

    def spots(self) -> list[tuple[float, float, str]]:
        """The points as they lie on the image: distance from its left and its top [%], words; once it is written."""
        width, height = self.figure.bbox.size
        placed = []
        for axes, x, y, words_there in self.points:
            left, bottom = axes.transData.transform((x, y))
            placed.append((round(100 * left / width, 2), round(100 - 100 * bottom / height, 2), words_there))
        return placed


def sheet(height: float, title: str, width: float = WIDTH) -> MatplotlibFigure:
    """An empty figure, white, with what to learn from it as its title; no global state is touched."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained", facecolor="white")
    size = 12 if width > COLUMN else 11
    figure.suptitle(_balanced(title, int(122 * width / size)), x=0.01, ha="left", fontsize=size, fontweight="bold")
    return figure


def _balanced(title: str, width: int) -> str:
    """Lines of about equal length, a number never parted from its unit."""
    lines = math.ceil(len(title) / width)
    return textwrap.fill(title.replace(" %", "\u00a0%").replace(" ×", "\u00a0×"), min(width, len(title) // lines + 12),
                         break_on_hyphens=False)


def tidy(axes: Axes, grid: str = "both") -> None:
    """No box, a faint grid behind the data."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, axis=grid, color="#E6E6E6", linewidth=0.7)  # type: ignore[arg-type]
    axes.set_axisbelow(True)


def error_axis(axis: Axis) -> None:
    """Tick labels in percent or powers of ten."""
    from matplotlib.ticker import FuncFormatter

    axis.set_major_formatter(FuncFormatter(lambda value, _: words.error(value) if value >= 1e-4 else _power(value)))
    _quiet(axis)


def time_axis(axis: Axis) -> None:
    """Tick labels with the unit that suits them."""
    from matplotlib.ticker import FuncFormatter

    axis.set_major_formatter(FuncFormatter(
        lambda value, _: words.seconds(value) if value < 1 else f"{words.significant(value)} s"))
    _quiet(axis)


def number_axis(axis: Axis) -> None:
    """Plain numbers with thousands separated."""
    from matplotlib.ticker import FuncFormatter

    axis.set_major_formatter(FuncFormatter(lambda value, _: words.significant(value) if value < 1e6 else _power(value)))
    _quiet(axis)


def error_panel(axes: Axes, gate: float, grid: str = "both") -> None:
    """Axes whose ordinate is a relative error: logarithmic, with the gate drawn in."""
    axes.set_yscale("log")
    gate_line(axes, gate)
    error_axis(axes.yaxis)
    axes.tick_params(labelsize=9)
    tidy(axes, grid)


def spread(axes: Axes, x: np.ndarray, typical: np.ndarray, worst: np.ndarray, style: palette.Style, label: str) -> None:
    """Errors by category: a marker at the largest, a dash at the median, a line between."""
    typical, worst = drawable(typical), drawable(worst)
    axes.vlines(x, typical, worst, color=style.colour, linewidth=1.2)
    axes.plot(x, worst, linestyle="none", marker=style.marker, color=style.colour, markersize=6, label=label)
    axes.plot(x, typical, linestyle="none", marker="_", color=style.colour, markersize=6)


def dodged(count: int, k: int, n: int) -> np.ndarray:
    """Places of the ``k``-th of ``n`` series beside each other at 0, 1, ... ``count`` - 1."""
    return np.arange(count) + 0.7 * ((k + 0.5) / n - 0.5)


def ticks_about_one(low: float, high: float) -> list[float]:
    """Round numbers on a log axis that holds 1, as many as stand apart."""
    chosen = [1.0]
    for tick in (0.5, 2, 0.1, 10, 0.2, 5, 1.5, 0.7, 0.01, 100, 0.9, 1.1, 0.8, 1.2, 3, 0.3, 20, 50, 1000):
        if low <= tick <= high and min(abs(np.log(tick / c)) for c in chosen) > 0.04 * np.log(high / low):
            chosen.append(tick)
    return sorted(chosen)


def _quiet(axis: Axis) -> None:
    from matplotlib.ticker import NullFormatter

    axis.set_minor_formatter(NullFormatter())


def _power(value: float) -> str:
    exponent = round(np.log10(value)) if value > 0 else 0
    return f"10{str(exponent).translate(words.SUPERSCRIPT)}"


def drawable(errors: np.ndarray) -> np.ndarray:
    """Errors as a log axis takes them: zero at `SMALLEST`, infinite ones NaN."""
    errors = np.asarray(errors, dtype=float)
    return np.where(np.isfinite(errors), np.maximum(errors, SMALLEST), np.nan)


def gate_line(axes: Axes, gate: float) -> None:
    """The error that a trustworthy method must not exceed."""
    axes.axhline(gate, color=palette.GATE, linewidth=1.4, linestyle=(0, (6, 3)), zorder=1.5,
                 label=f"gate, {words.error(gate)}")


def mesh_band(axes: Axes, low: float, high: float) -> None:
    """Median to largest difference between this mesh and a finer one."""
    if np.isfinite(low) and np.isfinite(high):
        axes.axhspan(max(low, SMALLEST), max(high, SMALLEST), color=palette.MESH_FLOOR, alpha=0.45, linewidth=0,
                     zorder=0.5, label="this mesh to a finer one")


def legend_below(figure: MatplotlibFigure, axes: list[Axes], columns: int = 5) -> None:
    """One legend for all panels, without repetitions, under the figure."""
    entries: dict[str, Artist] = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries:
        figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns,
                      frameon=False, fontsize=9 if figure.get_figwidth() > COLUMN else 8.5, columnspacing=1.2,
                      handlelength=1.6)
