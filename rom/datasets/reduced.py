"""A harmonic dataset stored reduced, as poles and shapes, and read as if it were whole.

Every answer is a sum of shapes that all loads share (natural modes phi_k) and of its own load's (vectors q_lp):

    u = sum_k phi_k b_lk F / (lambda_k (1 + i eta) - omega^2) + sum_p q_lp c_lp F / (1 + i eta - omega^2 theta_lp),

the Galerkin answer of :mod:`rom.fullorder.load_vectors`. The coefficients follow from their poles in closed form, so
the file holds shapes and poles alone: some 400 MB instead of 200 GB, and a case costs one read of its load's shapes.
"""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from rom.datasets.schema import check_schema
from rom.datasets.storage import loaded, open_netcdf, reading
from rom.errors import SchemaError
from rom.fullorder.poles import Poles
from rom.scenes import CaseArrays
from rom.scenes.complex_parts import decode_complex
from rom.scenes.labelled_cases import LoadLabels, numbers
from rom.scenes.labels import positions

SHAPE_DIMS = ("mode", "load", "vector", "dof")
"""Dimensions of the shapes; the attributes ``modes``, ``loads`` ... say how many there must be."""
SMALL = {"mode_shape": ("mode", "dof"), "eigenvalue": ("mode",), "participation": ("load", "mode"),
         "own_theta": ("load", "vector"), "own_share": ("load", "vector"), "node_of_load": ("load",),
         "node_of_dof": ("dof",), "component_of_dof": ("dof",)}
SHAPES = {**SMALL, "own_shape": ("load", "vector", "dof")}
"""Variables that stand for ``displacement``, with their dimensions."""
CHUNK = 1350
"""Cases of one dask chunk, half of one load's (500 MB whole): dask takes microseconds a chunk to find one case,
and puts together no more of it than is asked for."""
BLOCK = 64
"""Cases put together at once."""
MOST_BYTES = 16e9
"""Of fields put together from a reduced file at once."""
STORAGE = "poles and shapes"
"""Attribute ``storage`` of a file that holds no fields."""


def is_reduced(data: xr.Dataset) -> bool:
    """Whether an opened file holds poles and shapes instead of fields."""
    return data.attrs.get("storage") == STORAGE


