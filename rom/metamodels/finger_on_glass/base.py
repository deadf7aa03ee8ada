"""What every metamodel of load paths is: `fit`, a labelled `predict`, a lean `evaluate`, `save` and `load`."""

from __future__ import annotations

import json
import time
import warnings
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import xarray as xr

from rom.datasets.contact_schema import check_paths, label_answers, wanted
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.errors import NotFittedError, SchemaError
from rom.finger_on_glass.tissue import VARIANTS
from rom.fingertip.shape import shown
from rom.metamodels.contact.ranges import PathRange
from rom.metamodels.metamodel import MODEL_VERSION
from rom.metamodels.validity import ValidityWarning
from rom.provenance import stamp
from rom.scenes import FingerOnGlass, PathArrays, scene_from_json

Answers = dict[str, np.ndarray]
"""(n_path, n_position, ...) ndarrays by the names of :data:`rom.datasets.contact_schema.QUANTITIES`, SI units."""


class ContactMetamodel(ABC):
    """A method that answers the load paths of a scene.

    Parameters
    ----------
    scene : FingerOnGlass
        Never changed by the metamodel.
    **settings
        Named in each class; kept in :attr:`settings` as given, never changed by :meth:`fit`.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    """One plain sentence: what the method does."""
    scenes: ClassVar[tuple[str, ...]] = (FingerOnGlass.name,)
    learns: ClassVar[bool] = True
    """Whether it needs stored paths."""
    least_paths: ClassVar[int] = 2
    """Fewest complete paths of a variant that it can learn from."""

    def __init__(self, scene: FingerOnGlass, **settings: Any) -> None:
        if getattr(scene, "name", None) not in self.scenes:
            raise ValueError(f"{self.name} does not apply to {getattr(scene, 'name', shown(scene))}: it answers "
                             f"{', '.join(self.scenes)}")
        self.scene = scene
        self.settings = settings
        self.fitted = False
        self.borrowed_seconds = 0.0
        """What making something that this fit found stored has cost."""
        self.offline_seconds = float("nan")
        """Of the fit; the snapshots' own cost is the dataset's ``solve_seconds``."""
        self.trained: PathRange | None = None
        """What the training paths covered, in a fitted method that learns."""

    # ---- the contract ---------------------------------------------------------------------------------------

    def fit(self, train: xr.Dataset | None = None) -> Self:
        """Learn from stored paths, or prepare from the full-order model alone. May be called again.

        Paths that did not reach their last position are left out.

        Parameters
        ----------
        train : xr.Dataset, optional
            Of the schema; needed where ``learns`` is true.

        Raises
        ------
        ValueError
            Where training paths are needed and missing, too few, or hold values that are not finite.
        SchemaError
            Where they belong to another scene or section.
        """
        start = time.perf_counter()
        if self.learns:
            if train is None:
                raise ValueError(f"{self.name} learns from stored paths: give fit() a training dataset")
            train = self._checked(train)
        self.borrowed_seconds = 0.0
        self._fit(train)  # type: ignore[arg-type]  # None reaches only the methods that look at the model alone
        self.fitted = True
        self.offline_seconds = time.perf_counter() - start + self.borrowed_seconds
        return self

    def _checked(self, train: xr.Dataset) -> xr.Dataset:
        """The complete paths, of which there are enough; sets :attr:`trained`."""
        check_paths(train, self.scene, "the training dataset")
        complete = train["reached"].values.all(axis=1)
        if not complete.all():
            train = train.isel(path=np.flatnonzero(complete))
        if not train.sizes["path"]:
            raise ValueError("no training path reaches its last position: make paths that converge")
        for name in wanted("field"):
            if not np.isfinite(train[name].values).all():
                raise ValueError(f"the training {name} holds a value that is not finite: drop that path")
        paths = self.scene.case_arrays(train)
        counts = np.bincount(paths.variant, minlength=len(VARIANTS))
        scarce = [f"{VARIANTS[v]} ({n})" for v, n in enumerate(counts) if 0 < n < self.least_paths]
        if scarce:
            raise ValueError(f"{self.name} needs {self.least_paths} complete paths or more of each variant that it "
                             f"learns: too few of {', '.join(scarce)}")
        self.trained = PathRange.of(paths)
        return train

    def predict(self, cases: xr.Dataset) -> xr.Dataset:
        """Labelled answers to labelled paths: the dataset's dimensions, names and units.

        Parameters
        ----------
        cases : xr.Dataset
            ``variant``, ``c``, ``k1``, ``friction``, ``normal_force`` (path).

        Returns
        -------
        xr.Dataset
            The cases with every quantity of the scene's outputs, ``answered`` (path, position) and ``validity`` (path):
            why the method does not stand behind an answer, or nothing. Positions that are not answered hold NaN.

        Raises
        ------
        NotFittedError
        ValueError
            For cases that are not the scene's, or a variant that was never learned.

        Warns
        -----
        ValidityWarning
            Once, where some path lies outside the trained ranges or ends early.
        """
        self._check_fitted()
        paths = self.scene.case_arrays(cases)
        self._refuse_unlearned(paths)
        values, early = self._answer(paths)
        pairs = zip(self.reasons(paths), early, strict=True)
        reason = np.array(["; ".join(filter(None, pair)) for pair in pairs], dtype=str)
        answer = label_answers(self.scene, cases, values)
        answer["answered"] = (("path", "position"), np.isfinite(values["normal_displacement"]), {
            "long_name": "whether the method answers", "units": "1"})
        answer["validity"] = ("path", reason, {"long_name": "why the method does not stand behind the answer"})
        answer.attrs.update(method=self.name, scene=self.scene.name, scene_hash=self.scene.content_hash)
        if (reason != "").any():
            first = int(np.argmax(reason != ""))
            warnings.warn(f"{self.name} does not stand behind {int((reason != '').sum())} of {len(reason)} paths, "
                          f"first path {first}: {reason[first]}", ValidityWarning, stacklevel=2)
        return answer

    def evaluate(self, paths: PathArrays, positions: np.ndarray | None = None, outputs: str | None = None) -> Answers:
        """The lean call: whole paths, plain arrays in and out, nothing checked, nothing labelled.

        Parameters
        ----------
        paths : PathArrays
        positions : (k,) ndarray of int, optional
            Those that are wanted; default: all.
        outputs : {"field", "contact"}, optional
            Everything, or the contact quantities alone; default: what the scene wants.

        Returns
        -------
        dict of (n_path, k, ...) ndarray
            By the names of :data:`rom.datasets.contact_schema.QUANTITIES`, SI units; NaN where a path ends early.

        Raises
        ------
        NotFittedError
        """
        self._check_fitted()
        return self._evaluate(paths, np.arange(self.scene.n_positions) if positions is None else np.asarray(positions),
                              outputs or self.scene.outputs)

    def _answer(self, paths: PathArrays) -> tuple[Answers, list[str]]:
        """Answers at all positions, and for each path one sentence where it ended early."""
        return self.evaluate(paths), [""] * len(paths)

    def reasons(self, paths: PathArrays) -> list[str]:
        """For each path what lies outside the method's range, or nothing."""
        return [""] * len(paths) if self.trained is None else self.trained.reasons(paths)

    def best_approximation(self, paths: PathArrays, displacement: np.ndarray) -> np.ndarray | None:
        """What the method's own basis could answer at best: tells projection error from regression error.

        Parameters
        ----------
        paths : PathArrays
        displacement : (n_path, n_position, n_node, 2) ndarray [m]
            True answers.

        Returns
        -------
        like ``displacement``, or None
            None where the method has no basis.
        """
        return None

    def _check_fitted(self) -> None:
        if not self.fitted:
            raise NotFittedError(f"{self.name} has not been fitted: call fit() or load() first")

    def _refuse_unlearned(self, paths: PathArrays) -> None:
        if self.trained is not None:
            for v in np.unique(paths.variant):
                if VARIANTS[v] not in self.trained.variants:
                    raise ValueError(f"{self.name} never learned the variant {VARIANTS[v]}: it was fitted to "
                                     f"{', '.join(self.trained.variants)}; fit it with paths of this variant")

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
        data.attrs = {**data.attrs, "model_version": MODEL_VERSION, "method": self.name,
                      "settings": json.dumps(self.settings), "scene_parameters": self.scene.to_json(),
                      "scene_hash": self.scene.content_hash, "offline_seconds": self.offline_seconds,
                      "trained": json.dumps(self.trained and self.trained.to_dict()), **stamp()}
        write_netcdf(data, path)

    @classmethod
    def load(cls, path: str | Path, scene: FingerOnGlass | None = None) -> Self:
        """Read a fitted metamodel back.

        Parameters
        ----------
        scene : FingerOnGlass, optional
            Used instead of building the one that the file describes; must be the same.

        Raises
        ------
        SchemaError
            Where the file is damaged, of another method, version or section.
        """
        data = read_netcdf(path)
        found = data.attrs
        if found.get("method") != cls.name:
            raise SchemaError(f"{path} holds {found.get('method')!r}, not {cls.name!r}: load it with its own class")
        if found.get("model_version") != MODEL_VERSION:
            raise SchemaError(f"{path} has model version {found.get('model_version')}, this software reads "
                              f"{MODEL_VERSION}: fit the metamodel again")
        try:
            scene = scene or scene_from_json(found["scene_parameters"])
            if getattr(scene, "name", None) != json.loads(found["scene_parameters"])["scene"]:
                raise SchemaError(f"{path} was fitted to another scene than {shown(scene)}: give its own scene")
            if found["scene_hash"] != scene.content_hash:
                raise SchemaError(f"{path} belongs to another section or mesh ({str(found['scene_hash'])[:12]} instead "
                                  f"of {scene.content_hash[:12]}): fit the metamodel for this one")
            model = cls(scene, **json.loads(found["settings"]))
            model.offline_seconds = float(found["offline_seconds"])
            trained = json.loads(found["trained"])
            model.trained = None if trained is None else PathRange.from_dict(trained)
            model._restore(data)
        except (KeyError, TypeError, AttributeError, json.JSONDecodeError) as error:
            reason = " ".join(str(error.args[0]).split()) if error.args else type(error).__name__
            raise SchemaError(f"{path} is incomplete ({reason}): fit the metamodel again") from error
        model.fitted = True
        return model

    # ---- what each method writes ----------------------------------------------------------------------------

    @property
    @abstractmethod
    def model_bytes(self) -> int:
        """Memory that the online stage must hold [byte]."""

    @abstractmethod
    def _fit(self, train: xr.Dataset) -> None:
        """Learn from complete, checked paths, or prepare."""

    @abstractmethod
    def _evaluate(self, paths: PathArrays, positions: np.ndarray, outputs: str) -> Answers: ...

    @abstractmethod
    def _state(self) -> xr.Dataset:
        """What is learned, as arrays; attributes of its own are kept."""

    @abstractmethod
    def _restore(self, data: xr.Dataset) -> None: ...
