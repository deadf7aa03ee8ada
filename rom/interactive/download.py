"""The field of a state as a file: VTK's unstructured grid, or netCDF of the datasets' schema."""

from __future__ import annotations

import tempfile
from pathlib import Path

from rom.datasets.schema import dataset_attributes, mesh_variables
from rom.datasets.storage import write_dataset
from rom.datasets.vtu import write_vtu
from rom.interactive.engine import Answer, Engine
from rom.interactive.state import State
from rom.provenance import stamp

FORMATS = {"field.vtu": "application/octet-stream", "field.nc": "application/x-netcdf"}
"""Names under which a field is saved, and their media types."""


def field_file(engine: Engine, state: State, answer: Answer, name: str) -> bytes:
    """The field of a state as the content of a file.

    Parameters
    ----------
    engine : Engine
    state : State
    answer : Answer
        To that state.
    name : str
        One of :data:`FORMATS`.

    Returns
    -------
    bytes
        ``field.nc`` is read back by :func:`rom.datasets.read_dataset`.
    """
    with tempfile.TemporaryDirectory(prefix="rom-field-") as folder:
        path = Path(folder) / name
        if name == "field.vtu":
            write_vtu(path, engine.tip.mesh, {"displacement_m": engine.on_nodes(answer.values)})
        else:
            scene = engine.scene(state)
            cases = scene.cases_from(engine.cases(state, scene))
            data = scene.label(cases, answer.values[None], "field").assign(mesh_variables(scene.grid))
            data.attrs = {**dataset_attributes(scene), "method": state.method, "state": state.to_query(), **stamp()}
            write_dataset(data, path, compress=True)
        return path.read_bytes()
