"""Frequency response of a loaded patch: receptances over frequency and direction, for any method of the scene.

A receptance is displacement amplitude over force amplitude. Serhat and Kuchenbecker 2021 (section 5.2) average the
displacement over the nodes where the force acts, and over all moving nodes of the model. Their curves are magnitudes,
here ``sqrt(|u_x|^2 + |u_y|^2 + |u_z|^2)`` of the complex amplitudes at a node, then the mean over nodes: that is the
modulus of a receptance here, blind to direction; its argument is that of the same nodes' mean displacement along the
force. Beside it stands the complex driving-point receptance, the mean displacement of the loaded nodes along the force
over the force: its imaginary part is the power put in.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence

import numpy as np
import xarray as xr

from rom.fingertip import DIRECTIONS
from rom.metamodels.metamodel import Metamodel
from rom.scenes import CaseArrays, LinearScene
from rom.scenes.cases import finite
from rom.scenes.fingertip_scene import fingertip_of

MEASURES = ("excitation", "whole")
"""Mean over the loaded nodes, mean over all moving nodes."""
BLOCK = 63
"""Cases whose fields exist at once, a multiple of three directions: 32 MB on the study mesh."""
Watch = Callable[[slice, np.ndarray], None]


def sweep_cases(scene: LinearScene, frequency: Sequence[float] | np.ndarray,
                directions: Sequence[str] = DIRECTIONS, *, node: int | None = None, amplitude: float = 0.1,
                loss_factor: float = 0.1) -> CaseArrays:
    """One force after another in each direction at each frequency, directions fastest.

    Parameters
    ----------
    scene : LinearScene
    frequency : (n,) array_like [Hz]
    directions : sequence of str
        Of `rom.fingertip.DIRECTIONS`.
    node : int, optional
        A site of the scene; default: its first.
    amplitude : float [N]
        Summed over the patch.
    loss_factor : float [1]

    Returns
    -------
    CaseArrays
        ``n * len(directions)`` cases, so that those of one frequency share a factorization.

    Raises
    ------
    ValueError
        For an empty sweep, a value that is not finite or negative, a force of zero, an unknown direction or site.
    """
    points = np.atleast_1d(np.asarray(frequency, dtype=float))
    if points.ndim != 1 or not points.size:
        raise ValueError("the sweep has no frequency: give one or more, in Hz")
    if not directions or len(set(directions)) != len(directions):
        raise ValueError(f"directions={list(directions)} cannot be swept: name each of {', '.join(DIRECTIONS)} at most "
                         "once, and one at least")
    for name, value, unit in (("frequency", points, "Hz"), ("loss factor", loss_factor, "1"),
                              ("force amplitude", amplitude, "N")):
        values = np.atleast_1d(np.asarray(value, dtype=float))
        wrong = ~np.isfinite(values) | (values < 0)
        if wrong.any():
            raise ValueError(f"the {name} {values[wrong][0]:g} {unit} cannot be: give a finite number, zero or more")
        finite(values, name, unit)
    if amplitude == 0:
        raise ValueError("the force amplitude is zero and moves nothing: give a positive number of N")
    site = scene.loads.labels["load_node"][0] if node is None else node
    loads = np.array([scene.load_index(site, direction) for direction in directions])
    count = len(points) * len(loads)
    return CaseArrays(np.tile(loads, len(points))[:, None], np.full((count, 1), float(amplitude)),
                      np.repeat(points, len(loads)), np.full(count, float(loss_factor)))


def moving_nodes(scene: LinearScene) -> np.ndarray:
    """(n_free / 3,) ndarray of int: nodes that neither bone nor a fixed rear holds, in the order of the free dofs."""
    return fingertip_of(scene).free_dofs[::3] // 3


def magnitudes(values: np.ndarray) -> np.ndarray:
    """(n_case, n_moving) ndarray [m]: ``sqrt(sum |component|^2)`` of fields (n_case, n_free) at each moving node."""
    parts = np.square(values.real)
    parts += np.square(values.imag)
    return np.sqrt(parts.reshape(len(values), -1, 3).sum(axis=2))


def receptances(scene: LinearScene, cases: CaseArrays, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Receptances of answers to single forces.

    Parameters
    ----------
    scene : LinearScene
    cases : CaseArrays
        One force each.
    values : (n_case, n_free) ndarray [m]

    Returns
    -------
    receptance : (n_case, 2) ndarray, complex [m/N]
        In the order of `MEASURES`: mean magnitude, with the phase of the mean displacement along the force.
    driving_point : (n_case,) ndarray, complex [m/N]
        Mean displacement of the loaded nodes along the force, over the force.

    Raises
    ------
    ValueError
        For cases of several forces, whose receptance would mean nothing.
    """
    if cases.node.shape[1] != 1:
        raise ValueError(f"the cases have {cases.node.shape[1]} forces each: a receptance belongs to one force")
    moving, size = moving_nodes(scene), magnitudes(values)
    force = np.abs(cases.force[:, 0])
    receptance = np.empty((len(cases), len(MEASURES)), dtype=complex)
    driving = np.empty(len(cases), dtype=complex)
    mean = values.reshape(len(values), -1, 3).mean(axis=1)
    for load in np.unique(cases.node):
        mine = cases.node[:, 0] == load
        centre = int(scene.loads.labels["load_node"][load])
        loaded = np.searchsorted(moving, fingertip_of(scene).mesh.skin_patch(centre))
        along = fingertip_of(scene).skin_frame(centre)[DIRECTIONS[load % len(DIRECTIONS)]]
        # the unit load is the direction shared equally by the patch's nodes: its product is their mean along it
        column = scene.unit_loads[:, load]
        rows = np.flatnonzero(column)
        driving[mine] = values[np.ix_(mine, rows)] @ column[rows] / cases.force[mine, 0]
        for k, (magnitude, phasor) in enumerate(((size[np.ix_(mine, loaded)].mean(axis=1), driving[mine]),
                                                 (size[mine].mean(axis=1), mean[mine] @ along / cases.force[mine, 0]))):
            receptance[mine, k] = magnitude / force[mine] * np.exp(1j * np.angle(phasor))
    return receptance, driving


