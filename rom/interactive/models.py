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

from rom.comparison.entries import is_network, model_path, seeded
from rom.comparison.settings import CURVES, NOT_APPLICABLE, QUICK_CURVES, TRAINED, constructor_settings
from rom.comparison.side_by_side import CASES, QUICK_CASES, SEED, beyond_count, find_truth, truth_path
from rom.datasets.splits import SPLITS
from rom.errors import RomError, SchemaError
from rom.fingertip import Fingertip
from rom.metamodels import METHODS, Metamodel, create, load, metamodel_class
from rom.metamodels.networks.sizes import weights_path
from rom.scenes import HarmonicPointForce, Scene, StaticPointForces, get_scene

log = logging.getLogger(__name__)

REFERENCE = "modal-krylov"
"""The method that is always there, and that frequency responses are made with."""
SOLVED = ("direct", "direct-reused", "coarse-fem")
"""Methods that factorise for each answer: a process of their own runs them."""
MODAL: dict[str, dict[str, Any]] = {"modal-krylov": {"modes": 40, "vectors": 6}, "modal-static": {"modes": 40},
                                    "modal": {}}
"""The modal family's settings here: `modal-krylov` and `modal-static` in double precision, `modal` at its headline."""
HOW_TO_FIT = "start `rom serve --fit` once, which takes some minutes, or run `make report`"
Progress = Callable[[Iterable, str], Iterable]


@dataclass(frozen=True)
class Source:
    """Where a method's model for one scene comes from.

    Parameters
    ----------
    scene : Scene
    method : str
    settings : dict
    path : Path
        In the cache, whether it is there or not.
    """

    scene: Scene
    method: str
    settings: dict[str, Any]
    path: Path


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
        self.harmonic: Scene = get_scene(HarmonicPointForce.name, tip)
        self.static: Scene = get_scene(StaticPointForces.name, tip)
        self._loaded: dict[tuple[str, bool], Metamodel] = {}
        self._reading = threading.Lock()

    def scene(self, harmonic: bool) -> Scene:
        """The scene that a state with or without motion asks."""
        return self.harmonic if harmonic else self.static

    # ---- what there is --------------------------------------------------------------------------------------

    def reason(self, method: str, harmonic: bool) -> str:
        """Why a method cannot be chosen at (or above) 0 Hz; empty where it can."""
        scene = self.scene(harmonic)
        if method in SOLVED or method in MODAL or (method == "superposition" and not harmonic):
            return ""
        if scene.name not in metamodel_class(method).scenes:
            return NOT_APPLICABLE[scene.name].get(method, f"does not apply to {scene.name}")
        if is_network(method) and not _torch_is_there():
            return "needs torch, which is not installed: pip install 'fingertip-rom[networks]'"
        if not self.sources[method, harmonic].path.exists():
            return f"has not been fitted to this fingertip: {HOW_TO_FIT}"
        return ""

    def listed(self) -> list[dict[str, Any]]:
        """One JSON-able record a method: name, summary, where it can be chosen, reasons where not."""
        records = []
        for method in METHODS:
            reasons = {harmonic: self.reason(method, harmonic) for harmonic in (False, True)}
            records.append({
                "name": method, "summary": metamodel_class(method).summary, "static": not reasons[False],
                "harmonic": not reasons[True], "reason_static": reasons[False], "reason_harmonic": reasons[True],
                "reason": reasons[True] if all(reasons.values()) else "", "max_forces": 3,
                "slow": method in SOLVED})
        return records

    @cached_property
    def sources(self) -> dict[tuple[str, bool], Source]:
        """By method and whether it is for motion; methods of :data:`SOLVED` have none."""
        found: dict[tuple[str, bool], Source] = {}
        for method, settings in MODAL.items():
            source = self._source(self.harmonic, method, settings)
            found[method, True] = found[method, False] = source
        for scene in (self.static, self.harmonic):
            for method, curve in (QUICK_CURVES if self.quick else CURVES)[scene.name].items():
                if method not in SOLVED and method not in MODAL:
                    settings = curve.settings[curve.headline]
                    found[method, scene.harmonic] = (
                        self._trained(scene, method, settings) if TRAINED in settings
                        else self._source(scene, method, settings))
        return found

    def _trained(self, scene: Scene, method: str, settings: dict[str, Any]) -> Source:
        """The weights that come with the toolkit where they are of this mesh; else a fit to the comparison's cases."""
        path = weights_path(method, settings[TRAINED], SPLITS[0])
        settings = constructor_settings(method, settings)
        if path.exists() and _torch_is_there():
            from rom.datasets.tensors import read_attributes

            try:
                if read_attributes(path)["scene_hash"] == scene.content_hash:
                    return Source(scene, method, settings, path)
            except RomError as error:
                log.warning("%s cannot be used: %s", path, error)
        return self._source(scene, method, settings)

    def _source(self, scene: Scene, method: str, settings: dict[str, Any]) -> Source:
        cases = self._cases
        key = truth_path(scene, cases, beyond_count(cases), SEED).stem
        return Source(scene, method, seeded(method, settings, SEED), model_path(scene, method, settings, key, SEED))

    @property
    def _cases(self) -> int:
        return QUICK_CASES if self.quick else CASES

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
        """Settings of a method of :data:`SOLVED`: those of the comparison's headline."""
        curve = (QUICK_CURVES if self.quick else CURVES)[self.scene(harmonic).name][method]
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
                if metamodel_class(source.method).learns:
                    raise SchemaError(f"{reason}: {HOW_TO_FIT}") from error
                log.warning("a cached model is fitted again: %s", reason)
        # a scene of its own: comparisons find this model too, and bill what its fit took
        own = get_scene(source.scene.name, source.scene.fingertip)
        model = create(source.method, own, **source.settings).fit()
        try:
            model.save(source.path)
        except OSError as error:
            log.warning("%s cannot be written (%s): the next start fits %s again", source.path, error, source.method)
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
        for (method, harmonic), source in self.sources.items():
            if not metamodel_class(method).learns and not self._answers(method, harmonic):
                self._read(source)  # a table of responses, say
        for scene in (self.static, self.harmonic):
            missing = [source for (method, harmonic), source in self.sources.items()
                       if source.scene is scene and (_torch_is_there() or not is_network(method))
                       and not self._answers(method, harmonic)]
            if missing:
                try:
                    self._fit_to(scene, missing, progress)
                except SchemaError as error:
                    log.warning("cached snapshots are solved again: %s", error)
                    truth_path(scene, self._cases, beyond_count(self._cases), SEED).unlink(missing_ok=True)
                    self._fit_to(scene, missing, progress)

    def _answers(self, method: str, harmonic: bool) -> bool:
        """Whether the cache holds a method's model, or there was no need to learn one."""
        try:
            self.model(method, harmonic)
        except ValueError:
            return False
        return True

    def _fit_to(self, scene: Scene, missing: list[Source], progress: Progress) -> None:
        truth = find_truth(scene, self._cases, beyond_count(self._cases), SEED, progress).training(SPLITS[0])
        for source in progress(missing, f"fitting {scene.name}"):
            model = create(source.method, get_scene(scene.name, scene.fingertip), **source.settings)
            try:
                model.fit(truth).save(source.path)
            except ValueError as error:  # a rank that few quick cases do not span, say
                log.warning("%s is left out: %s", source.method, error)


def _torch_is_there() -> bool:
    from importlib.util import find_spec

    return find_spec("torch") is not None
