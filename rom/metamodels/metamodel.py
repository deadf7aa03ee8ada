"""What every metamodel is: `fit`, a labelled `predict`, a lean `evaluate`, `save` and `load`."""

from __future__ import annotations

import json
import time
import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import xarray as xr

from rom.datasets.storage import read_netcdf, write_netcdf
from rom.errors import NotFittedError, SchemaError
from rom.metamodels.basis import room
from rom.metamodels.facts import Curve, Needs
from rom.metamodels.model_files import check_fitted_scene, check_method, scene_attributes
from rom.metamodels.stored import Stored, from_dataset, to_dataset
from rom.metamodels.trained import TrainedRange
from rom.metamodels.validity import Assessment, ValidityWarning, check_tolerance, joined, warning_text
from rom.provenance import stamp
from rom.scenes import Scene, scene_from_json


class Metamodel(ABC):
    """A method that answers the cases of a scene.

    A method of one's own gives `name`, `summary`, `_fit`, `_evaluate`, and in :attr:`stored` what a file must hold
    (:mod:`rom.metamodels.stored` shows one).

    Parameters
    ----------
    scene : Scene
        Never changed by the metamodel.
    **settings
        Named in each class; kept in :attr:`settings` as given, never changed by :meth:`fit`.

    Raises
    ------
    ValueError
        Where the method does not apply to the scene.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    """One plain sentence: what the method does."""
    learns: ClassVar[bool] = False
    """Whether it needs snapshots; if not, `fit` accepts None and looks at the full-order model alone."""
    seeded: ClassVar[bool] = False
    """Whether it takes a setting ``seed`` on which its weights hang."""
    full_order: ClassVar[bool] = False
    """Whether it solves the full-order model itself: what speed-ups are quoted against."""
    slow: ClassVar[int] = 1
    """One held-out case in so many is answered in a comparison, where each takes as long as the truth."""
    colour: ClassVar[str] = "#7f7f7f"
    """In figures."""
    suffix: ClassVar[str] = ".nc"
    """Of its files."""
    stored: ClassVar[tuple[Stored, ...]] = ()
    """What its file holds, beside settings and ranges."""

    # ---- facts about the method -------------------------------------------------------------------------------

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        """Why the method does not apply to a scene, in one clause; None where it does."""
        return None

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        """The settings at which a comparison runs it."""
        return Curve()

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        """The same for a coarse mesh and few cases: a check that everything runs."""
        return cls.curve(scene)

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        """What it asks of the full-order model."""
        return Needs()

    def __init__(self, scene: Scene, **settings: Any) -> None:
        reason = self.why_not(scene)
        if reason is not None:
            raise ValueError(f"{self.name} does not apply to {scene.name}: {reason}")
        if settings and type(self).__init__ is Metamodel.__init__:
            raise TypeError(f"{self.name} has no settings")
        self.scene: Any = scene
        self.settings = settings
        self.fitted = False
        self.borrowed_seconds = 0.0
        """What making something that this fit found made has cost."""
        self.offline_seconds = float("nan")
        """Of the fit; the snapshots' own cost is the dataset's ``solve_seconds``."""
        self.trained: TrainedRange | None = None
        """What the training cases covered, in a fitted method that learns."""

    # ---- the contract ---------------------------------------------------------------------------------------

    def fit(self, train: xr.Dataset | None = None) -> Self:
        """Learn from the training cases, or prepare from the full-order model alone. May be called again.

        Parameters
        ----------
        train : xr.Dataset, optional
            Training cases of the schema; needed where ``learns`` is true. Cases without a whole answer are left out.

        Raises
        ------
        ValueError
            Where training cases are needed and missing, or hold values that are not finite.
        SchemaError
            Where they belong to another scene or mesh.
        """
        start = time.perf_counter()
        if self.learns:
            if train is None:
                raise ValueError(f"{self.name} learns from snapshots: give fit() a training dataset")
            self.scene.check_origin(train, "the training dataset")
            train = self.scene.complete(self.scene.in_order(train, "the training dataset"))
            self.trained = TrainedRange.of(self.scene, self.scene.read(train))
        self.borrowed_seconds = 0.0
        self._fit(train)  # type: ignore[arg-type]  # None reaches only the methods that look at the model alone
        self.fitted = True
        self.offline_seconds = time.perf_counter() - start + self.borrowed_seconds
        return self

    def predict(self, cases: xr.Dataset, tolerance: float | None = None) -> xr.Dataset:
        """Labelled answers to labelled cases: the full-order model's dimensions, names and units.

        Without a tolerance the error is what the method knows at little cost (:meth:`quick_assessment`).

        Parameters
        ----------
        cases : xr.Dataset
            The scene's ``inputs``, along (case) or (case, force).
        tolerance : float, optional
            Largest relative error in the energy norm, in linear scenes. Cases in which the method cannot show that it
            meets it are answered by the next better one, up to `direct`.

        Returns
        -------
        xr.Dataset
            The cases with every quantity of the scene's outputs, ``error_estimate``, ``error_kind`` and ``validity``
            (case) as in `Assessment`, with a tolerance also ``answered_by`` (case).

        Raises
        ------
        NotFittedError
        ValueError
            For cases that are not the scene's, and a tolerance that nothing can meet.
        SolverError
            Where a case has no finite answer, such as an undamped resonance.

        Warns
        -----
        ValidityWarning
            Once, where the method does not stand behind an answer, or nothing met the tolerance.
        """
        if tolerance is not None:
            tolerance = check_tolerance(tolerance)
        self._check_fitted()
        arrays = self.scene.read(cases)
        answered_by = None
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            if tolerance is None:
                values, found = self.answer(arrays)
                kind, extra = np.full(len(arrays), found.kind), self.indicators(arrays)
            else:
                # stands above the methods, since it chooses among them
                within = import_module("rom.solving").answer_within
                values, found, kind, answered_by = within(self, arrays, tolerance)
                extra = {}
        extra = {**extra, **self.scene.check_answers(arrays, values, self.name)}
        for doubt in self.scene.doubts:
            found = replace(found, reason=joined(found.reason, np.full(len(arrays), doubt)))
        answer = self.scene.label(cases, values)
        answer.attrs.update(method=self.name, scene=self.scene.name, scene_hash=self.scene.content_hash)
        answer = answer.assign(extra).assign({
            "error_estimate": ("case", found.error, {
                "long_name": "relative error in the energy norm, as far as it is known", "units": "1"}),
            "error_kind": ("case", kind, {"long_name": "what error_estimate is: bound, estimate or none"}),
            "validity": ("case", found.reason, {"long_name": "why the method does not stand behind the answer"})})
        if answered_by is not None:
            answer["answered_by"] = ("case", answered_by, {"long_name": "method that answered"})
            answer.attrs["tolerance"] = tolerance
        if (found.reason != "").any():
            warnings.warn(warning_text(self.name, found.reason, found.error), ValidityWarning, stacklevel=2)
        return answer

    def assess(self, cases: Any, values: np.ndarray | None = None) -> Assessment:
        """How wrong the answers are, as well as the method can tell; may cost more than the answer itself.

        In linear scenes by the residual (:mod:`rom.metamodels.residual_bound`): one static solve, and the scene's modes
        once.

        Parameters
        ----------
        cases : Cases
        values : (n_case, n_free) ndarray, optional
            The method's answer, full field, if it is there already.

        Returns
        -------
        Assessment
        """
        from rom.metamodels.residual_bound import residual_bound

        if not self.scene.has_residual:
            return self.quick_assessment(cases)
        if values is None:
            values = self.evaluate(cases, "field")
        error = residual_bound(self.scene).bound(cases, values)
        return Assessment(error, "bound", self.reasons(cases)).with_large_errors_named()

    def quick_assessment(self, cases: Any) -> Assessment:
        """What the method knows of its error without a reference, a solve or the answer: ranges at least."""
        return Assessment.unknown(self.reasons(cases), named=self.scene.has_residual)

    def reasons(self, cases: Any) -> np.ndarray:
        """(n_case,) ndarray of str: what lies outside the method's range, or nothing."""
        return np.full(len(cases), "") if self.trained is None else self.trained.reasons(self.scene, cases)

    def answer(self, cases: Any) -> tuple[Any, Assessment]:
        """Answers for the scene's outputs, and what is known of their error at little cost."""
        return self.evaluate(cases), self.quick_assessment(cases)

    def evaluate(self, cases: Any, outputs: str | None = None, out: np.ndarray | None = None) -> Any:
        """The lean call: plain arrays in and out, nothing checked, nothing labelled.

        Parameters
        ----------
        cases : Cases
            Of the scene's own kind, as its ``read`` returns them.
        outputs : str, optional
            "field" or the scene's part; default: what the scene wants.
        out : (n_case, n_output) ndarray, optional
            An array that an earlier call of the same size returned, to be filled again; in linear scenes.

        Returns
        -------
        (n_case, n_output) ndarray, or dict of (n_case, ...) ndarray
            The second where the scene has several quantities; SI units.

        Raises
        ------
        NotFittedError
        ValueError
            Where ``out`` does not fit.
        """
        self._check_fitted()
        values = self._evaluate(cases, outputs or self.scene.outputs, out)
        if out is None or values is out or isinstance(values, dict):
            return values
        room(out, *values.shape, values.dtype)[:] = values  # of a method that makes an array of its own
        return out

    def _check_fitted(self) -> None:
        if not self.fitted:
            raise NotFittedError(f"{self.name} has not been fitted: call fit() or load() first")

    def indicators(self, cases: Any) -> dict[str, tuple]:
        """Variables by which a method says how wrong an answer may be; empty where it cannot."""
        return {}

    def best_approximation(self, cases: Any, values: np.ndarray) -> np.ndarray | None:
        """What the method's own basis could answer at best: tells projection error from regression error.

        Parameters
        ----------
        cases : Cases
        values : (n_case, ...) ndarray
            True answers of the quantity by which methods are judged.

        Returns
        -------
        like ``values``, or None
            None where a method has no basis.
        """
        return None

    # ---- files ----------------------------------------------------------------------------------------------

    def save(self, path: str | Path) -> None:
        """Write the fitted metamodel as one file, atomically: netCDF, or safetensors where it is a network.

        Raises
        ------
        NotFittedError, OSError
        """
        if not self.fitted:
            raise NotFittedError(f"{self.name} has not been fitted: fit it before saving")
        data = to_dataset(self, self.stored)
        self._write(path, data.assign_attrs({**self._file_attributes(), **data.attrs}))

    def _write(self, path: str | Path, data: xr.Dataset) -> None:
        write_netcdf(data, path)

    @classmethod
    def _read(cls, path: str | Path) -> xr.Dataset:
        return read_netcdf(path)

    @classmethod
    def load(cls, path: str | Path, scene: Scene | None = None) -> Self:
        """Read a fitted metamodel back.

        Parameters
        ----------
        scene : Scene, optional
            Used instead of building the one that the file describes; must be the same.

        Raises
        ------
        SchemaError
            Where the file is damaged, of another method, version or mesh.
        """
        data = cls._read(path)
        try:
            model = cls._from_attributes(data.attrs, path, scene)
            from_dataset(model, cls.stored, data)
            model._restored(data)
            model.fitted = True
        except SchemaError:
            raise
        except (KeyError, TypeError, AttributeError, RuntimeError, ValueError) as error:  # missing, or of another kind
            reason = " ".join(str(error.args[0]).split()) if error.args else type(error).__name__
            raise SchemaError(f"{path} is incomplete or damaged ({reason}): fit the metamodel again") from error
        return model

    def _restored(self, data: xr.Dataset) -> None:  # noqa: B027  # most methods need nothing beside their arrays
        """Make what answering needs of the attributes that were read."""

    def _file_attributes(self) -> dict[str, Any]:
        return {**scene_attributes(self.scene), "method": self.name, "settings": json.dumps(self.settings),
                "offline_seconds": self.offline_seconds,
                "trained": json.dumps(self.trained and self.trained.to_dict()), **stamp()}

    @classmethod
    def _from_attributes(cls, attributes: Mapping[str, Any], path: str | Path, scene: Scene | None) -> Self:
        """A model that is not fitted yet, with the settings and ranges that a file's attributes tell."""
        check_method(attributes, cls.name, path)
        scene = scene or scene_from_json(attributes["scene_parameters"])
        check_fitted_scene(attributes, scene, path)
        model = cls(scene, **json.loads(attributes["settings"]))
        model.offline_seconds = float(attributes["offline_seconds"])
        trained = json.loads(attributes.get("trained", "null"))
        model.trained = None if trained is None else TrainedRange.from_dict(trained)
        return model

    @property
    def model_bytes(self) -> int:
        """Memory that the online stage must hold [byte]."""
        return sum(variable.nbytes for variable in to_dataset(self, self.stored).variables.values())

    @property
    def online_bytes(self) -> int:
        """Fewest bytes that one full-field answer must read and write: its floor [byte]."""
        return 0

    @abstractmethod
    def _fit(self, train: xr.Dataset) -> None:
        """Learn or prepare; adds to ``borrowed_seconds`` what an earlier fit spent and this one uses."""

    @abstractmethod
    def _evaluate(self, cases: Any, outputs: str, out: np.ndarray | None) -> Any: ...
