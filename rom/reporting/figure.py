"""What every figure shares: a file name, words for the page, fonts and log axes that people can read."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rom.datasets.storage import whole_file
from rom.reporting import palette, words

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure as MatplotlibFigure

DPI = 150
WIDTH = 10.0
"""Inches; 1,500 pixels, shown at about 1,000."""
SMALLEST = 1e-16
"""Errors below this, exact zeros among them, are drawn here."""


@dataclass(frozen=True)
class Figure:
    """A figure with the words that stand by it on the page."""

    file: str
    figure: MatplotlibFigure
    caption: str
    alt: str

    def write(self, folder: Path) -> None:
        """Save as PNG, whole or not at all."""
        with whole_file(folder / self.file) as temporary:
            self.figure.savefig(temporary, format="png", dpi=DPI, metadata={"Software": None})


def sheet(height: float, title: str, width: float = WIDTH) -> MatplotlibFigure:
    """An empty figure, white, with what to learn from it as its title; no global state is touched."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained", facecolor="white")
    figure.suptitle(_balanced(title, int(10.2 * width)), x=0.01, ha="left", fontsize=12, fontweight="bold")
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
    """Median to maximum difference between this mesh and a finer one."""
    if np.isfinite(low) and np.isfinite(high):
        axes.axhspan(max(low, SMALLEST), max(high, SMALLEST), color=palette.MESH_FLOOR, alpha=0.45, linewidth=0,
                     zorder=0.5, label="this mesh to a finer one, median to maximum")


def legend_below(figure: MatplotlibFigure, axes: list[Axes], columns: int = 5) -> None:
    """One legend for all panels, without repetitions, under the figure."""
    entries: dict[str, Artist] = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries:
        figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns,
                      frameon=False, fontsize=9)
