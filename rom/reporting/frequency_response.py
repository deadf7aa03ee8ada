"""A frequency response as a picture: receptance and phase over frequency, a colour a direction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from rom.reporting import words
from rom.reporting.figure import legend_below, number_axis, sheet, tidy
from rom.vibration.resonance import highest_peak

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {"normal": "#332288", "radial-ulnar": "#CC6677", "distal-proximal": "#117733"}


def draw_response(found: xr.Dataset) -> Figure:
    """Receptances above, driving-point phase below.

    Parameters
    ----------
    found : xr.Dataset
        As `rom.vibration.frequency_response.frequency_response` returns it.
    """
    f = found["frequency"].values
    tops = {str(name): highest_peak(f, abs(found["receptance"].sel(direction=name, measure="excitation")))
            for name in found["direction"].values}
    listed = [f"{peak.frequency:.1f} Hz ({name})" for name, peak in tops.items() if peak is not None]
    figure = sheet(6.2, f"The loaded patch resonates at {words.listed(listed)}" if listed else
                   "The loaded patch has no resonance within the sweep", width=8.0)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for name in tops:
        one = found.sel(direction=name)
        for measure, line, text in (("excitation", (0, (4, 2)), "loaded nodes"), ("whole", "-", "all moving nodes")):
            above.semilogy(f, 1e6 * abs(one["receptance"].sel(measure=measure)), color=COLOURS[name], linestyle=line,
                           marker="." if len(f) == 1 else None, label=f"{name}, {text}")
        below.plot(f, np.degrees(np.unwrap(np.angle(one["driving_point_receptance"]))), color=COLOURS[name],
                   marker="." if len(f) == 1 else None)
    for panel in (above, below):
        tidy(panel)
    number_axis(above.yaxis)
    above.set_ylabel("mean displacement\nover force [µm/N]")
    below.set_ylabel("phase of the\nloaded nodes [degree]")
    below.set_xlabel("frequency [Hz]")
    legend_below(figure, [above], columns=3)
    return figure
