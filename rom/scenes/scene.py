"""A scene is one question: which model, which inputs vary, which quantities are wanted, and what it does *not* need.

Every method answers the same scene: labelled cases (`xarray.Dataset`) come in through :meth:`Scene.read`, plain answers
go out through :meth:`Scene.label`, so that no method has conventions of its own.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, ClassVar, Protocol, Self

import numpy as np
import xarray as xr

from rom.bodies import Grid
from rom.checks import shown
from rom.errors import SchemaError
from rom.scenes.extent import Extent
from rom.scenes.inputs import Input, Quantity
from rom.scenes.labelled_cases import BESIDE
from rom.scenes.labels import fields, in_order

Answers = dict[str, np.ndarray]
"""By quantity, first axis always ``case``; NaN where an answer was not reached."""


class Cases(Protocol):
    """The inputs of a block of cases as plain arrays: what the lean calls take."""

    def __len__(self) -> int: ...

    def __iter__(self) -> Iterator[np.ndarray]: ...

    def take(self, index: Any) -> Self:
        """The cases at ``index`` (slice, mask or integers)."""
        ...

    def joined(self, other: Self) -> Self:
        """These cases, then the others."""
        ...


class Scene(ABC):
    """What every scene says of itself and does."""

    name: str
    title: str
    question: str
    gate: float
    """Largest relative error over held-out cases that a metamodel may make to be called trustworthy."""
    inputs: tuple[Input, ...]
    quantities: dict[str, Quantity]
    """What is answered; the first is the one by which methods are judged."""
    record: dict[str, Quantity]
    """What a dataset says of its full-order answers; no other method's answer may carry it."""
    needs: dict[str, str]
    leaves_out: dict[str, str]
    regions: tuple[str, ...]
    """The parts of the hard split, in the order of the codes that :meth:`hard_region` returns from 1 up."""
    outputs: str
    """What the lean calls give: "field" or the :attr:`part`."""
    part: str = ""
    """Name of the smaller output that can be had instead of the field; empty where there is none."""
    part_words: str = "chosen outputs"
    """The same in words."""
    case_noun: str = "case"
    error_definition: str = "||u_hat - u|| / ||u|| over all degrees of freedom"
    error_definitions: ClassVar[dict[str, str]] = {}
    """Errors that are told beside the one by which methods are judged, in words."""
    told_along: ClassVar[dict[str, str]] = {}
    """Quantities that results tell along the positions of a worst case, by the short names that they have there."""
    extent: Extent = Extent()
    """How much of the scene a comparison looks at."""
    recommended: str = "direct"
    """Name of the method that serves the scene best where nothing else is said."""
    quick_options: ClassVar[dict[str, Any]] = {}
    """Arguments of the scene's factory for a coarse mesh: a check that everything runs."""
    solver: str = ""
    """How the full-order model is solved, in words."""
    kind_noun: str = "load"
    """What :meth:`kinds` counts."""
    kinds_apart: bool = False
    """Whether methods learn each kind by itself."""
    has_residual: bool = False
    """Whether an answer's error can be bounded from its residual."""
    harmonic: bool = False
    grid: Grid | None = None
    doubts: tuple[str, ...] = ()
    """Why answers are not to be trusted, whatever the method."""

    @property
    def n_free(self) -> int:
        """Unknowns of the full-order model; 0 where they are not counted."""
        return 0

    @property
    def quantity(self) -> str:
        """Name of the quantity by which methods are judged."""
        return next(iter(self.quantities))

    def input(self, name: str) -> Input:
        """The input called ``name``; KeyError for another."""
        return {one.name: one for one in self.inputs}[name]

    def check_outputs(self, outputs: Any) -> str:
        """``outputs`` if the scene can want it; ValueError otherwise."""
        if not isinstance(outputs, str) or outputs not in ("field", self.part) or not outputs:
            known = " or ".join(repr(one) for one in ("field", self.part) if one)
            raise ValueError(f"outputs={shown(outputs)} is unknown: {self.name} can want {known}")
        return outputs

    # ---- labels in, labels out ------------------------------------------------------------------------------

    @abstractmethod
    def read(self, cases: xr.Dataset) -> Any:
        """Check labelled cases and turn them into plain arrays.

        Raises
        ------
        ValueError
            For a missing variable, a value that is not finite or out of its domain; one sentence with the value, the
            rule and the remedy.
        """

    @abstractmethod
    def cases_from(self, cases: Any) -> xr.Dataset:
        """Labelled cases from plain arrays: the inverse of :meth:`read`."""

    @abstractmethod
    def label(self, cases: xr.Dataset, answers: Any, outputs: str | None = None) -> xr.Dataset:
        """Attach names, units and positions to answers, an array where the scene has one quantity.

        Parameters
        ----------
        cases : xr.Dataset
        answers : Answers or ndarray
        outputs : str, optional
            Default: the scene's own.
        """

    @abstractmethod
    def stripped(self, cases: xr.Dataset) -> xr.Dataset:
        """Cases without what a stored dataset holds beside: answers, and what it says of them."""

    @abstractmethod
    def values(self, answer: xr.Dataset) -> Any:
        """Plain answers of labelled whole ones, whatever their order and units: the inverse of :meth:`label`."""

    @abstractmethod
    def coordinates(self) -> dict[str, tuple]:
        """Coordinates of whole answers: ids, components, positions."""

    def plain(self, answer: xr.Dataset) -> Answers:
        """Every quantity of a whole answer in the order of the scene's own labels, in its own unit.

        Raises
        ------
        SchemaError
            For a label that is missing or stands twice, and for another unit.
        """
        labels = self._labels
        return {name: fields(answer, name, {"case": None, **{dim: labels[dim] for dim in quantity.dims}}, quantity.unit)
                for name, quantity in self.quantities.items() if name in answer}

    def in_order(self, data: xr.Dataset, source: str = "the dataset") -> xr.Dataset:
        """A dataset with its fields in the scene's own order and units; raises as :meth:`plain`."""
        return in_order(data, self._labels, {name: (("case", *quantity.dims), quantity.unit)
                                             for name, quantity in self.quantities.items()}, source)

    def batched(self, cases: xr.Dataset) -> xr.Dataset:
        """Cases with the dimension ``case``, where one alone was picked by ``isel(case=...)``."""
        if "case" in cases.dims:
            return cases
        mine = {*(one.name for one in self.inputs), *self.quantities, *self.record, *BESIDE}
        return cases.drop_vars("case", errors="ignore").assign(
            cases[[name for name in cases.data_vars if name in mine]].expand_dims("case"))

    @property
    def _labels(self) -> dict[str, np.ndarray]:
        return {name: np.asarray(entry[1]) for name, entry in self.coordinates().items() if entry[0] == name}

    def check_origin(self, data: xr.Dataset, source: str = "the dataset", *, required: bool = True) -> None:
        """Refuse data of another scene, body or mesh.

        Parameters
        ----------
        data : xr.Dataset
        source : str
            For the message.
        required : bool
            Whether data that do not say where they come from are refused too.

        Raises
        ------
        SchemaError
        """
        name, digest = data.attrs.get("scene"), data.attrs.get("scene_hash")
        if name != self.name and (required or name is not None):
            raise SchemaError(f"{source} belongs to the scene {shown(name)}, not to {self.name!r}: give one of this "
                              "scene")
        if digest != self.content_hash and (required or digest is not None):
            raise SchemaError(f"{source} belongs to another body or mesh, or to other loads ({str(digest)[:12]}, not "
                              f"{self.content_hash[:12]}): make it again for this one")

    # ---- what methods learn from ------------------------------------------------------------------------------

    def complete(self, train: xr.Dataset) -> xr.Dataset:
        """The training cases that have a whole answer.

        Raises
        ------
        ValueError
            Where none has, or a value is not finite that must be.
        """
        if not np.isfinite(train[self.quantity].values).all():
            raise ValueError(f"the training {self.quantity} holds a value that is not finite: drop that case")
        return train

    @abstractmethod
    def kinds(self, cases: Any) -> np.ndarray:
        """(n_case, k) ndarray of int: which loads or variants each case has, -1 where it has fewer."""

    @abstractmethod
    def numbers(self, cases: Any) -> dict[str, np.ndarray]:
        """(n_case,) ndarrays of the inputs over which methods interpolate, by name."""

    def check_answers(self, cases: Any, answers: Any, method: str) -> dict[str, tuple]:
        """What `predict` says beside the answers; SolverError or ValueError for answers that must not be given."""
        return {}

    @property
    def mesh_hash(self) -> str:
        """Changes with the mesh."""
        return self.content_hash

    # ---- the truth ------------------------------------------------------------------------------------------

    @abstractmethod
    def solve(self, cases: Any) -> tuple[Answers, dict[str, np.ndarray]]:
        """The full-order model's answers, and what :attr:`record` lists of them."""

    @abstractmethod
    def errors(self, cases: Any, answers: Any, truth: Any) -> dict[str, np.ndarray]:
        """How wrong answers are: the relative error by which methods are judged first, then others by name.

        Parameters
        ----------
        cases : Cases
        answers, truth : Answers or ndarray
            Whole fields.

        Returns
        -------
        dict of (n_case, ...) ndarray
            The largest along further axes is the error of a case; NaN where there is no truth.
        """

    def groups(self, cases: Any) -> list[np.ndarray]:
        """Index arrays of cases that one factorization serves."""
        return [np.array([i]) for i in range(len(cases))]

    def thinned(self, rows: np.ndarray, every: int) -> np.ndarray:
        """(k,) ndarray of bool: one in ``every`` of a dataset's cases at ``rows``, kept with what it is solved with."""
        return np.arange(len(rows)) % every == 0

    def same_on_any_mesh(self, cases: Any) -> np.ndarray:
        """(n_case,) ndarray of bool: cases that a finer mesh answers too."""
        return np.ones(len(cases), dtype=bool)

    def afresh(self) -> Self:
        """The same scene with nothing factorised yet: nobody profits from what another one made."""
        return self

    def begin_piece(self) -> None:  # noqa: B027  # most models keep nothing that could
        """Before a piece is solved and timed: forget what could change its bits, make what is made once a process."""

    def whole(self, values: np.ndarray) -> np.ndarray:
        """Plain answers of the judged quantity with the dimensions that a dataset has."""
        return values

    def pieces(self, cases: Any) -> list[np.ndarray]:
        """Index arrays of cases that are solved together, when a dataset is made."""
        return self.groups(cases)

    # ---- which cases ----------------------------------------------------------------------------------------

    @abstractmethod
    def sample(self, count: int, seed: int = 0) -> Any:
        """``count`` distinct cases within the ranges."""

    @abstractmethod
    def sample_beyond(self, count: int, seed: int = 0) -> Any:
        """``count`` cases outside the ranges, for the extrapolation part of the hard split."""

    @abstractmethod
    def hard_region(self, cases: Any, seed: int = 0) -> np.ndarray:
        """(n_case,) ndarray of int: 0 where a case belongs to hard training, k where to ``regions[k - 1]``."""

    @property
    def n_published(self) -> int | None:
        """Number of cases that the ranges hold, amplitudes apart; None where they are not counted."""
        return None

    def published_number(self, cases: Any) -> np.ndarray:
        """(n_case,) ndarray of int: the place of each case within the ranges among the :attr:`n_published` ones."""
        raise NotImplementedError(f"the cases of {self.name} are not counted")

    # ---- identity -------------------------------------------------------------------------------------------

    @property
    @abstractmethod
    def content_hash(self) -> str:
        """Changes with everything that changes the truth."""

    @abstractmethod
    def to_json(self) -> str:
        """Enough to build this scene again with :func:`rom.scenes.scene_from_json`, where a factory is registered."""
