"""Every method at stiff and extreme cases, pushed until something breaks: who is right, who warns, who lies?"""

from __future__ import annotations

import script
import xarray as xr

from rom.reporting.stability import draw, findings, tables
from rom.stability import atlas


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """Where does each method break, and does it say so?"""
    return atlas(quick=quick, progress=progress)


if __name__ == "__main__":
    script.run(main, draw, findings, "stability", tables=tables)
