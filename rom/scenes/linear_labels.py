"""Cases of a linear scene: labelled ones checked and turned into plain arrays, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from rom.scenes.cases import NO_FORCE, NO_WORD, CaseArrays, check_shapes, finite
from rom.scenes.question import PHASE

if TYPE_CHECKING:
    from rom.scenes.linear_scene import LinearScene


def read_cases(scene: LinearScene, cases: xr.Dataset) -> CaseArrays:
    """See `Scene.read`."""
    if isinstance(cases, xr.Dataset):
        scene.check_origin(cases, "the batch of cases", required=False)
    loads, points = check_shapes(cases, scene.name, tuple(one.name for one in scene.inputs if "force" in one.dims),
                                 tuple(one.name for one in scene.asked.points),
                                 {one.name: one.default for one in scene.inputs if one.default is not None})
    column = scene.load_labels.columns(loads)
    present = column != NO_FORCE
    if not present.any(axis=1).all():
        raise ValueError(f"case {int(np.argmin(present.any(axis=1)))} has no force: give at least one load")
    force = finite(loads["force_amplitude"], "force_amplitude", "N")
    if scene.asked.phases:
        force = force * np.exp(1j * finite(loads["force_phase"], "force_phase", "rad"))
    for one in scene.asked.points:
        points[one.name] = finite(points[one.name], one.name, one.unit)
        if (points[one.name] < 0).any():
            raise ValueError(f"{one.name} {points[one.name].min():g} is negative: give zero or more")
    return CaseArrays(np.where(present, column, 0), np.where(present, force, 0.0), **points)


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
