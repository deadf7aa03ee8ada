"""A followed path as a dataset: SI units, every assumption among the attributes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields

import numpy as np
import xarray as xr

from rom.finger_on_glass.finger import Finger
from rom.finger_on_glass.observation import Observation
from rom.finger_on_glass.path import PathAnswer
from rom.provenance import stamp

PATH, SKIN = ("position",), ("position", "skin_node")
MM, MPA, MM2, NMM = 1e-3, 1e6, 1e-6, 1e-3
"""To SI units."""
SCALARS: dict[str, tuple[Callable[[Observation], float], float, str, str]] = {
    "normal_force": (lambda o: o.normal_force, 1.0, "N", "force that presses the plate on"),
    "tangential_force": (lambda o: o.tangential_force, 1.0, "N", "force that moves the plate along"),
    "normal_displacement": (lambda o: o.normal_displacement, MM, "m", "approach of the plate since it touched"),
    "tangential_displacement": (lambda o: o.tangential_displacement, MM, "m", "travel of the plate along itself"),
    "left_edge": (lambda o: o.edges[0], MM, "m", "end of the contact at the leading side"),
    "right_edge": (lambda o: o.edges[1], MM, "m", "end of the contact at the trailing side"),
    "width": (lambda o: o.width, MM, "m", "width of the contact"),
    "area": (lambda o: o.area, MM2, "m2", "area of a circle as wide as the contact"),
    "peak_pressure": (lambda o: float(o.pressure.max()), MPA, "Pa", "largest pressure at a skin node"),
    "slipping": (lambda o: o.slipping, 1.0, "1", "skin nodes that slip"),
    "touching": (lambda o: o.touching, 1.0, "1", "skin nodes that touch the plate"),
    "stretch_z": (lambda o: o.state.stretch_z, 1.0, "1", "out-of-plane stretch"),
    "largest_fibre": (lambda o: o.largest_fibre, 1.0, "1", "largest lambda^2 - 1 of a fibre"),
    "energy": (lambda o: o.energy, NMM, "J", "stored in tissue, out-of-plane spring and penalties"),
    "work": (lambda o: o.work, NMM, "J", "done by the plate since the path began"),
    "dissipated": (lambda o: o.dissipated, NMM, "J", "by friction and viscous resistance since the path began"),
    "viscosity": (lambda o: o.viscosity, MPA, "Pa", "viscous resistance in the last step"),
    "iterations": (lambda o: o.iterations, 1.0, "1", "Newton iterations since the path began"),
    "steps": (lambda o: o.steps, 1.0, "1", "converged steps since the path began"),
}


def recorded(finger: Finger, answer: PathAnswer) -> xr.Dataset:
    """Everything that was observed at the path's positions, and the last converged step of a path that ended early.

    Parameters
    ----------
    finger : Finger
    answer : PathAnswer

    Returns
    -------
    xr.Dataset
        Scalars over ``position``; ``displacement`` (position, node, component); ``pressure`` and ``shear`` (position,
        skin_node); the mesh; attributes ``complete`` (0 or 1), ``reason`` and every setting.
    """
    seen = list(answer.observations)
    if answer.last is not None and not answer.complete and (not seen or seen[-1] is not answer.last):
        seen.append(answer.last)
    mesh = finger.mesh
    data: dict[str, tuple] = {
        name: (PATH, scale * np.array([float(read(o)) for o in seen]), {"long_name": words, "units": units})
        for name, (read, scale, units, words) in SCALARS.items()}

    def stacked(values: Sequence[np.ndarray], shape: tuple[int, ...]) -> np.ndarray:
        return np.stack(values) if len(values) else np.empty((0, *shape))

    n_node, n_skin = len(mesh.nodes), len(mesh.skin_nodes)
    data |= {
        "displacement": (("position", "node", "component"), MM * stacked([o.state.displacement for o in seen],
                                                                        (n_node, 2)), {
            "long_name": "displacement", "units": "m"}),
        "pressure": (SKIN, MPA * stacked([o.pressure for o in seen], (n_skin,)), {
            "long_name": "pressure over the deformed skin", "units": "Pa"}),
        "shear": (SKIN, MPA * stacked([o.shear for o in seen], (n_skin,)), {
            "long_name": "shear over the deformed skin, positive where the plate drags it towards +x", "units": "Pa"}),
        "quads": (("quad", "corner"), mesh.quads, {"long_name": "corners of the elements", "units": "1"}),
        "skin": (("skin_node",), mesh.skin_nodes, {"long_name": "node at the skin", "units": "1"}),
    }
    coords = {"component": ["x", "y"], **{f"node_{axis}": ("node", MM * mesh.nodes[:, k], {
        "long_name": f"{axis} of an undeformed node", "units": "m"}) for k, axis in enumerate("xy")}}
    return xr.Dataset(data, coords=coords, attrs=stamp(
        complete=int(answer.complete), reason=answer.reason, **settings(finger)))  # type: ignore[arg-type]


def settings(finger: Finger) -> dict[str, str | int | float]:
    """Every input of the model, by dotted names; lengths in mm, stresses in MPa, as the model takes them."""
    values: dict[str, str | int | float] = {"rays": finger.rays, "layers": finger.layers}
    for part in ("section", "tissue", "plate", "out_of_plane"):
        one = getattr(finger, part)
        values |= {f"{part}.{entry.name}": getattr(one, entry.name) for entry in fields(one)}
    return values