class ReducedField:
    """The displacement of every case of a reduced file; answers are put together when they are asked for.

    Safe for threads, and for processes too, since it can be pickled.

    Parameters
    ----------
    path : path
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._open()
        data = self.data
        with reading(path):
            check_reduced(data, str(path))
            small = {name: data[name].transpose(*dims).values for name, dims in SMALL.items()}
            column, force = LoadLabels({"load_node": small.pop("node_of_load")}).forces(data)
            frequency, loss_factor = (numbers(data, name, ("case",), unit)
                                      for name, unit in (("frequency", "Hz"), ("loss_factor", "1")))
            node, component = (_places(data, dim, small.pop(f"{dim}_of_dof"), str(path))
                               for dim in ("node", "component"))
        for name, values in {**small, "case": np.stack([frequency, loss_factor, force.sum(axis=1)])}.items():
            if not np.isfinite(values).all() or (name == "eigenvalue" and (values <= 0).any()):
                raise SchemaError(f"{path} holds a value of {name} that cannot be: delete it and make it again")
        if column.shape[1] != 1 or (column < 0).any():
            raise SchemaError(f"{path} holds cases without one force each: delete it and make it again")
        self.n_load, self.n_own, self.n_free = (data.sizes[dim] for dim in ("load", "vector", "dof"))
        self.load, self.force = column[:, 0], force[:, 0]
        self.stiffness = 1.0 + 1j * loss_factor
        self.inertia = (2.0 * np.pi * frequency) ** 2
        self.modes = small["mode_shape"]
        self.eigenvalue, self.participation = small["eigenvalue"], small["participation"]
        self.theta, self.share = small["own_theta"], small["own_share"]
        self.n_node, self.n_component = data.sizes["node"], data.sizes["component"]
        self.free_dof = self.n_component * node + component
        if len(np.unique(self.free_dof)) != self.n_free:
            raise SchemaError(f"{path} names a degree of freedom twice: delete it and make it again")

    def _open(self) -> None:
        # one handle of xarray's own, which shares HDF5's lock with every other reader of this process
        self.data = open_netcdf(self.path)
        self._kept: tuple[int, np.ndarray] | None = None
        self._reading = threading.Lock()

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name not in ("data", "_kept", "_reading")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._open()

    def __len__(self) -> int:
        """Number of cases."""
        return len(self.load)

    def arrays(self, cases) -> CaseArrays:
        """The inputs of the cases (k,)."""
        return CaseArrays(self.load[cases, None], self.force[cases, None], np.sqrt(self.inertia[cases]) / (2 * np.pi),
                          self.stiffness[cases].imag)

    def own_shapes(self, load: int) -> np.ndarray:
        """(p, n_free) ndarray: the shapes of one load alone; the last load's are kept."""
        kept = self._kept
        if kept is None or kept[0] != load:
            with self._reading:
                kept = load, self.data.variables["own_shape"].isel(load=load).transpose("vector", "dof").values
            self._kept = kept
        return kept[1]

    def coefficients(self, cases) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients of the cases' answers.

        Parameters
        ----------
        cases : (k,) ndarray of int

        Returns
        -------
        modal : (k, m) ndarray, complex [m kg^1/2]
        own : (k, p) ndarray, complex [J^1/2]
        """
        load, force = self.load[cases], self.force[cases, None]
        point = self.stiffness[cases, None], self.inertia[cases, None]
        return (Poles.of_modes(self.eigenvalue).at(self.participation[load] * force, *point),
                Poles.of_vectors(self.theta[load]).at(self.share[load] * force, *point))

    def fields(self, cases) -> np.ndarray:
        """(k, n_free) ndarray, complex [m]: displacement of the cases (k,) at the free degrees of freedom."""
        return self.project(None, cases)

    def project(self, vectors: np.ndarray | None, cases=None) -> np.ndarray:
        """(k, r) ndarray, complex: ``u @ vectors`` of the cases, without any whole answer in memory.

        Parameters
        ----------
        vectors : (n_free, r) ndarray
            Orthonormal ones give the cases' coefficients in another basis.
        cases : (k,) ndarray of int, optional
            Default: all.
        """
        cases = np.arange(len(self)) if cases is None else np.asarray(cases)
        modal, own = self.coefficients(cases)
        modes = self.modes if vectors is None else self.modes @ vectors
        out = np.empty((len(cases), modes.shape[1]), dtype=complex)
        for load, group in self._by_load(cases):
            shapes = self.own_shapes(load) if vectors is None else self.own_shapes(load) @ vectors
            for start in range(0, len(group), BLOCK):
                part = group[start:start + BLOCK]
                both = np.concatenate([modal[part].real, modal[part].imag]) @ modes
                both += np.concatenate([own[part].real, own[part].imag]) @ shapes
                if len(part) == len(cases):  # in order: no copy by index
                    out.real, out.imag = both[:len(part)], both[len(part):]
                else:
                    out.real[part], out.imag[part] = both[:len(part)], both[len(part):]
        return out

    def norms(self, cases=None) -> np.ndarray:
        """(k,) ndarray [m]: ``||u||_2`` over the free degrees of freedom."""
        cases = np.arange(len(self)) if cases is None else np.asarray(cases)
        modal, own = self.coefficients(cases)
        out = np.empty(len(cases))
        for load, group in self._by_load(cases):
            # a triangular factor, since a Gram matrix would lose half of the digits
            factor = np.asarray(np.linalg.qr(np.concatenate([self.modes, self.own_shapes(load)]).T, mode="r"))
            out[group] = np.linalg.norm(np.concatenate([modal[group], own[group]], axis=1) @ factor.T, axis=1)
        return out

    def _by_load(self, cases: np.ndarray):
        """Loads and the positions in ``cases`` that name them."""
        load = self.load[cases]
        if len(load) and (load == load[0]).all():
            return [(int(load[0]), np.arange(len(load)))]
        order = np.argsort(load, kind="stable")
        groups = np.split(order, np.flatnonzero(np.diff(load[order])) + 1)
        return [(int(load[group[0]]), group) for group in groups if len(group)]

    def on_all_nodes(self, fields: np.ndarray) -> np.ndarray:
        """(k, n_node, n_component) ndarray: fields (k, n_free) with held nodes at zero."""
        full = np.zeros((len(fields), self.n_component * self.n_node), dtype=fields.dtype)
        full[:, self.free_dof] = fields
        return full.reshape(-1, self.n_node, self.n_component)


class _LazyDisplacement(BackendArray):
    """(case, node, component) array that xarray indexes; nothing is put together but what is asked for."""

    def __init__(self, field: ReducedField) -> None:
        self.field = field
        self.shape = (len(field), field.n_node, field.n_component)
        self.dtype = np.dtype(complex)

    def __getitem__(self, key: indexing.ExplicitIndexer):
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER, self._values)

    def _values(self, key: tuple) -> np.ndarray:
        case, *rest = key
        cases = np.arange(*case.indices(len(self.field))) if isinstance(case, slice) else np.atleast_1d(case)
        values = self.field.on_all_nodes(self.field.fields(cases))
        for axis, part in enumerate(rest, 1):
            values = values[(slice(None),) * axis + (part if np.ndim(part) else slice(part, part + 1)
                                                     if not isinstance(part, slice) else part,)]
        dropped = tuple(i for i, part in enumerate(key) if not isinstance(part, slice) and np.ndim(part) == 0)
        return values.squeeze(axis=dropped) if dropped else values


def check_reduced(data: xr.Dataset, source: str) -> None:
    """Refuse a file that is not ours, not of this version or not reduced; SchemaError naming ``source``."""
    if "schema_version" in data.attrs and not is_reduced(data):
        raise SchemaError(f"{source} is not stored reduced: read it with read_dataset, or make one with "
                          "`rom dataset --whole`")
    check_schema(data.assign(displacement=0), source)  # which the shapes stand for
    missing = [name for name in (*SHAPES, "node", "component", "force_amplitude", "frequency", "loss_factor")
               if name not in data.variables]
    if missing:
        raise SchemaError(f"{source} lacks {', '.join(missing)}: make the dataset again with `rom dataset`")
    for dim in SHAPE_DIMS:
        if data.sizes[dim] != data.attrs.get(f"{dim}s"):
            raise SchemaError(f"{source} holds {data.sizes[dim]} {dim}s of the {data.attrs.get(f'{dim}s')} that its "
                              "answers are made of: make the dataset again with `rom dataset`")


def _places(data: xr.Dataset, dim: str, labels: np.ndarray, source: str) -> np.ndarray:
    """Where labels stand along a dimension of the file."""
    order = positions(np.atleast_1d(data[dim].values), labels, dim, source)
    return np.arange(len(labels)) if order is None else order


def open_dataset(path: str | Path, chunks: int | None = CHUNK) -> xr.Dataset:
    """Open a dataset of the schema lazily, stored whole or reduced: both look alike.

    Parameters
    ----------
    path : path
    chunks : int, optional
        Cases of one dask chunk. None, for a reduced file alone, gives an array that xarray itself reads lazily: the
        better choice where scattered cases are picked, since no chunk is put together for one case of it.

    Returns
    -------
    xr.Dataset
        With ``displacement`` (case, node, component) [m], complex in harmonic scenes.

    Raises
    ------
    SchemaError
        Where the file is missing, truncated, foreign or of another schema version.
    """
    with open_netcdf(path) as data:
        reduced = is_reduced(data)
    if not reduced:
        data = open_netcdf(path)
        check_schema(data, str(path))
        return decode_complex(data.chunk({"case": chunks or CHUNK}))
    field = ReducedField(path)
    data = field.data
    attributes = {"long_name": data["own_shape"].attrs["displacement_name"], "units": "m", "mesh": "mesh",
                  "location": "node"}
    whole = data.drop_vars(list(SHAPES))
    variable = xr.Variable(("case", "node", "component"), indexing.LazilyIndexedArray(_LazyDisplacement(field)),
                           attributes)
    whole["displacement"] = variable if chunks is None else variable.chunk(
        {"case": chunks, "node": -1, "component": -1})
    whole.set_close(data.close)
    return whole


def read_dataset(path: str | Path, cases=None) -> xr.Dataset:
    """Read a dataset of the schema, stored whole or reduced, or only the cases selected by integers, a slice or a mask.

    Raises
    ------
    SchemaError
        Where the file is missing, damaged, foreign or of another schema version.
    ValueError
        Where a reduced file would fill more than :data:`MOST_BYTES` of memory.
    """
    with open_netcdf(path) as data:
        if not is_reduced(data):
            check_schema(data, str(path))
            return loaded(data if cases is None else data.isel(case=cases), path)
    with open_dataset(path, chunks=None) as data:
        wanted = data if cases is None else data.isel(case=cases)
        size = wanted["displacement"].nbytes
        if size > MOST_BYTES:
            raise ValueError(f"{wanted.sizes['case']} cases of {path} fill {size / 1e9:.0f} GB: name fewer, or take "
                             "rom.datasets.open_dataset, which reads what is asked for")
        with reading(path):
            return wanted.load()
