"""The worst held-out case of an entry, truth and answer: in space where the scene has a grid, along its positions."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from rom.bodies import Grid
from rom.comparison.entries import Entry
from rom.comparison.truth import Tests, take
from rom.metamodels import Metamodel
from rom.scenes import Scene

ENDS = {"truth": "full-order model", "answer": "metamodel"}


def worst_case(model: Metamodel, scene: Scene, tests: Tests, rows: np.ndarray, errors: np.ndarray) -> dict[str, Any]:
    """What is told of the worst of some cases.

    Parameters
    ----------
    rows : (k,) ndarray of int
        Positions among the tests.
    errors : (k, ...) ndarray
        Of the judged quantity, by position where a case has any.

    Returns
    -------
    dict
        ``error``; ``field_truth`` and ``field_answer`` (n_node, n_component) at the nodes that are drawn; ``position``
        and the quantities that the scene tells along it.
    """
    filled = np.where(np.isnan(errors), -1.0, errors)
    at = np.unravel_index(filled.argmax(), filled.shape)
    row = slice(rows[at[0]], rows[at[0]] + 1)
    whole = {"truth": take(tests.values, row), "answer": model.evaluate(tests.arrays.take(row), "field")}
    found: dict[str, Any] = {"error": float(errors[at])}
    for end, values in whole.items():
        plain = values if isinstance(values, dict) else {scene.quantity: values}
        if scene.grid is not None and len(scene.grid.skin):
            field = scene.whole(plain[scene.quantity])[0][at[1:]]
            found[f"field_{end}"] = field[np.unique(scene.grid.skin)]
        found |= {f"{short}_{end}": plain[name][0] for short, name in scene.told_along.items()}
    return found | ({"position": int(at[1])} if len(at) > 1 else {})


def worst_variables(entries: list[Entry], scene: Scene) -> xr.Dataset:
    """Variables of the results, of the entries that speak for their methods."""
    headline = [entry for entry in entries if entry.headline]
    found = [entry.facts["judged"].worst for entry in headline]

    def stacked(name: str) -> np.ndarray:
        return np.array([one[name] for one in found])

    data: dict[str, tuple] = {"worst_error": ("worst", stacked("error"), {
        "long_name": f"relative error of the worst {scene.case_noun}", "units": "1"})}
    coordinates: dict[str, Any] = {"worst": [entry.label for entry in headline]}
    if scene.grid is not None and len(scene.grid.skin):
        noun = "skin" if scene.grid.nodes.shape[1] == 3 else "section"
        stem = "worst" if noun == "skin" else f"worst_{noun}"
        quantity = scene.quantities[scene.quantity]
        data |= {f"{stem}_{end}": (("worst", f"{noun}_node", "component"), stacked(f"field_{end}"), {
            "long_name": f"{quantity.long_name}, {text}", "units": quantity.unit}) for end, text in ENDS.items()}
        data[f"{noun}_quads"], places = _surface(scene.grid, noun)
        coordinates |= {"component": list(scene.grid.components), **places}
    for short, name in scene.told_along.items():
        quantity = scene.quantities[name]
        data |= {f"worst_{short}_{end}": (("worst", "position"), stacked(f"{short}_{end}"), {
            "long_name": f"{quantity.long_name}, {text}", "units": quantity.unit}) for end, text in ENDS.items()}
    if "position" in found[0]:
        data["worst_position"] = ("worst", stacked("position"), {
            "long_name": "position of the worst state", "units": "1"})
    return xr.Dataset(data, coordinates)


def _surface(grid: Grid, noun: str) -> tuple[tuple, dict[str, tuple]]:
    """Faces that are drawn, and where their nodes lie."""
    nodes = np.unique(grid.skin)
    places = {f"{noun}_{axis}": (f"{noun}_node", grid.nodes[nodes, k], {"long_name": f"{axis} of a node", "units": "m"})
              for k, axis in enumerate("xyz"[:grid.nodes.shape[1]])}
    names = {f"{noun}_node": (f"{noun}_node", grid.node_names[nodes], {"long_name": "mesh node", "units": "1"})}
    return ((f"{noun}_quad", "corner"), np.searchsorted(nodes, grid.skin), {
        "long_name": "corners of a face", "units": "1"}), {**names, **places}
