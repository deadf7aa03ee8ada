"""Mode shapes as pictures: the skin, displaced, coloured by relative displacement or by normal motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rom.reporting.figure import sheet
from rom.reporting.skin import PALMAR, draw_skin

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DRAWN_AS = 2.0
"""Length [mm] to which the largest displacement is drawn."""
ROW = 1.9
"""Height [inches] of one row of shapes."""


@dataclass(frozen=True)
class Shape:
    """One panel: title and displacement (n, 3), largest length 1."""

    title: str
    displacement: np.ndarray


def magnitude_sheet(title: str, position: np.ndarray, quads: np.ndarray, shapes: Sequence[Shape],
                    columns: int = 4, view: tuple[float, float] = PALMAR) -> Figure:
    """Shapes coloured by relative displacement magnitude, in rows.

    Parameters
    ----------
    title : str
    position : (n, 3) ndarray [mm]
        Skin nodes at rest.
    quads : (m, 4) ndarray
        Rows of ``position``.
    shapes : sequence of Shape
    columns : int
    view : (elevation, azimuth) [degree]
    """
    from matplotlib.colors import Normalize

    values = [np.linalg.norm(shape.displacement, axis=1) for shape in shapes]
    return _sheet(title, position, quads, shapes, values, columns, view, "viridis", Normalize(0.0, 1.0),
                  "displacement over the mode's largest [-]")


def normal_sheet(title: str, position: np.ndarray, quads: np.ndarray, normals: np.ndarray, shapes: Sequence[Shape],
                 columns: int = 4, view: tuple[float, float] = PALMAR) -> Figure:
    """The same, coloured by motion along the outward normal (n, 3); signs are arbitrary, contrasts are not."""
    from matplotlib.colors import Normalize

    values = [np.einsum("ij,ij->i", normals, shape.displacement) for shape in shapes]
    return _sheet(title, position, quads, shapes, values, columns, view, "RdBu_r", Normalize(-1.0, 1.0),
                  "outward normal motion over the mode's largest displacement [-]")


def _sheet(title: str, position: np.ndarray, quads: np.ndarray, shapes: Sequence[Shape], values: Sequence[np.ndarray],
           columns: int, view: tuple[float, float], colours: str, norm: Any, label: str) -> Figure:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable

    rows = -(-len(shapes) // columns)
    figure = sheet(ROW * rows + 1.2, title)
    grid = figure.add_gridspec(rows, columns)
    panels = []
    for k, (shape, value) in enumerate(zip(shapes, values, strict=True)):
        panel: Any = figure.add_subplot(grid[divmod(k, columns)], projection="3d")
        colour = colormaps[colours](norm(value[quads].mean(axis=1)))
        draw_skin(panel, position + DRAWN_AS * shape.displacement, quads, colour, view=view)
        panel.set_title(shape.title, fontsize=9.5, y=0.96)
        panels.append(panel)
    bar = figure.colorbar(ScalarMappable(norm, colours), ax=panels, location="bottom", shrink=0.5, aspect=45, pad=0.02)
    bar.set_label(label, fontsize=9)
    bar.ax.tick_params(labelsize=8)
    return figure
