"""A lookup table: responses of every load on a grid of frequency and loss factor, interpolated between.

Two ways of interpolating from the same 2 x 2 or 4 x 4 neighbours:

- in (f, eta): the tensor product of Lagrange polynomials, linear or cubic in each;
- in s: with K* = K (1 + i eta) the response times 1 + i eta is an analytic function of the one complex number
  s = omega^2 / (1 + i eta), so that the complex Lagrange polynomial through all neighbours, of degree 3 or 15, serves.

A table of whole fields would fill gigabytes (:attr:`LookupTable.table_bytes`). What is held are coordinates in the
shapes that make its entries, which all entries of a load share: interpolating those gives the same answers.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import xarray as xr

from rom.metamodels.basis import Basis, check_precision, combine
from rom.metamodels.facts import Curve, Needs
from rom.metamodels.linear import not_harmonic
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.modal import ModalKrylov
from rom.metamodels.stored import Stored
from rom.metamodels.validity import joined
from rom.scenes import CaseArrays, LinearScene, Scene

NEIGHBOURS = {"linear": 2, "cubic": 4}
VARIABLES = ("point", "s")


class LookupTable(Metamodel):
    """Interpolation between responses at grid points.

    Parameters
    ----------
    frequencies, loss_factors : int
        Equidistant grid points over the published ranges.
    interpolation : {"linear", "cubic"}
        From two or four neighbours in each direction.
    variable : {"point", "s"}
        Interpolate in (f, eta), or in s.
    modes, vectors : int
        Of the `modal-krylov` model that fills the table; its error is far below that of the interpolation.
    precision : {"float64", "float32"}
        Of the stored shapes.
    """

    name: ClassVar[str] = "lookup-table"
    summary: ClassVar[str] = "interpolates between stored responses on a grid of frequency and loss factor"
    colour: ClassVar[str] = "#0072B2"
    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("_shapes", ("mode", "dof"), "shape that all loads share"),
        Stored("_own", ("load", "vector", "dof"), "shape of one load alone"),
        Stored("_table", ("load", "point", "coordinate"), "coordinates of the response to a unit load in its shapes"))
    _shapes: Basis
    _own: Basis

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        reason = not_harmonic(scene, "has nothing to interpolate over: a table of unit responses is `superposition`",
                              "a path has a history: what is tabulated there are whole paths, by `interpolation`")
        if reason is not None:
            return reason
        low, high = scene.input("loss_factor").range or (0.0, 0.0)
        return None if high > low else "a table needs a range of loss factors, and this scene has one alone"

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        coarse, fine = {"frequencies": 31, "loss_factors": 5}, {"frequencies": 61, "loss_factors": 9}
        linear, cubic = {"interpolation": "linear"}, {"interpolation": "cubic"}
        return Curve(({**coarse, **linear}, {**fine, **linear}, {**coarse, **cubic}, {**fine, **cubic},
                      {**coarse, **linear, "variable": "s"}, {**coarse, **cubic, "variable": "s"}), headline=3)

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"frequencies": 31, "loss_factors": 5, "modes": 20, "vectors": 4},))

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(modes=True, responses=True)

    def __init__(self, scene: LinearScene, frequencies: int = 61, loss_factors: int = 9, interpolation: str = "cubic",
                 variable: str = "point", modes: int = 40, vectors: int = 6, precision: str = "float64") -> None:
        if interpolation not in NEIGHBOURS or variable not in VARIABLES:
            raise ValueError(f"interpolation={interpolation!r} in variable={variable!r} is unknown: choose one of "
                             f"{', '.join(NEIGHBOURS)} in one of {', '.join(VARIABLES)}")
        least = NEIGHBOURS[interpolation]
        if not min(frequencies, loss_factors) >= least:
            raise ValueError(f"a grid of {frequencies} frequencies by {loss_factors} loss factors is too small: "
                             f"{interpolation} interpolation needs {least} of each")
        super().__init__(scene, frequencies=frequencies, loss_factors=loss_factors, interpolation=interpolation,
                         variable=variable, modes=modes, vectors=vectors, precision=check_precision(precision))

    @property
    def n_vectors(self) -> int:
        """Load-dependent vectors of each load."""
        return self.settings["vectors"]

    @property
    def table_bytes(self) -> int:
        """Memory of the same table with a whole complex field in each entry [byte]."""
        points = self.settings["frequencies"] * self.settings["loss_factors"]
        return 2 * self._shapes.field[0].nbytes * self.scene.n_loads * points

    @property
    def model_bytes(self) -> int:
        return self._shapes.nbytes + self._own.nbytes + self._table.nbytes

    @property
    def online_bytes(self) -> int:
        return self._shapes.field.nbytes + self._own.field[0].nbytes + 2 * self._shapes.field[0].nbytes

    def reasons(self, cases: CaseArrays) -> np.ndarray:
        found = np.full(len(cases), "")
        for name, unit, values, grid in (("frequency", " Hz", cases.frequency, self._frequency),
                                         ("loss factor", "", cases.loss_factor, self._loss_factor)):
            slack = 1e-9 * grid[-1]
            outside = (values < grid[0] - slack) | (values > grid[-1] + slack)
            text = f"{name} outside the {grid[0]:g} to {grid[-1]:g}{unit} of the table"
            found = joined(found, np.where(outside, text, ""))
        return found

    # ---- the table ------------------------------------------------------------------------------------------

    def _fit(self, train: xr.Dataset | None) -> None:
        made = ModalKrylov(self.scene, self.settings["modes"], self.settings["vectors"], self.settings["precision"])
        made.fit()
        self._shapes, self._own = made.shapes, made.own_shapes
        self._grid()
        frequency, loss_factor = (a.ravel() for a in np.meshgrid(self._frequency, self._loss_factor, indexing="ij"))
        one = np.ones((len(frequency), 1))
        table = []
        for load in range(self.scene.n_loads):
            cases = CaseArrays(np.full(one.shape, load), one, frequency, loss_factor)
            stiffness, inertia = 1.0 + 1j * loss_factor[:, None], (2.0 * np.pi * frequency[:, None]) ** 2
            own = made.own_coordinates(cases.node[:, 0], one[:, 0], stiffness, inertia)
            table.append(np.concatenate([made.coordinates(cases), own], axis=1))
        self._table = np.stack(table)

    def _grid(self) -> None:
        self._frequency, self._loss_factor = (
            np.linspace(*self.scene.input(name).range, self.settings[count])
            for name, count in (("frequency", "frequencies"), ("loss_factor", "loss_factors")))

    def _weights(self, cases: CaseArrays) -> tuple[np.ndarray, np.ndarray]:
        """Positions of the neighbours in the table and their weights, both (n_case, q^2)."""
        q = NEIGHBOURS[self.settings["interpolation"]]
        i, f = _stencil(cases.frequency, self._frequency, q), _stencil(cases.loss_factor, self._loss_factor, q)
        place = (i[:, :, None] * len(self._loss_factor) + f[:, None, :]).reshape(len(cases), -1)
        if self.settings["variable"] == "point":
            along = lagrange(cases.frequency, self._frequency[i])
            across = lagrange(cases.loss_factor, self._loss_factor[f])
            return place, (along[:, :, None] * across[:, None, :]).reshape(len(cases), -1)
        # from here on the entries count with their factors 1 + i eta
        complex_stiffness = 1.0 + 1j * np.tile(self._loss_factor, len(self._frequency))
        s = np.repeat(self._frequency ** 2, len(self._loss_factor)) / complex_stiffness
        wanted = 1.0 + 1j * cases.loss_factor
        weights = lagrange(cases.frequency ** 2 / wanted, s[place])
        return place, weights * complex_stiffness[place] / wanted[:, None]

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        shapes, own = self._shapes.rows(outputs), self._own.rows(outputs)
        place, weights = self._weights(cases)
        m = len(shapes)
        modal = np.zeros((len(cases), m), dtype=complex)
        own_coordinates = np.empty((*cases.node.shape, own.shape[1]), dtype=complex)
        for j in range(cases.node.shape[1]):
            node = cases.node[:, j]
            found = np.einsum("cq,cqk->ck", weights * cases.force[:, j:j + 1], self._table[node[:, None], place])
            modal += found[:, :m]
            own_coordinates[:, j] = found[:, m:]
        out = combine(modal, shapes, out)
        for load in np.unique(cases.node):
            where = np.argwhere(cases.node == load)
            values = combine(own_coordinates[where[:, 0], where[:, 1]], own[load])
            for row, field in zip(where[:, 0], values, strict=True):  # one case may name a load twice
                out[row] += field
        return out

    def _restored(self, data: xr.Dataset) -> None:
        self._grid()


def _stencil(values: np.ndarray, grid: np.ndarray, q: int) -> np.ndarray:
    """(n, q) ndarray of int: the q neighbours of each value on an equidistant grid, fewer on one side at its ends."""
    cell = np.floor((values - grid[0]) / (grid[1] - grid[0])).astype(int)
    return np.clip(cell - q // 2 + 1, 0, len(grid) - q)[:, None] + np.arange(q)


def lagrange(x: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """(n, q) ndarray: values at ``x`` (n,) of the Lagrange polynomials on ``nodes`` (n, q), real or complex."""
    q = nodes.shape[1]
    difference = nodes[:, :, None] - nodes[:, None, :]
    difference[:, np.arange(q), np.arange(q)] = 1.0
    ratio = (x[:, None, None] - nodes[:, None, :]) / difference
    ratio[:, np.arange(q), np.arange(q)] = 1.0
    return ratio.prod(axis=2)