def frequency_response(model: Metamodel, frequency: Sequence[float] | np.ndarray,
                       directions: Sequence[str] = DIRECTIONS, *, node: int | None = None, amplitude: float = 0.1,
                       loss_factor: float = 0.1, watch: Watch | None = None,
                       progress: Callable[[Iterable], Iterable] = iter) -> xr.Dataset:
    """Receptances over frequency and direction; the full field is computed block by block and never kept.

    Parameters
    ----------
    model : Metamodel
        Fitted, of the scene `harmonic-patch-forces`.
    frequency, directions, node, amplitude, loss_factor
        See `sweep_cases`.
    watch : callable, optional
        Given each block's cases as a slice and its fields (n_case, n_free) [m], to look at while they exist.
    progress : callable
        Wraps the iteration over blocks, to show a bar.

    Returns
    -------
    xr.Dataset
        ``receptance`` (direction, frequency, measure), ``driving_point_receptance`` (direction, frequency), both
        complex [m/N], ``sweep_seconds`` () [s]: the fields alone, without what is read off them.

    Raises
    ------
    ValueError
        For a model of another scene, or what `sweep_cases` refuses.
    NotFittedError
    """
    scene = model.scene
    if scene.name != "harmonic-patch-forces":
        raise ValueError(f"{model.name} answers {scene.name}: a frequency response needs the scene "
                         "harmonic-patch-forces")
    cases = sweep_cases(scene, frequency, directions, node=node, amplitude=amplitude, loss_factor=loss_factor)
    receptance = np.empty((len(cases), len(MEASURES)), dtype=complex)
    driving = np.empty(len(cases), dtype=complex)
    field: np.ndarray | None = None
    seconds = 0.0
    for first in progress(range(0, len(cases), BLOCK)):
        part = slice(first, min(first + BLOCK, len(cases)))
        block = cases.take(part)
        start = time.perf_counter()
        field = model.evaluate(block, "field", field if field is not None and len(field) == len(block) else None)
        seconds += time.perf_counter() - start
        receptance[part], driving[part] = receptances(scene, block, field)
        if watch is not None:
            watch(part, field)
    return response_dataset(frequency, directions, receptance, driving).assign(
        sweep_seconds=((), seconds, {"long_name": "wall time of the fields of the whole sweep", "units": "s"}))


def response_dataset(frequency: Sequence[float] | np.ndarray, directions: Sequence[str], receptance: np.ndarray,
                     driving: np.ndarray) -> xr.Dataset:
    """Labels for what `receptances` found of the cases of a sweep; see `frequency_response`."""
    shape = (len(np.atleast_1d(frequency)), len(directions))
    return xr.Dataset({
        "receptance": (("direction", "frequency", "measure"),
                       receptance.reshape(*shape, len(MEASURES)).transpose(1, 0, 2), {
            "long_name": "mean displacement magnitude over force amplitude, with the phase of the mean displacement "
                         "along the force", "units": "m N-1"}),
        "driving_point_receptance": (("direction", "frequency"), driving.reshape(shape).T, {
            "long_name": "mean displacement of the loaded nodes along the force over the force", "units": "m N-1"})},
        coords={
            "direction": ("direction", list(directions), {"long_name": "direction of the force"}),
            "frequency": ("frequency", np.atleast_1d(np.asarray(frequency, dtype=float)), {
                "long_name": "excitation frequency", "units": "Hz"}),
            "measure": ("measure", list(MEASURES), {"long_name": "mean over the loaded nodes, over all moving nodes"})})
