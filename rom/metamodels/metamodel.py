"""What every metamodel is: `fit`, a labelled `predict`, a lean `evaluate`, `save` and `load`."""

from __future__ import annotations

import json
import time
import warnings
from abc import ABC, abstractmethod
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

import numpy as np
import xarray as xr

from rom.datasets.schema import check_scene
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.errors import NotFittedError, SchemaError, SolverError
from rom.fingertip.locking import locking_reason
from rom.metamodels.validity import Assessment, TrainedRange, ValidityWarning, check_tolerance, joined, warning_text
from rom.provenance import stamp
from rom.scenes import CaseArrays, Scene, scene_from_json

MODEL_VERSION = "1.0"
SMALLEST_SINGLE = 1e-25
"""Displacement [m] below which float32 answers are refused: coordinates a million times smaller lose digits there."""


class Metamodel(ABC):
    """A method that answers the cases of a scene.

    Parameters
    ----------
    scene : Scene
        Never changed by the metamodel.
    **settings
        Named in each class; kept in :attr:`settings` as given, never changed by :meth:`fit`.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    """One plain sentence: what the method does."""
    scenes: ClassVar[tuple[str, ...]]
    """Names of the scenes it applies to."""
    learns: ClassVar[bool] = False
    """Whether it needs snapshots; if not, `fit` accepts None and looks at the full-order model alone."""

    def __init__(self, scene: Scene, **settings: Any) -> None:
        if scene.name not in self.scenes:
            raise ValueError(f"{self.name} does not apply to {scene.name}: it answers {', '.join(self.scenes)}")
        self.scene = scene
        self.settings = settings
        self.fitted = False
        self.borrowed_seconds = 0.0
        self.offline_seconds = float("nan")
        self.trained: TrainedRange | None = None
        """What the training cases covered, in a fitted method that learns."""

    # ---- the contract ---------------------------------------------------------------------------------------

    def fit(self, train: xr.Dataset | None = None) -> Self:
        """Learn from the training cases, or prepare from the full-order model alone. May be called again.

        Parameters
        ----------
        train : xr.Dataset, optional
            Training cases of the schema; needed where ``learns`` is true.

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
            check_scene(train, self.scene, "the training dataset")
            if not np.isfinite(train["displacement"].values).all():
                raise ValueError("the training displacement holds a value that is not finite: drop that case")
            self.trained = TrainedRange.of(self.scene.case_arrays(train))
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
            The scene's ``load_variables`` (case, force): ``load_node``, ``force_amplitude`` ...; in harmonic scenes
            ``frequency`` and ``loss_factor`` (case).
        tolerance : float, optional
            Largest relative error in the energy norm. Cases in which the method cannot show that it meets it are
            answered by the next better one, up to `direct`.

        Returns
        -------
        xr.Dataset
            The cases with ``displacement`` (case, node, component) [m], ``error_estimate``, ``error_kind`` and
            ``validity`` (case) as in `Assessment`, with a tolerance also ``answered_by`` (case).

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
        arrays = self.scene.case_arrays(cases)
        answered_by = None
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            if tolerance is None:
                values, found = self._answer(arrays)
                kind, extra = np.full(len(arrays), found.kind), self.indicators(arrays)
            else:
                from rom.metamodels.tolerance import answer_within

                values, found, kind, answered_by = answer_within(self, arrays, tolerance)
                extra = {}
        bad = ~np.isfinite(values).all(axis=1)
        if bad.any():
            raise SolverError(f"case {int(np.argmax(bad))} has no finite answer by {self.name}: an undamped resonance "
                              "or an overflow; give a loss factor above zero, or a smaller force")
        self._refuse_what_single_precision_loses(arrays, values)
        locked = locking_reason(self.scene.fingertip)
        if locked:
            found = replace(found, reason=joined(found.reason, np.full(len(arrays), locked)))
        answer = self.scene.label(cases, values)
        answer.attrs["method"] = self.name
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

    def _refuse_what_single_precision_loses(self, cases: CaseArrays, values: np.ndarray) -> None:
        if values.dtype.itemsize < np.result_type(values.dtype, np.float64).itemsize:
            lost = (np.abs(values).max(axis=1) < SMALLEST_SINGLE) & (cases.force != 0.0).any(axis=1)
            if lost.any():
                raise ValueError(f"case {int(np.argmax(lost))} moves less than {SMALLEST_SINGLE:g} m, which single "
                                 "precision cannot resolve: give precision='float64', or a larger force")

    def assess(self, cases: CaseArrays, values: np.ndarray | None = None) -> Assessment:
        """How wrong the answers are, as well as the method can tell; may cost more than the answer itself.

        Here by the residual (:mod:`rom.metamodels.residual_bound`): one static solve, and the scene's modes once.

        Parameters
        ----------
        cases : CaseArrays
        values : (n_case, n_free) ndarray [m], optional
            The method's answer, full field, if it is there already.

        Returns
        -------
        Assessment
        """
        from rom.metamodels.residual_bound import residual_bound

        if values is None:
            values = self.evaluate(cases, "field")
        error = residual_bound(self.scene).bound(cases, values)
        return Assessment(error, "bound", self.reasons(cases)).with_large_errors_named()

    def quick_assessment(self, cases: CaseArrays) -> Assessment:
        """What the method knows of its error without a reference, a solve or the answer: ranges at least."""
        return Assessment.unknown(self.reasons(cases))

    def reasons(self, cases: CaseArrays) -> np.ndarray:
        """(n_case,) ndarray of str: what lies outside the method's range, or nothing."""
        return np.full(len(cases), "") if self.trained is None else self.trained.reasons(cases)

    def _answer(self, cases: CaseArrays) -> tuple[np.ndarray, Assessment]:
        """Answers for the scene's outputs, and what is known of their error at little cost."""
        return self.evaluate(cases), self.quick_assessment(cases)

    def evaluate(self, cases: CaseArrays, outputs: str | None = None, out: np.ndarray | None = None) -> np.ndarray:
        """The lean call: plain arrays in, plain array out, nothing checked, nothing labelled.

        Parameters
        ----------
        cases : CaseArrays
        outputs : {"field", "pad"}, optional
            Free degrees of freedom or the pad's alone; default: what the scene wants.
        out : (n_case, n_output) ndarray [m], optional
            An array that an earlier call of the same size returned, to be filled again.

        Returns
        -------
        (n_case, n_output) ndarray [m]
            Real for static scenes, complex for harmonic ones.

        Raises
        ------
        NotFittedError
        ValueError
            Where ``out`` does not fit.
        """
        self._check_fitted()
        return self._evaluate(cases, outputs or self.scene.outputs, out)

    def _check_fitted(self) -> None:
        if not self.fitted:
            raise NotFittedError(f"{self.name} has not been fitted: call fit() or load() first")

    def indicators(self, cases: CaseArrays) -> dict[str, tuple]:
        """Variables by which a method says how wrong an answer may be; empty where it cannot."""
        return {}

    def best_approximation(self, values: np.ndarray) -> np.ndarray | None:
        """What the method's own basis could answer at best: tells projection error from regression error.

        Parameters
        ----------
        values : (n_case, n_free) ndarray [m]
            True answers.

        Returns
        -------
        (n_case, n_free) ndarray [m] or None
            None where a method has no basis that all cases share.
        """
        return None

    def residual(self, cases: xr.Dataset, answer: xr.Dataset) -> xr.DataArray:
        """(case,) relative residual ``||Z u - f|| / ||f||`` of a full-field answer; needs no reference."""
        arrays = self.scene.case_arrays(cases)
        values = self.scene.values(answer)
        out = np.empty(len(arrays))
        for i in range(len(arrays)):
            one = arrays.take(slice(i, i + 1))
            point = (float(one.frequency[0]), float(one.loss_factor[0])) if self.scene.harmonic else ()
            out[i] = self.scene.full_order.residual(
                values[i][:, None], self.scene.force_vectors(one), *point)[0]
        return xr.DataArray(out, dims="case", attrs={"long_name": "relative residual", "units": "1"})

    # ---- files ----------------------------------------------------------------------------------------------

    def save(self, path: str | Path) -> None:
        """Write the fitted metamodel as one netCDF file, atomically.

        Raises
        ------
        NotFittedError, OSError
        """
        if not self.fitted:
            raise NotFittedError(f"{self.name} has not been fitted: fit it before saving")
        data = self._state()
        data.attrs = {**self._file_attributes(), **data.attrs}
        write_netcdf(data, path)

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
        data = read_netcdf(path)
        try:
            model = cls._from_attributes(data.attrs, path, scene)
            model._restore(data)
            model.fitted = True
        except (KeyError, TypeError, AttributeError) as error:  # an attribute or variable is missing or of another kind
            reason = " ".join(str(error.args[0]).split()) if error.args else type(error).__name__
            raise SchemaError(f"{path} is incomplete ({reason}): fit the metamodel again") from error
        return model

    def _file_attributes(self) -> dict[str, Any]:
        return {"model_version": MODEL_VERSION, "method": self.name, "settings": json.dumps(self.settings),
                "scene_parameters": self.scene.to_json(), "scene_hash": self.scene.content_hash,
                "mesh_hash": self.scene.fingertip.mesh.mesh_hash, "offline_seconds": self.offline_seconds,
                "trained": json.dumps(self.trained and self.trained.to_dict()), **stamp()}

    @classmethod
    def _from_attributes(cls, attributes: dict[str, Any], path: str | Path, scene: Scene | None) -> Self:
        if attributes.get("method") != cls.name:
            raise SchemaError(f"{path} holds {attributes.get('method')!r}, not {cls.name!r}: "
                              "load it with its own class")
        if attributes.get("model_version") != MODEL_VERSION:
            raise SchemaError(f"{path} has model version {attributes.get('model_version')}, this software reads "
                              f"{MODEL_VERSION}: fit the metamodel again")
        scene = scene or scene_from_json(attributes["scene_parameters"])
        fitted = json.loads(attributes["scene_parameters"])["scene"]
        if fitted != scene.name:
            raise SchemaError(f"{path} was fitted to the scene {fitted!r}, not to {scene.name!r}: give its own scene")
        if attributes["scene_hash"] != scene.content_hash or attributes["mesh_hash"] != scene.fingertip.mesh.mesh_hash:
            raise SchemaError(f"{path} belongs to another anatomy or mesh, or to other load sites "
                              f"({str(attributes['scene_hash'])[:12]} instead of {scene.content_hash[:12]}): "
                              "fit the metamodel for this fingertip")
        model = cls(scene, **json.loads(attributes["settings"]))
        model.offline_seconds = float(attributes["offline_seconds"])
        trained = json.loads(attributes.get("trained", "null"))
        model.trained = None if trained is None else TrainedRange.from_dict(trained)
        return model

    # ---- what each method writes ----------------------------------------------------------------------------

    @property
    @abstractmethod
    def model_bytes(self) -> int:
        """Memory that the online stage must hold [byte]."""

    @property
    def online_bytes(self) -> int:
        """Fewest bytes that one full-field answer must read and write: its floor [byte]."""
        return 0

    @abstractmethod
    def _fit(self, train: xr.Dataset) -> None:
        """Learn or prepare; adds to ``borrowed_seconds`` what an earlier fit spent and this one uses."""


    @abstractmethod
    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray: ...

    @abstractmethod
    def _state(self) -> xr.Dataset: ...

    @abstractmethod
    def _restore(self, data: xr.Dataset) -> None: ...


@runtime_checkable
class CertifiedMetamodel(Protocol):
    """A metamodel that bounds its own error without a reference."""

    def error_bound(self, cases: CaseArrays) -> np.ndarray:
        """(n_case,) ndarray [J^1/2]: bound of ``sqrt(e^H K e)``."""
