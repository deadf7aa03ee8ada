"""Snapshots: cases of a scene with the full-order model's answers, made in resumable pieces.

Each finished piece is a whole small file in ``FILE.pieces/``; a killed run finds them again and solves only what is
missing. The final file is assembled under a temporary name and renamed, then the pieces are removed.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.datasets.pieces import begin_or_resume
from rom.datasets.schema import dataset_attributes, mesh_variables
from rom.datasets.splits import split_variables
from rom.datasets.storage import open_netcdf, read_netcdf, write_in_blocks, write_netcdf
from rom.errors import SolverError
from rom.provenance import source_digest, stamp
from rom.scenes import CaseArrays, Scene

RESIDUAL_LIMIT = 1e-10
"""Largest relative residual ||Z u - f|| / ||f|| with which an answer is stored as truth."""
PIECE_CASES = 64
Progress = Callable[[Iterable], Iterable]
MOST_CASES = 10_000_000
"""Of one dataset; every case is drawn before the first is solved."""


def draw_cases(scene: Scene, count: int, beyond: int = 0, seed: int = 0) -> tuple[CaseArrays, xr.Dataset]:
    """``count`` cases within the published ranges and ``beyond`` outside them, with both splits.

    Returns
    -------
    arrays : CaseArrays
    cases : xr.Dataset
        The same, labelled, with ``split_published``, ``split_hard`` and ``hard_region``.

    Raises
    ------
    ValueError
        For a count below one or above :data:`MOST_CASES`.
    """
    if count < 1 or beyond < 0:
        raise ValueError(f"{count} cases and {beyond} beyond the ranges cannot be drawn: ask for at least one case")
    if max(count, beyond) > MOST_CASES:
        raise ValueError(f"{max(count, beyond)} cases are more than the {MOST_CASES} that are drawn at once: "
                         "ask for fewer")
    arrays = scene.sample(count, seed)
    if beyond:
        arrays = concatenate(arrays, scene.sample_beyond(beyond, seed))
    cases = scene.cases_from(arrays)
    return arrays, cases.assign(split_variables(scene, arrays, count, seed))


def concatenate(first: CaseArrays, second: CaseArrays) -> CaseArrays:
    """One block of cases after another, padded to the same number of forces."""
    width = max(first.node.shape[1], second.node.shape[1])
    def pad(a: np.ndarray) -> np.ndarray:
        return np.pad(a, ((0, 0), (0, width - a.shape[1])))
    def join(a, b):
        return None if a is None else np.concatenate([a, b])
    return CaseArrays(np.concatenate([pad(first.node), pad(second.node)]),
                      np.concatenate([pad(first.force), pad(second.force)]),
                      join(first.frequency, second.frequency), join(first.loss_factor, second.loss_factor))


def solve_cases(scene: Scene, arrays: CaseArrays) -> tuple[np.ndarray, np.ndarray]:
    """Direct answers and their relative residuals, one factorization a group.

    Returns
    -------
    displacement : (n_case, n_free) ndarray [m]
    residual : (n_case,) ndarray
        ``||Z u - f|| / ||f||``.

    Raises
    ------
    SolverError
        Where a residual stays above :data:`RESIDUAL_LIMIT`.
    """
    model = scene.full_order
    values = np.empty((len(arrays), scene.n_free), dtype=scene.dtype)
    residual = np.empty(len(arrays))
    for group in scene.groups(arrays):
        block = arrays.take(group)
        force = scene.force_vectors(block)
        if scene.harmonic:
            point = float(block.frequency[0]), float(block.loss_factor[0])
            answer = model.solve_harmonic(force, *point)
            residual[group] = model.residual(answer, force, *point)
        else:
            answer = model.solve_static(force)
            residual[group] = model.residual(answer, force)
        values[group] = answer.T
    if not (residual <= RESIDUAL_LIMIT).all():
        worst = int(np.argmax(residual))
        raise SolverError(f"case {worst} was solved with relative residual {residual[worst]:.1e}, above "
                          f"{RESIDUAL_LIMIT:g}: the matrix is too ill-conditioned for a direct truth")
    return values, residual


def make_dataset(scene: Scene, count: int, path: str | Path, *, beyond: int = 0, seed: int = 0,
                 compress: bool = False, progress: Progress = iter) -> Path:
    """Make the dataset ``path``, or finish the one whose pieces an earlier run left.

    Parameters
    ----------
    count, beyond : int
        Cases within and outside the published ranges.
    progress : callable
        Wraps the iteration over pieces, to show a bar.

    Raises
    ------
    SchemaError
        Where pieces of another recipe lie at the same place.
    FileExistsError
        Where the file exists and was made from another recipe, or is no dataset: nothing is overwritten.
    OSError
        Where the disk is full; finished pieces stay and the next run goes on from them.
    """
    arrays, cases = draw_cases(scene, count, beyond, seed)
    recipe = {"scene": json.loads(scene.to_json()), "cases": count, "beyond": beyond, "seed": seed,
              "source": solver_sources()}
    return _make(scene, arrays, cases, Path(path), recipe, compress, progress)


def solve_dataset(scene: Scene, arrays: CaseArrays, path: str | Path | None = None, *, compress: bool = False,
                  progress: Progress = iter) -> Path:
    """Like :func:`make_dataset`, for given cases: no draw, no splits, resumable all the same.

    Parameters
    ----------
    arrays : CaseArrays
    path : path, optional
        Default: the cache, under a digest of scene, cases and source, where a finished one is found again.
    progress : callable
        See :func:`make_dataset`, as for the errors raised.

    Returns
    -------
    Path
    """
    digest = hashlib.sha256()
    for values in (a for a in arrays if a is not None):
        digest.update(f"{values.shape} {values.dtype}".encode() + np.ascontiguousarray(values).tobytes())
    recipe = {"scene": json.loads(scene.to_json()), "content": scene.content_hash, "cases": digest.hexdigest(),
              "source": solver_sources()}
    path = Path(path or cached_path("answers", recipe))
    return _make(scene, arrays, scene.cases_from(arrays), path, recipe, compress, progress)


def solver_sources() -> str:
    """Digest of the source files that an answer depends on."""
    return source_digest("fullorder", "fingertip", "scenes", "datasets")


def _make(scene: Scene, arrays: CaseArrays, cases: xr.Dataset, path: Path, recipe: dict, compress: bool,
          progress: Progress) -> Path:
    """Solve the pieces that are missing, then assemble them."""
    folder = begin_or_resume(path, recipe, "cases")
    if folder is None:
        return path
    pieces = _pieces(scene, arrays)
    for k in progress(range(len(pieces))):
        _make_piece(scene, arrays.take(pieces[k]), pieces[k], folder / f"{k:05d}.nc")
    _assemble(scene, cases, folder, len(pieces), path, compress, recipe)
    shutil.rmtree(folder)
    return path


def _pieces(scene: Scene, arrays: CaseArrays) -> list[np.ndarray]:
    """Whole groups gathered into pieces of about PIECE_CASES cases; a larger group is cut."""
    pieces: list[np.ndarray] = []
    gathered: list[np.ndarray] = []
    for group in scene.groups(arrays):
        for part in np.array_split(group, max(1, -(-len(group) // PIECE_CASES))):
            gathered.append(part)
            if sum(map(len, gathered)) >= PIECE_CASES:
                pieces.append(np.concatenate(gathered))
                gathered = []
    return pieces + ([np.concatenate(gathered)] if gathered else [])


def _make_piece(scene: Scene, arrays: CaseArrays, index: np.ndarray, path: Path) -> None:
    if path.exists():
        return
    start = time.perf_counter()
    values, residual = solve_cases(scene, arrays)
    seconds = (time.perf_counter() - start) / len(arrays)
    write_netcdf(xr.Dataset({"displacement": (("case", "dof"), values), "residual": ("case", residual),
                             "seconds": ("case", np.full(len(arrays), seconds))},
                            coords={"case": index}), path)


def _assemble(scene: Scene, cases: xr.Dataset, folder: Path, n_pieces: int, path: Path, compress: bool,
              recipe: dict) -> None:
    """Write the dataset from its pieces, one after another: memory holds one piece, whatever the size of the whole."""
    n_case, n_node = cases.sizes["case"], len(scene.fingertip.mesh.nodes)
    files = [folder / f"{k:05d}.nc" for k in range(n_pieces)]
    residual, seconds = np.empty(n_case), np.empty(n_case)
    for file in files:
        with open_netcdf(file) as piece:
            index = piece["case"].values
            residual[index], seconds[index] = piece["residual"].values, piece["seconds"].values
    frame = cases.assign_coords(scene.field_coordinates(np.arange(n_node))).assign({
        "residual": ("case", residual, {
            "long_name": "relative residual ||Z u - f|| / ||f|| of the direct solve", "units": "1"}),
        "solve_seconds": ("case", seconds, {
            "long_name": "wall time of the direct solve, factorizations shared", "units": "s"}),
        **mesh_variables(scene)})
    frame.attrs = {**dataset_attributes(scene), **stamp(), "recipe": json.dumps(recipe)}

    def blocks() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        for file in files:
            piece = read_netcdf(file)
            yield piece["case"].values, scene.on_all_nodes(piece["displacement"].values)

    attributes = {"long_name": scene.displacement_name, "units": "m", "mesh": "mesh", "location": "node",
                  "coordinates": "node_x node_y node_z"}
    write_in_blocks(frame, path, "displacement", ("case", "node", "component"), scene.dtype, attributes, blocks(),
                    compress)
