"""Fields on the hexahedral mesh as VTK's unstructured grid (.vtu), for ParaView and its like.

VTK knows no complex numbers, so a complex field becomes NAME_real, NAME_imag and NAME_magnitude; the field at a phase
theta of the cycle is NAME_real cos(theta) - NAME_imag sin(theta), one line in ParaView's calculator.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from rom.files import whole_file
from rom.fingertip.mesh import FingertipMesh

TISSUE = "tissue"
"""Name of the cell data that every file carries: indices into `rom.fingertip.anatomy.TISSUES`."""
MOST_COMPONENTS = 9  # a full tensor


def write_vtu(
    path: str | Path,
    mesh: FingertipMesh,
    point_data: Mapping[str, ArrayLike],
    cell_data: Mapping[str, ArrayLike] | None = None,
) -> Path:
    """Write fields on a mesh as a compressed binary .vtu file, whole or not at all.

    Parameters
    ----------
    path : str or Path
        Ends in ``.vtu``, by which ParaView knows it.
    mesh : FingertipMesh
    point_data : mapping of str to (n_node,) or (n_node, k) array_like
        Real or complex; (n_node, 3) is shown as a vector. Units belong into the name.
    cell_data : mapping of str to (n_element,) or (n_element, k) array_like, optional
        Real or complex. The tissue ids are always there, as ``tissue``.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    ValueError
        For another ending, a wrong length, values that are not finite numbers, or a name that is taken.
    OSError
        Where the file cannot be written.

    Notes
    -----
    The magnitude of a complex vector is the length of its amplitude, ``sqrt(sum |u_i|^2)``.
    """
    import meshio

    path = Path(path)
    if path.suffix != ".vtu":
        raise ValueError(f"The file is called {path.name!r}, but viewers go by a file's ending: end it in .vtu.")
    points = _arrays(point_data, mesh.n_nodes, "node")
    cells = {TISSUE: mesh.tissue.astype(np.int32)}
    for name, values in _arrays(cell_data or {}, len(mesh.hexahedra), "element").items():
        _add(cells, name, values)
    grid = meshio.Mesh(mesh.nodes, [("hexahedron", mesh.hexahedra)], point_data=points,
                       cell_data={name: [values] for name, values in cells.items()})
    with whole_file(path) as temporary:
        meshio.write(temporary, grid, file_format="vtu", binary=True, compression="zlib")
    return path


def _arrays(data: Mapping[str, ArrayLike], count: int, place: str) -> dict[str, np.ndarray]:
    """What VTK can hold of the fields, checked."""
    found: dict[str, np.ndarray] = {}
    for name, given in data.items():
        values = np.asarray(given)
        if values.ndim not in (1, 2) or len(values) != count or (values.ndim == 2 and not _fits(values.shape[1])):
            raise ValueError(f"{name} has the shape {values.shape}, but a field needs one row for each {place}: give "
                             f"({count},) or ({count}, k) with k from 1 to {MOST_COMPONENTS}.")
        if values.dtype.kind not in "buifc":
            raise ValueError(f"{name} is of type {values.dtype}, but only numbers can be written: convert it.")
        bad = np.argwhere(~np.isfinite(values))
        if len(bad):
            raise ValueError(f"{name} holds {values[tuple(bad[0])]} at {place} {bad[0][0]}, but every value must be "
                             "finite: mend or leave out that field.")
        if values.dtype.kind == "c":
            size = np.abs(values)
            _add(found, f"{name}_real", values.real)
            _add(found, f"{name}_imag", values.imag)
            _add(found, f"{name}_magnitude", size if values.ndim == 1 else np.linalg.norm(size, axis=1))
        else:
            _add(found, name, values)
    return found


def _fits(components: int) -> bool:
    return 1 <= components <= MOST_COMPONENTS


def _add(found: dict[str, np.ndarray], name: str, values: np.ndarray) -> None:
    if name in found:
        raise ValueError(f"Two fields would be called {name!r}, but names must differ: rename one of them.")
    if values.dtype.kind == "b" or values.dtype == np.float16:  # types that VTK does not know
        values = values.astype(np.uint8 if values.dtype.kind == "b" else np.float32)
    elif values.dtype == np.longdouble:
        values = values.astype(np.float64)
    found[name] = np.ascontiguousarray(values)
