"""Every variable of the study of one scene."""

from __future__ import annotations

from collections.abc import Callable

import xarray as xr

from full_scale import fewer_snapshots, harmonic, static
from full_scale.contenders import Contenders


def full_scale(contenders: Contenders, progress: Callable) -> xr.Dataset:
    """Errors over the whole population, by what cases have in common, and with fewer snapshots.

    Parameters
    ----------
    contenders : Contenders
    progress : callable
        ``progress(items, title)`` shows a bar.
    """
    study = harmonic.study if contenders.scene.harmonic else static.study
    found = study(contenders, progress)
    contenders.truth.forget()
    return found.merge(fewer_snapshots.study(contenders, progress))
