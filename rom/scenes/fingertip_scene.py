"""How a question about the fingertip becomes a scene: its body, its loads, its pad."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rom.bodies import Loads
from rom.checks import shown
from rom.fingertip import Anatomy, Fingertip, FingertipBody, MeshDensity
from rom.scenes.linear_scene import LinearScene
from rom.scenes.population import Population
from rom.scenes.question import Question
from rom.scenes.scene import Scene


def fingertip_scene(question: Question, fingertip: Fingertip, loads: Callable[[], Loads], population: Population,
                    outputs: str, *, identity: Callable[[], str] | None = None,
                    options: Callable[[], dict[str, Any]] | None = None) -> LinearScene:
    """A scene on a fingertip, of which nothing is computed yet.

    Parameters
    ----------
    question : Question
    fingertip : Fingertip
    loads : callable
    population : Population
    outputs : {"field", "pad"}
    identity : callable, optional
        Default: the fingertip's own digest.
    options : callable, optional
        JSON-able arguments that the scene's factory takes beside fingertip and outputs.
    """
    if not isinstance(fingertip, Fingertip):
        raise ValueError(f"the fingertip is {shown(fingertip)}: build one with rom.Fingertip")

    def pad() -> np.ndarray:
        dofs = (3 * fingertip.mesh.pad_nodes[:, None] + np.arange(3)).ravel()
        return np.searchsorted(fingertip.free_dofs, dofs)

    def parameters() -> dict[str, Any]:
        return {"formulation": fingertip.formulation, "rear": fingertip.rear, "anatomy": fingertip.anatomy.to_dict(),
                "density": fingertip.density.to_dict(), "options": options() if options else {}}

    return LinearScene(FingertipBody(fingertip, with_mass=question.harmonic), loads, question, population=population,
                       outputs=outputs, part=pad, identity=identity or (lambda: fingertip.content_hash),
                       parameters=parameters)


def fingertip_from(record: dict[str, Any]) -> Fingertip:
    """The fingertip of a record that a fingertip scene's ``to_json`` wrote."""
    return Fingertip(Anatomy.from_dict(record["anatomy"]), MeshDensity.from_dict(record["density"]),
                     formulation=record["formulation"], rear=record["rear"])


def fingertip_of(scene: Scene) -> Fingertip:
    """The fingertip that a scene asks; ValueError for a scene of another body."""
    body = getattr(scene, "body", None)
    if not isinstance(body, FingertipBody):
        raise ValueError(f"{scene.name} does not ask a fingertip: give one of its scenes")
    return body.fingertip


def normal_forces(fingertip: Fingertip) -> Callable[[], Loads]:
    """Unit forces along the inward normal at each pad node, made when they are asked for."""
    def loads() -> Loads:
        mesh = fingertip.mesh
        nodes = mesh.pad_nodes
        return Loads(np.asarray(fingertip.pad_loads.todense()), {"load_node": nodes}, mesh.nodes[nodes],
                     mesh.normals[np.searchsorted(mesh.skin_nodes, nodes)])
    return loads
