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

from rom.comparison.entries import Truth, is_network, model_path, seeded
from rom.comparison.settings import CURVES, NOT_APPLICABLE, QUICK_CURVES, TRAINED, constructor_settings
from rom.comparison.side_by_side import CASES, QUICK_CASES, SEED, beyond_count, find_truth, truth_path
from rom.datasets.splits import SPLITS
from rom.errors import SchemaError
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

            if read_attributes(path)["scene_hash"] == scene.content_hash:
                return Source(scene, method, settings, path)
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
        path = source.path
        if path.exists():
            try:
                return load(path, source.scene)
            except SchemaError as error:
                if metamodel_class(source.method).learns:
                    raise
                log.warning("a cached model is fitted again: %s", error)
        # a scene of its own: comparisons find this model too, and bill what its fit took
        own = get_scene(source.scene.name, source.scene.fingertip)
        model = create(source.method, own, **source.settings).fit()
        model.save(path)
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
        """Fit what learns from snapshots too, solving those first where the cache lacks them."""
        for scene in (self.static, self.harmonic):
            missing = [source for (_, harmonic), source in self.sources.items()
                       if harmonic == scene.harmonic and metamodel_class(source.method).learns
                       and not source.path.exists() and (not is_network(source.method) or _torch_is_there())]
            for source in self.sources.values():  # a table of responses, say, which needs no snapshots
                if source.scene is scene and not metamodel_class(source.method).learns and not source.path.exists():
                    self._read(source)
            if missing:
                truth = find_truth(scene, self._cases, beyond_count(self._cases), SEED, progress)
                self._fit_to(truth, missing, progress)

    @staticmethod
    def _fit_to(truth: Truth, missing: list[Source], progress: Progress) -> None:
        for source in progress(missing, f"fitting {missing[0].scene.name}"):
            own = get_scene(source.scene.name, source.scene.fingertip)
            try:
                create(source.method, own, **source.settings).fit(truth.training(SPLITS[0])).save(source.path)
            except SchemaError:  # a damaged truth is no reason to leave a method out
                raise
            except ValueError as error:  # a rank that few quick cases do not span, say
                log.warning("%s is left out: %s", source.method, error)


def _torch_is_there() -> bool:
    from importlib.util import find_spec

    return find_spec("torch") is not None
