"""One path of a finger on glass: forces, contact area, tractions along the plate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from matplotlib import colormaps

from rom.reporting.figure import legend_below, sheet, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PROFILES = 5


def draw_path(found: xr.Dataset) -> Figure:
    """Force and area over the plate's displacements, and pressure and shear at some positions.

    Parameters
    ----------
    found : xr.Dataset
        As :func:`rom.finger_on_glass.record.recorded` gives it.
    """
    attrs = found.attrs
    u_n, u_t = 1e3 * found["normal_displacement"].values, 1e3 * found["tangential_displacement"].values
    pressing = u_t == 0
    ended = "" if attrs["complete"] else ", where the path ends early"
    figure = sheet(6.6, f"{attrs['tissue.variant'].capitalize()} fibres: {float(found['normal_force'][-1]):.3g} N and "
                   f"{u_t[-1]:.3g} mm of travel{ended}")
    axes = figure.subplots(2, 2)
    ratio = found["tangential_force"] / found["normal_force"].where(found["normal_force"] > 0)
    area = 1e6 * found["area"].values
    axes[0, 0].plot(u_n[pressing], found["normal_force"].values[pressing], "o-", color="#332288", markersize=3)
    axes[0, 0].set(xlabel="approach of the plate [mm]", ylabel="normal force [N]")
    axes[0, 1].plot(u_t[~pressing], ratio.values[~pressing], "o-", color="#332288", markersize=3,
                    label="tangential over normal force [-]")
    axes[0, 1].plot(u_t[~pressing], area[~pressing] / (area[pressing][-1] if pressing.any() else np.nan), "s-",
                    color="#D55E00", markersize=3, label="contact area over that before sliding [-]")
    axes[0, 1].set(xlabel="travel of the plate [mm]", ylim=(0, None))
    if (~pressing).any():
        axes[0, 1].legend(frameon=False, fontsize=8)
    else:
        axes[0, 1].text(0.5, 0.5, "the plate did not slide", transform=axes[0, 1].transAxes, ha="center")
    start = max(int(pressing.sum()) - 1, 0)
    skin = found["skin"].values
    for k in np.unique(np.linspace(start, len(u_t) - 1, PROFILES).round().astype(int)):
        colour = colormaps["viridis"](0.85 * (k - start) / max(len(u_t) - 1 - start, 1))
        x = 1e3 * (found["node_x"].values + found["displacement"].values[k, :, 0])[skin]
        pressure = found["pressure"].values[k]
        order = np.argsort(x)
        order = order[pressure[order] > 0]
        for panel, name in zip(axes[1], ("pressure", "shear"), strict=True):
            panel.plot(x[order], 1e-3 * found[name].values[k][order], color=colour,
                       label=f"at {u_t[k]:.2g} mm of travel")
    for panel, name in zip(axes[1], ("pressure", "shear on the skin"), strict=True):
        panel.set(xlabel="along the plate, from the bone's middle [mm]", ylabel=f"{name} [kPa]")
    for panel in axes.flat:
        tidy(panel)
    legend_below(figure, [axes[1, 0]])
    return figure
