"""One cycle of free or forced vibrations as a GIF: panels side by side, in step although their frequencies differ.

A free mode moves as u sin(omega t); a forced vibration of complex amplitude u as Re(u exp(i omega t)), the force at
its largest in the first frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rom.files import whole_file
from rom.reporting.fields import length_unit, magnitude
from rom.reporting.figure import Figure, sheet
from rom.reporting.skin import PALMAR, draw_skin
from rom.reporting.words import significant

if TYPE_CHECKING:
    from PIL.Image import Image

DRAWN_AS = 1.6
"""Length [mm] to which the largest displacement amplitude of each panel is drawn."""
DPI = 100
COLOURS = "viridis"


@dataclass(frozen=True, eq=False)
class Vibration:
    """The skin's motion in one mode or forced case.

    Parameters
    ----------
    title : str
        Such as "Mode 1, 122.4 Hz".
    displacement : (n_skin, 3) ndarray
        Real: the shape of a free mode, in any unit. Complex: the amplitude of a forced vibration [m].
    group : str
        Heading under which a list shows it.

    Raises
    ------
    ValueError
        For another shape, values that are not finite, or no displacement at all.
    """

    title: str
    displacement: np.ndarray
    group: str = ""

    def __post_init__(self) -> None:
        u = np.asarray(self.displacement)
        if u.ndim != 2 or u.shape[1] != 3:
            raise ValueError(f"The displacement of {self.title!r} has the shape {u.shape}, but it must be (n_skin, 3): "
                             "give three components a skin node.")
        if not np.isfinite(u).all():
            raise ValueError(f"The displacement of {self.title!r} is not finite everywhere: leave this one out.")
        if not np.any(u):
            raise ValueError(f"The displacement of {self.title!r} is zero, so nothing can be drawn: leave it out.")

    @property
    def forced(self) -> bool:
        """Whether the displacement has a size, not only a shape."""
        return np.iscomplexobj(self.displacement)

    @property
    def amplitude(self) -> np.ndarray:
        """(n_skin, 3) ndarray of complex: c of Re(c exp(i omega t)); for u sin(omega t) it is -i u."""
        return self.displacement if self.forced else -1j * self.displacement

    @property
    def size(self) -> np.ndarray:
        """(n_skin,) ndarray: length of the amplitude at each node."""
        return magnitude(self.displacement)

    def at(self, phase: float) -> np.ndarray:
        """(n_skin, 3) ndarray: displacement at a phase of the cycle [rad]."""
        return (self.amplitude * np.exp(1j * phase)).real

    @property
    def note(self) -> str:
        """How large the largest displacement amplitude is, and how much it is exaggerated."""
        if not self.forced:
            return ""
        largest = float(self.size.max())
        unit, factor = length_unit(largest)
        return f"{significant(largest * factor, 2)} {unit}, drawn ×{significant(DRAWN_AS * 1e-3 / largest, 2)}"


@dataclass(frozen=True)
class Film(Figure):
    """A figure that moves: written as an endless GIF of one cycle, shown on a page as other figures are."""

    show: Callable[[float], None]
    """Moves the figure to a phase of the cycle [rad]."""
    frames: int
    seconds: float

    def write(self, folder: Path) -> None:
        """Save as GIF, whole or not at all, all frames in one palette: no colour flickers."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from PIL import Image

        canvas = FigureCanvasAgg(self.figure)
        self.figure.set_dpi(DPI)
        canvas.draw()
        self.figure.set_layout_engine("none")  # as the first drawing has laid it out: panels must not move
        palette, pictures = _palette(), []
        for phase in 2 * np.pi * np.arange(self.frames) / self.frames:
            self.show(phase)
            canvas.draw()
            picture = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
            pictures.append(picture.quantize(palette=palette, dither=Image.Dither.NONE))
        with whole_file(folder / self.file) as temporary:
            pictures[0].save(temporary, format="GIF", save_all=True, append_images=pictures[1:], loop=0,
                             optimize=False, duration=max(20, round(1000 * self.seconds / self.frames)))


def film(
    file: str,
    position: np.ndarray,
    quads: np.ndarray,
    vibrations: Sequence[Vibration],
    *,
    title: str,
    caption: str = "",
    alt: str = "",
    columns: int = 4,
    frames: int = 20,
    seconds: float = 1.6,
    view: tuple[float, float] = PALMAR,
    panel: tuple[float, float] = (2.4, 1.75),
) -> Film:
    """One cycle of several vibrations side by side, each to its own scale, coloured by its own amplitude.

    Parameters
    ----------
    file : str
        Name of the GIF, which `Film.write` puts into a folder.
    position : (n_skin, 3) ndarray [mm]
        Of the skin's nodes at rest.
    quads : (m, 4) ndarray
        Rows of ``position``.
    vibrations : sequence of Vibration
        One panel each, row by row.
    title, caption, alt : str
    columns, frames : int
    seconds : float [s]
        How long one cycle is shown.
    view : (elevation, azimuth) [degree]
    panel : (width, height) [inch]

    Returns
    -------
    Film

    Raises
    ------
    ValueError
        For no vibration, fewer than three frames, or displacements of another number of nodes.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable

    check(position, vibrations)
    if frames < 3:
        raise ValueError(f"frames={frames} is too few to show a motion: take three or more, 20 look smooth.")
    columns = min(columns, len(vibrations))
    rows = -(-len(vibrations) // columns)
    width = max(panel[0] * columns, 4.8)  # room for the colour bar's words
    figure = sheet(panel[1] * rows + 1.1, title, width=width)
    panels = figure.subplots(rows, columns, squeeze=False, subplot_kw={"projection": "3d"}).ravel()
    surfaces = []
    for axes, one in zip(panels, vibrations, strict=False):
        colour = colormaps[COLOURS](one.size[quads].mean(axis=1) / one.size.max())
        surfaces.append(draw_skin(axes, position, quads, colour, view=view))
        axes.set_title(one.title + (f"\n{one.note}" if one.note else ""), fontsize=9, y=0.95)
    for axes in panels[len(vibrations):]:
        axes.set_axis_off()
    figure.colorbar(ScalarMappable(cmap=COLOURS), ax=list(panels), location="bottom", aspect=60, fraction=0.03,
                    pad=0.02, shrink=min(1.0, 6 / width)).set_label(
        "displacement amplitude / its largest in the panel [-]", fontsize=9)

    def show(phase: float) -> None:
        for surface, one in zip(surfaces, vibrations, strict=True):
            surface.set_verts((position + one.at(phase) * DRAWN_AS / one.size.max())[quads])

    return Film(file, figure, caption, alt, show, frames, seconds)


def _palette() -> Image:
    """Colours of the skin, the same under mesh lines, and greys for text: few, so that files are small."""
    from matplotlib import colormaps
    from PIL import Image

    colours = colormaps[COLOURS](np.linspace(0, 1, 32))[:, :3]
    greys = np.repeat(np.linspace(0, 1, 12)[:, None], 3, axis=1)
    levels = np.rint(255 * np.concatenate([colours, 0.81 * colours, greys])).astype(np.uint8)
    palette = Image.new("P", (1, 1))
    palette.putpalette(levels.tobytes())
    return palette


def check(position: np.ndarray, vibrations: Sequence[Vibration]) -> None:
    """Raise ValueError unless there are vibrations, all of this skin's nodes."""
    if not vibrations:
        raise ValueError("There is no vibration to draw: give at least one.")
    for one in vibrations:
        if len(one.displacement) != len(position):
            raise ValueError(f"The displacement of {one.title!r} has {len(one.displacement)} nodes and the skin "
                             f"{len(position)}: both must describe the same nodes.")
