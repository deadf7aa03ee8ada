"""How far the truth itself is from a finer mesh: errors below this are not more right."""

from __future__ import annotations

import json

import numpy as np

from rom.cache import cached_path
from rom.comparison.errors import of_cases
from rom.comparison.truth import Tests, take
from rom.datasets import SPLITS
from rom.files import whole_file
from rom.metamodels import applicable, metamodel_class
from rom.provenance import source_digest
from rom.scenes import Scene

CASES = 4
"""Cases that are solved on the finer mesh."""


def mesh_floor(scene: Scene, tests: Tests) -> dict[str, tuple]:
    """Variables ``mesh_floor_median`` and ``mesh_floor_max``; none where the body has no other mesh."""
    if applicable(scene)["coarse-fem"] is not None:
        return {}
    kind = metamodel_class("coarse-fem", scene)
    rows = np.arange(len(tests.number)) if scene.extent.floor_on_all else np.flatnonzero(tests.tested[SPLITS[0]])
    truth = take(tests.values, rows)
    judged = truth[scene.quantity] if isinstance(truth, dict) else truth
    whole = np.isfinite(judged).reshape(len(rows), -1).all(axis=1)
    rows = rows[whole & scene.same_on_any_mesh(tests.arrays.take(rows))]
    rows = rows[np.linspace(0, len(rows) - 1, min(CASES, len(rows))).astype(int)]
    cases, scale = tests.arrays.take(rows), scene.extent.floor_scale
    path = cached_path("floors", {
        "content": scene.content_hash, "scene": scene.name, "scale": scale,
        "cases": [None if values is None else values.tolist() for values in cases],
        "source": source_digest(kind.__module__, type(scene).__module__)}, ".json")
    if path.exists():
        errors = np.array(json.loads(path.read_text(encoding="utf-8")))
    else:
        finer = kind(scene, scale=scale).fit()
        found = scene.errors(cases, finer.evaluate(cases, "field"), take(tests.values, rows))
        errors = of_cases(next(iter(found.values())))
        with whole_file(path) as temporary:
            temporary.write_text(json.dumps(errors.tolist()), encoding="utf-8")
    text = f"relative difference of a {scene.case_noun} to a mesh {scale:g} times as fine along each edge"
    return {f"mesh_floor_{name}": ((), float(summary(errors)), {"long_name": f"{name} {text}", "units": "1"})
            for name, summary in (("median", np.median), ("max", np.max))}
