"""Scenes and fitted methods of an atlas, each made once and shared by the levels that ask for the same."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import xarray as xr

from atlas.judge import Heard, Unanswered, listen
from atlas.level import Level
from rom.fingertip import Fingertip
from rom.fullorder import SecondOrderModel
from rom.metamodels import create
from rom.metamodels.metamodel import Metamodel
from rom.scenes import LinearScene, get_scene
from rom.scenes.fingertip_scene import fingertip_of


@dataclass
class Fitted:
    """A method that was fitted, what it said meanwhile, or why there is none."""

    model: Metamodel | None
    heard: Heard
    failure: Unanswered | None


class Workshop:
    """What levels share.

    Parameters
    ----------
    fingertip : Fingertip
        The atlas's own, before a level changes it.
    """

    def __init__(self, fingertip: Fingertip) -> None:
        self.fingertip = fingertip
        self._scenes: dict[Any, LinearScene] = {}
        self._truths: dict[Any, SecondOrderModel] = {}
        self._snapshots: dict[Any, xr.Dataset] = {}
        self._fitted: dict[Any, Fitted] = {}

    def scene(self, level: Level) -> LinearScene:
        """The level's scene; ValueError or AnatomyError where it cannot exist."""
        tip = level.change(self.fingertip)
        scene = get_scene(level.scene, tip) if level.make is None else level.make(tip)
        return self._scenes.setdefault(self._key(scene), scene)

    def truth(self, level: Level, scene: LinearScene) -> SecondOrderModel:
        """The matrices that decide, in a model that no method uses."""
        tip = fingertip_of(scene) if level.truth is None else level.truth(self.fingertip)
        key = (type(tip), tip, scene.harmonic)
        if key not in self._truths:
            self._truths[key] = SecondOrderModel(tip.stiffness, tip.mass if scene.harmonic else None)
        return self._truths[key]

    def fitted(self, level: Level, scene: LinearScene, name: str, settings: dict[str, Any]) -> Fitted:
        """The method on the level's scene, fitted once."""
        key = (*self._key(scene), name, json.dumps(settings, sort_keys=True), level.snapshots, level.threads)
        if key not in self._fitted:
            try:
                model, heard, _ = listen(lambda: self._fit(level, scene, name, settings))
                self._fitted[key] = Fitted(model, heard, None)
            except Unanswered as failure:
                self._fitted[key] = Fitted(None, Heard(), failure)
        return self._fitted[key]

    def _fit(self, level: Level, scene: LinearScene, name: str, settings: dict[str, Any]) -> Metamodel:
        model = create(name, scene, **settings)
        return model.fit(self._training(level, scene) if model.learns else None)

    def _training(self, level: Level, scene: LinearScene) -> xr.Dataset:
        key = (*self._key(scene), level.snapshots)
        if key not in self._snapshots:
            self._snapshots[key] = level.snapshots(scene)
        return self._snapshots[key]

    def forget(self) -> None:
        """Drop what belongs to changed fingertips: their levels are done."""
        for store in (self._scenes, self._snapshots, self._fitted, self._truths):
            for key in [key for key in store if key[1] != self.fingertip]:
                del store[key]

    @staticmethod
    def _key(scene: LinearScene) -> tuple:
        tip = fingertip_of(scene)
        return scene.name, tip, type(tip), scene.content_hash
