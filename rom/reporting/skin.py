"""The fingertip's skin as a picture: quadrilaterals in three dimensions, coloured, seen without perspective."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

PALMAR = (-42.0, -78.0)
"""Elevation and azimuth [degree] from below, so that the pad (z < 0) is seen, the tip to the right."""
DORSAL = (38.0, -60.0)
"""From above and beside: the nail, the tip to the right."""
TIP = (-15.0, -20.0)
"""Towards the tip, a little from below."""


def draw_skin(
    axes: Any,
    shape: np.ndarray,
    quads: np.ndarray,
    colours: np.ndarray,
    *,
    view: tuple[float, float] = PALMAR,
    marks: np.ndarray | None = None,
    edge: str = "#00000030",
) -> Poly3DCollection:
    """Draw the skin on axes of `projection="3d"`.

    Parameters
    ----------
    axes : Axes3D
        Its box and limits are fitted to the shape, its frame is taken away.
    shape : (n, 3) ndarray [mm]
        Positions of the skin's nodes, displaced already.
    quads : (m, 4) ndarray
        Rows of ``shape``.
    colours : (m, 4) ndarray
        One colour (RGBA) a quadrilateral.
    view : (elevation, azimuth) [degree]
    marks : (k,) ndarray, optional
        Rows of ``shape`` that get a black dot, such as loaded nodes.
    edge : colour
        Of the mesh lines.

    Returns
    -------
    Poly3DCollection
        The surface, for an animation to change.
    """
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    surface = Poly3DCollection(shape[quads], facecolors=colours, edgecolors=edge, linewidths=0.2, clip_on=False)
    axes.add_collection3d(surface)
    dots = axes.plot(*shape[[] if marks is None else marks].T, "o", color="black", markeredgecolor="white",
                     markersize=6, zorder=1e6, clip_on=False)
    for drawn in (surface, *dots):
        drawn.set_in_layout(False)
    low, high = shape.min(axis=0), shape.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=1.45)
    axes.set_proj_type("ortho")
    axes.computed_zorder = False
    axes.view_init(*view)
    axes.set_axis_off()
    return surface
