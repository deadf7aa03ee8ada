"""The methods that the page offers on one fingertip: fitted models from the cache, and why others are missing.

The modal family is fitted at the first start and kept; what learns from snapshots is looked for where a comparison of
the same fingertip fitted it. A model is read when it is first asked for.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rom.comparison.entries import model_path, seeded
from rom.comparison.truth import find_truth, truth_path
from rom.datasets import SPLITS
from rom.errors import RomError, SchemaError
from rom.fingertip import Fingertip
from rom.metamodels import Curve, Metamodel, applicable, create, load, metamodel_class, method_names
from rom.metamodels.networks.sizes import TRAINED, constructor_settings, weights_path
from rom.metamodels.registry import metamodel_classes
from rom.scenes import LinearScene, get_scene

log = logging.getLogger(__name__)

REFERENCE = "modal-krylov"
"""The method that is always there, and that frequency responses are made with."""
SOLVED = ("direct", "direct-reused", "coarse-fem")
"""Methods that factorise for each answer: a process of their own runs them."""
MODAL: dict[str, dict[str, Any]] = {"modal-krylov": {"modes": 40, "vectors": 6}, "modal-static": {"modes": 40},
                                    "modal": {}}
"""The modal family's settings here: `modal-krylov` and `modal-static` in double precision, `modal` at its headline."""
HOW_TO_FIT = "start `rom serve --fit` once, which takes some minutes"
Progress = Callable[[Iterable, str], Iterable]


@dataclass(frozen=True)
class Source:
    """Where a method's model for one scene comes from.

    Parameters
    ----------
    scene : LinearScene
    kind : type of Metamodel
    settings : dict
    path : Path
        In the cache, or among the trained weights that come with the toolkit; whether it is there or not.
    """

    scene: LinearScene
    kind: type[Metamodel]
    settings: dict[str, Any]
    path: Path

    @property
    def can_be_fitted(self) -> bool:
        return _torch_is_there() or not self.kind.needs(self.scene).network


