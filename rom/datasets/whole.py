"""The whole published harmonic set, every pad node at every frequency and loss factor, made by a verified ROM.

Direct solves of 645,300 cases would take weeks. Galerkin on modes and load-dependent vectors answers them with a true
residual ||Z u - f|| / ||f|| that is as small as a direct solve's own, and says so: it is computed in every case, and
cases drawn at random are solved directly beside. What is stored are poles and shapes (:mod:`rom.datasets.reduced`).
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.datasets.pieces import pieces_of
from rom.datasets.reduced import SHAPE_DIMS, STORAGE
from rom.datasets.schema import dataset_attributes, mesh_variables
from rom.datasets.snapshots import Progress, solver_sources
from rom.datasets.splits import split_variables
from rom.datasets.storage import open_netcdf, read_netcdf, write_in_blocks, write_netcdf
from rom.datasets.verified_rom import kept_modes, make_piece, pole_coefficients
from rom.errors import SolverError
from rom.files import is_intact
from rom.fullorder import Modes
from rom.provenance import stamp
from rom.scenes import CaseArrays, LinearScene
from rom.scenes.harmonic_point_force import AMPLITUDE, PublishedGrid, published_points
from rom.scenes.population import CASES_PER_POINT

ERROR_LIMIT = 1e-6
"""Largest error of a stored case against its direct solve."""
SIZES = {False: (40, 10), True: (80, 12)}
"""Modes and vectors that keep the residual below its limit up to 300 Hz, and up to 400 Hz."""
LOADS_PER_PIECE = 24
PRECISIONS = {"float64": np.float64, "float32": np.float32}


@dataclass(frozen=True)
class WholeSet:
    """Every pad node at every operating point, node by node; those beyond the published ranges last.

    Parameters
    ----------
    scene : LinearScene
    within, beyond : (n_point, 2) ndarray
        Frequencies [Hz] and loss factors.
    """

    scene: LinearScene
    within: np.ndarray
    beyond: np.ndarray

    @property
    def points(self) -> np.ndarray:
        """(n_point, 2) ndarray: all of them."""
        return np.concatenate([self.within, self.beyond])

    @property
    def n_within(self) -> int:
        """Cases within the published ranges."""
        return self.scene.n_loads * len(self.within)

    def arrays(self) -> CaseArrays:
        """The inputs of every case, each with the largest published force."""
        def block(points: np.ndarray) -> CaseArrays:
            node = np.repeat(np.arange(self.scene.n_loads), len(points))[:, None]
            each = np.tile(points, (self.scene.n_loads, 1))
            return CaseArrays(node, np.full(node.shape, AMPLITUDE[1]), each[:, 0].copy(), each[:, 1].copy())

        whole = block(self.within)
        return whole.joined(block(self.beyond)) if len(self.beyond) else whole

    def by_case(self, values: np.ndarray) -> np.ndarray:
        """(n_case,) ndarray in the order of :meth:`arrays`, from values (n_load, n_point)."""
        inside = len(self.within)
        return np.concatenate([values[:, :inside].ravel(), values[:, inside:].ravel()])

    def case_number(self, node: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Positions in :meth:`arrays` of nodes (rows of the pad) at operating points (rows of :attr:`points`)."""
        inside = len(self.within)
        return np.where(point < inside, node * inside + point,
                        self.n_within + node * len(self.beyond) + point - inside)


