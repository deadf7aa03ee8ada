"""Cases of a linear scene: labelled ones checked and turned into plain arrays, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from rom.scenes.cases import NO_FORCE, NO_WORD, CaseArrays, finite
from rom.scenes.labelled_cases import check_cases, numbers
from rom.scenes.question import PHASE

if TYPE_CHECKING:
    from rom.scenes.linear_scene import LinearScene


def read_cases(scene: LinearScene, cases: xr.Dataset) -> CaseArrays:
    """See `Scene.read`."""
    check_cases(cases, scene.name, [one.name for one in scene.inputs if one.default is None],
                [one.name for one in scene.inputs if one.default is not None])
    scene.check_origin(cases, "the batch of cases", required=False)
    column, force = scene.load_labels.forces(cases, unit=scene.asked.amplitude.unit)
    present = column != NO_FORCE
    if not present.any(axis=1).all():
        raise ValueError(f"case {int(np.argmin(present.any(axis=1)))} has no force: give at least one load")
    force = finite(force, "force_amplitude", "N")
    if scene.asked.phases:
        phase = numbers(cases, PHASE.name, PHASE.dims, PHASE.unit, PHASE.default)
        force = force * np.exp(1j * finite(np.where(present, phase, 0.0), PHASE.name, PHASE.unit))
    points = {}
    for one in scene.asked.points:
        points[one.name] = finite(numbers(cases, one.name, one.dims, one.unit, one.default), one.name, one.unit)
        if (points[one.name] < 0).any():
            raise ValueError(f"{one.name} {points[one.name].min():g} is negative: give zero or more")
    return CaseArrays(np.where(present, column, 0), force, **points)


def label_cases(scene: LinearScene, cases: CaseArrays) -> xr.Dataset:
    """See `Scene.cases_from`."""
    present = cases.force != 0.0
    data: dict[str, Any] = {}
    for one in scene.asked.loads:
        values = scene.loads.labels[one.name]
        words = values.dtype.kind in "UO"
        shown = np.where(present, values[cases.node], NO_WORD if words else NO_FORCE)
        data[one.name] = (one.dims, shown if words else shown.astype(np.int32), {
            **one.attributes, **({} if words else {"missing_force": NO_FORCE})})
    data["force_amplitude"] = (("case", "force"), np.abs(cases.force) if scene.asked.phases else cases.force,
                               scene.asked.amplitude.attributes)
    if scene.asked.phases:
        data["force_phase"] = (PHASE.dims, np.angle(cases.force), PHASE.attributes)
    for one in scene.asked.points:
        data[one.name] = ("case", getattr(cases, one.name), one.attributes)
    return xr.Dataset(data, coords={"case": ("case", np.arange(len(cases)), {"long_name": "case", "units": "1"})},
                      attrs={"scene": scene.name, "scene_hash": scene.content_hash})