class Models:
    """Fitted models of one fingertip.

    Parameters
    ----------
    tip : Fingertip
    quick : bool
        Whether the comparison to look into is the quick one.
    """

    def __init__(self, tip: Fingertip, quick: bool = False) -> None:
        self.tip, self.quick = tip, quick
        self.harmonic: LinearScene = get_scene("harmonic-point-force", tip)
        self.static: LinearScene = get_scene("static-point-forces", tip)
        self._loaded: dict[tuple[str, bool], Metamodel] = {}
        self._reading = threading.Lock()

    def scene(self, harmonic: bool) -> LinearScene:
        """The scene that a state with or without motion asks."""
        return self.harmonic if harmonic else self.static

    # ---- what there is --------------------------------------------------------------------------------------

    @cached_property
    def _refused(self) -> dict[bool, dict[str, str | None]]:
        """Why methods do not apply, by whether anything moves."""
        return {harmonic: applicable(self.scene(harmonic)) for harmonic in (False, True)}

    def reason(self, method: str, harmonic: bool) -> str:
        """Why a method cannot be chosen at (or above) 0 Hz; empty where it can."""
        if method in MODAL:
            return ""
        refused = self._refused[harmonic][method]
        if refused is not None or method in (*SOLVED, "superposition"):
            return refused or ""
        source = self.sources[method, harmonic]
        if not source.can_be_fitted:
            return "needs torch, which is not installed: pip install 'fingertip-rom[networks]'"
        return "" if source.path.exists() else f"has not been fitted to this fingertip: {HOW_TO_FIT}"

    def listed(self) -> list[dict[str, Any]]:
        """One JSON-able record a method: name, summary, where it can be chosen, reasons where not."""
        records = []
        for method in method_names():
            reasons = {harmonic: self.reason(method, harmonic) for harmonic in (False, True)}
            records.append({
                "name": method, "summary": metamodel_classes(method)[0].summary, "static": not reasons[False],
                "harmonic": not reasons[True], "reason_static": reasons[False], "reason_harmonic": reasons[True],
                "reason": reasons[True] if all(reasons.values()) else "", "max_forces": 3,
                "slow": method in SOLVED})
        return records

    @cached_property
    def sources(self) -> dict[tuple[str, bool], Source]:
        """By method and whether it is for motion; methods of :data:`SOLVED` have none."""
        found: dict[tuple[str, bool], Source] = {}
        for method, settings in MODAL.items():
            found[method, True] = found[method, False] = self._source(self.harmonic, method, settings)
        for harmonic, refused in self._refused.items():
            for method, reason in refused.items():
                if reason is None and method not in (*SOLVED, *MODAL):
                    settings = self.settings_of(method, harmonic)
                    found[method, harmonic] = self._source(self.scene(harmonic), method, settings)
        return found

    def _source(self, scene: LinearScene, method: str, settings: dict[str, Any]) -> Source:
        kind = metamodel_class(method, scene)
        if TRAINED in settings:
            return Source(scene, kind, constructor_settings(method, settings), weights_path(method, settings[TRAINED]))
        key = truth_path(scene, *self._truth(scene)).stem
        return Source(scene, kind, seeded(kind, settings, scene.extent.seed),
                      model_path(kind, scene, settings, key, scene.extent.seed))

    def _truth(self, scene: LinearScene) -> tuple[int, int, int]:
        """Cases, cases beyond the ranges and seed of the comparison whose models are shown."""
        extent = scene.extent
        cases = extent.quick_cases if self.quick else extent.cases
        return cases, extent.beyond(cases), extent.seed

    # ---- getting them ---------------------------------------------------------------------------------------

    def model(self, method: str, harmonic: bool) -> Metamodel:
        """The fitted model that answers a state, read from the cache at its first use.

        Raises
        ------
        ValueError
            Where it cannot be chosen; says why.
        """
        key = (method, harmonic or method in MODAL)
        with self._reading:
            if key not in self._loaded:
                reason = self.reason(method, harmonic)
                if reason or method in SOLVED:
                    when = "moving" if harmonic else "static"
                    raise ValueError(f"{method} cannot answer a {when} state: {reason or 'it is solved elsewhere'}")
                self._loaded[key] = self._read(self.sources[key])
            return self._loaded[key]

    def is_loaded(self, method: str, harmonic: bool) -> bool:
        """Whether :meth:`model` answers at once."""
        return (method, harmonic or method in MODAL) in self._loaded

    def settings_of(self, method: str, harmonic: bool) -> dict[str, Any]:
        """Settings of a comparison's headline."""
        scene = self.scene(harmonic)
        kind = metamodel_class(method, scene)
        try:
            curve = kind.quick_curve(scene) if self.quick else kind.curve(scene)
        except RomError as error:  # trained weights that are damaged
            log.warning("%s is shown as it is without trained weights: %s", method, error)
            curve = Curve()
        return curve.settings[curve.headline]

    def _read(self, source: Source) -> Metamodel:
        """The model in the cache; a file there that cannot be read is named, and made anew where no snapshots are
        needed for that."""
        if source.path.exists():
            try:
                return load(source.path, source.scene)
            except Exception as error:  # whatever damage does to a reader: one file stops nobody
                named = error if isinstance(error, RomError) else f"{source.path} cannot be read ({error!r})"
                reason = " ".join(str(named).split())
                if source.kind.learns:
                    raise SchemaError(f"{reason}: {HOW_TO_FIT}") from error
                log.warning("a cached model is fitted again: %s", reason)
        # a scene of its own, as in comparisons, which find this model too
        model = create(source.kind.name, source.scene.afresh(), **source.settings).fit()
        try:
            model.save(source.path)
        except OSError as error:
            log.warning("%s cannot be written (%s): the next start fits %s again", source.path, error, source.kind.name)
        model.scene = source.scene
        return model

    def prepare(self, progress: Progress) -> None:
        """Fit what the cache lacks of the modal family and superposition, showing progress; then read the reference."""
        needed = [("superposition", False), *((method, True) for method in reversed(MODAL))]  # quick ones first
        missing = [key for key in needed if not self.sources[key].path.exists()]
        for key in progress(missing, "fitting") if missing else ():
            self._loaded[key] = self._read(self.sources[key])
        self.model(REFERENCE, True)

    def fit_all(self, progress: Progress) -> None:
        """Fit everything else too, solving snapshots first where something learns and the cache lacks them."""
        missing = [source for (method, harmonic), source in self.sources.items()
                   if source.can_be_fitted and not self._answers(method, harmonic)]
        for source in progress([one for one in missing if not one.kind.learns], "fitting"):
            self._read(source)  # a table of responses, say
        for scene in (self.static, self.harmonic):
            learning = [source for source in missing if source.kind.learns and source.scene is scene]
            if learning:
                try:
                    self._fit_to(scene, learning, progress)
                except (SchemaError, FileExistsError) as error:
                    log.warning("cached snapshots are solved again: %s", error)
                    truth_path(scene, *self._truth(scene)).unlink(missing_ok=True)
                    self._fit_to(scene, learning, progress)

    def _answers(self, method: str, harmonic: bool) -> bool:
        """Whether the cache holds a method's model, or there was no need to learn one."""
        try:
            self.model(method, harmonic)
        except ValueError:
            return False
        return True

    def _fit_to(self, scene: LinearScene, missing: list[Source], progress: Progress) -> None:
        truth = find_truth(scene, *self._truth(scene), progress).training(SPLITS[0])
        for source in progress(missing, f"fitting {scene.name}"):
            model = create(source.kind.name, scene.afresh(), **source.settings)
            try:
                model.fit(truth).save(source.path)
            except ValueError as error:  # a rank that few quick cases do not span, say
                log.warning("%s is left out: %s", source.kind.name, error)


def _torch_is_there() -> bool:
    from importlib.util import find_spec

    return find_spec("torch") is not None