def make_whole_dataset(scene: LinearScene, path: str | Path, *, beyond: bool = False, seed: int = 0,
                       modes: int | None = None, vectors: int | None = None, precision: str = "float64",
                       confirm: int = 304, progress: Progress = iter) -> Path:
    """Make every case of the published harmonic grid, verified and stored reduced; resumable.

    Parameters
    ----------
    scene : LinearScene
    path : path
    beyond : bool
        Also 301-400 Hz, and the loss factors 0.05 and 0.6.
    seed : int
        Decides the splits, and which cases are solved directly.
    modes, vectors : int, optional
        Natural modes that all loads share, and load-dependent vectors of each; default: :data:`SIZES`.
    precision : {"float64", "float32"}
        Of the stored shapes. The residual is that of double precision; what single precision adds is stated.
    confirm : int
        Cases drawn at random to be solved directly.
    progress : callable
        Wraps the iteration over pieces, to show a bar.

    Raises
    ------
    ValueError
        For another scene, or settings that cannot be.
    SolverError
        Where a residual exceeds :data:`rom.datasets.verified_rom.RESIDUAL_LIMIT`, or an error against a direct solve
        :data:`ERROR_LIMIT`.
    SchemaError, FileExistsError, IsADirectoryError, OSError
        As in :func:`rom.datasets.make_dataset`.
    """
    if not isinstance(getattr(scene, "population", None), PublishedGrid):
        raise ValueError(f"{scene.name} has no whole harmonic grid, only harmonic-point-force has: draw "
                         "cases with make_dataset")
    modes, vectors = (default if given is None else given
                      for given, default in zip((modes, vectors), SIZES[beyond], strict=True))
    if min(modes, vectors, confirm) < 1 or precision not in PRECISIONS:
        raise ValueError(f"modes={modes}, vectors={vectors}, confirm={confirm}, precision={precision!r} cannot be: "
                         f"give numbers of one or more, and one of {', '.join(PRECISIONS)}")
    path = Path(path)
    none = np.empty((0, 2))
    whole = WholeSet(scene, published_points(), published_points(beyond=True) if beyond else none)
    recipe = {"scene": json.loads(scene.to_json()), "content": scene.content_hash, "whole": True, "beyond": beyond,
              "seed": seed, "modes": modes, "vectors": vectors, "precision": precision, "confirm": confirm,
              "source": solver_sources(scene)}
    with pieces_of(path, recipe, "cases") as folder:
        if folder is None:
            return path
        blocks = np.array_split(np.arange(scene.n_loads), -(-scene.n_loads // LOADS_PER_PIECE))
        files = [folder / f"{k:05d}.nc" for k in range(len(blocks))]
        for k in progress(range(len(blocks))):
            if not is_intact(files[k]):
                make_piece(scene, kept_modes(scene, modes, folder / "modes.nc"), blocks[k], vectors, whole.points,
                           files[k])
        if not is_intact(folder / "confirmed.nc"):
            _confirm(scene, kept_modes(scene, modes, folder / "modes.nc"), whole, files, confirm, seed, precision,
                     folder / "confirmed.nc")
        _assemble(whole, folder, files, path, recipe)
    return path


def find_whole(scene: LinearScene, *, beyond: bool, seed: int, progress: Progress = iter) -> Path:
    """The whole dataset of a scene from the cache, made if it is not there; see :func:`make_whole_dataset`."""
    path = cached_path("datasets", {"whole": True, "content": scene.content_hash, "scene": scene.to_json(),
                                    "beyond": beyond, "seed": seed, "source": solver_sources(scene)})
    return make_whole_dataset(scene, path, beyond=beyond, seed=seed, progress=progress)


# ---- direct solves beside -------------------------------------------------------------------------------------

def _confirm(scene: LinearScene, modes: Modes, whole: WholeSet, files: list[Path], count: int, seed: int,
             precision: str, path: Path) -> None:
    """Solve random cases directly, several nodes to one factorization, and keep the errors."""
    start = time.perf_counter()
    rng = np.random.default_rng([seed, 24])
    points = whole.points
    chosen = rng.choice(len(points), size=min(len(points), -(-count // CASES_PER_POINT)), replace=False)
    # shuffled pads one after another, so that nodes are drawn equally often, never twice at one point
    each = min(CASES_PER_POINT, scene.n_loads)
    node = np.concatenate([rng.permutation(scene.n_loads)[:each] for _ in chosen])
    point = np.repeat(chosen, each)
    arrays = CaseArrays(node[:, None], np.full((len(node), 1), AMPLITUDE[1]), points[point, 0].copy(),
                        points[point, 1].copy())
    truth = scene.solve(arrays)[0]["displacement"]
    error, residual = np.empty(len(node)), np.empty(len(node))
    kind = PRECISIONS[precision]
    for file in files:
        data = read_netcdf(file)
        for i, load in enumerate(_loads_of(files, file, scene.n_loads)):
            mine = np.flatnonzero(node == load)
            if not len(mine):
                continue
            coefficients = AMPLITUDE[1] * pole_coefficients(
                modes.eigenvalue, data["participation"].values[i], data["theta"].values[i], data["share"].values[i],
                points[point[mine]])
            shapes = np.concatenate([modes.shape.T, data["vector"].values[i]]).astype(kind).astype(float)
            answer = coefficients @ shapes
            error[mine] = (np.linalg.norm(answer - truth[mine], axis=1) / np.linalg.norm(truth[mine], axis=1))
            residual[mine] = data["residual"].values[i, point[mine]]
    if not error.max() <= ERROR_LIMIT:
        raise SolverError(f"a case differs from its direct solve by {error.max():.1e}, above {ERROR_LIMIT:g}: give "
                          "more modes or vectors, or store in double precision")
    write_netcdf(xr.Dataset({"node": ("confirmed", node), "point": ("confirmed", point), "error": ("confirmed", error)},
                            attrs={"seconds": time.perf_counter() - start}), path)


def _loads_of(files: list[Path], file: Path, n_load: int) -> np.ndarray:
    return np.array_split(np.arange(n_load), len(files))[files.index(file)]


# ---- the file -------------------------------------------------------------------------------------------------

def _assemble(whole: WholeSet, folder: Path, files: list[Path], path: Path, recipe: dict) -> None:
    """Write the dataset from its pieces, one after another."""
    scene, arrays = whole.scene, whole.arrays()
    modes, confirmed = read_netcdf(folder / "modes.nc"), read_netcdf(folder / "confirmed.nc")
    kind, grid = PRECISIONS[recipe["precision"]], scene.grid
    assert grid is not None  # the published scene has a mesh
    width = len(grid.components)
    small: dict[str, list[np.ndarray]] = {name: [] for name in (
        "theta", "share", "participation", "residual", "difference")}
    seconds = float(confirmed.attrs["seconds"])
    for file in files:
        with open_netcdf(file) as piece:
            seconds += float(piece.attrs["seconds"])
            for name, parts in small.items():
                parts.append(piece[name].values)
    table = {name: np.concatenate(parts) for name, parts in small.items()}
    residual = whole.by_case(table["residual"])
    single = float(table["difference"].max())
    frame = scene.cases_from(arrays).assign(split_variables(scene, arrays, whole.n_within, recipe["seed"]))
    frame = frame.assign_coords(scene.coordinates()).assign({
        "residual": ("case", residual, {
            "long_name": "relative residual ||Z u - f|| / ||f|| of the answer in double precision", "units": "1"}),
        "solve_seconds": ("case", np.full(len(arrays), seconds / len(arrays)), {
            "long_name": "wall time of making and checking all cases, shared equally", "units": "s"}),
        "node_of_load": ("load", scene.loads.labels["load_node"].astype(np.int32), {
            "long_name": "mesh node whose load the own shapes answer", "units": "1"}),
        "mode_shape": (("mode", "dof"), modes["shape"].values.T.astype(kind), {
            "long_name": "mass-orthonormal mode shape", "units": "kg-0.5"}),
        "eigenvalue": ("mode", modes["eigenvalue"].values, {
            "long_name": "squared angular frequency", "units": "rad2 s-2"}),
        "participation": (("load", "mode"), table["participation"], {
            "long_name": "mode shape times unit load", "units": "kg-0.5"}),
        "own_theta": (("load", "vector"), table["theta"], {"long_name": "reciprocal Ritz value", "units": "s2"}),
        "own_share": (("load", "vector"), table["share"], {"long_name": "share of the load", "units": "J0.5 N-1"}),
        "node_of_dof": ("dof", grid.node_names[grid.free // width], {
            "long_name": "mesh node of the degree of freedom", "units": "1"}),
        "component_of_dof": ("dof", np.array(grid.components)[grid.free % width], {
            "long_name": "component of the degree of freedom"}),
        "confirmed_case": ("confirmed", whole.case_number(confirmed["node"].values, confirmed["point"].values), {
            "long_name": "case that was solved directly beside", "units": "1"}),
        "confirmed_error": ("confirmed", confirmed["error"].values, {
            "long_name": "relative error of the stored answer against the direct solve", "units": "1"}),
        **mesh_variables(grid)})
    frame.attrs = {
        **dataset_attributes(scene), **stamp(), "recipe": json.dumps(recipe), "storage": STORAGE,
        **{f"{dim}s": np.int32(size) for dim, size in zip(SHAPE_DIMS, (
            len(modes["eigenvalue"]), scene.n_loads, recipe["vectors"], scene.n_free), strict=True)},
        "storage_formula": "u = sum_k mode_shape_k participation_k F / (eigenvalue_k (1 + i eta) - omega^2) + "
                           "sum_p own_shape_p own_share_p F / (1 + i eta - omega^2 own_theta_p)",
        "residual_max": float(residual.max()), "confirmed_error_max": float(confirmed["error"].max()),
        "precision": recipe["precision"], "precision_error_max": single if recipe["precision"] == "float32" else 0.0,
        "single_precision_error_max": single, "offline_seconds": seconds}

    def blocks() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        for file in files:
            yield _loads_of(files, file, scene.n_loads), read_netcdf(file)["vector"].values.astype(kind)

    write_in_blocks(frame, path, "own_shape", ("load", "vector", "dof"), np.dtype(kind), {
        "long_name": "load-dependent vector, K-orthonormal", "units": "m J-0.5",
        "displacement_name": scene.quantities["displacement"].long_name}, blocks())
