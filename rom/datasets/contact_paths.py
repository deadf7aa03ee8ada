"""Datasets of load paths, made in parallel: each path a whole small file, so that a killed run goes on from them.

Paths are handed to the workers of a dask cluster, a local one unless an address is given, and come back as arrays: the
workers need this package, but no common disk. The final file is assembled under a temporary name and renamed.
"""

from __future__ import annotations

import json
import logging
import shutil
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.datasets.contact_schema import QUANTITIES, check_paths, dataset_attributes, label_answers, mesh_variables
from rom.datasets.path_solutions import solve_path, warm_up
from rom.datasets.pieces import begin_or_resume
from rom.datasets.snapshots import Progress
from rom.datasets.splits import split_variables
from rom.datasets.storage import open_netcdf, read_netcdf, write_in_blocks, write_netcdf
from rom.errors import SchemaError
from rom.provenance import source_digest, stamp, usable_cores
from rom.scenes import FingerOnGlass, PathArrays, scene_from_json
from rom.scenes.paths import joined

MOST_PATHS = 100_000
Solution = tuple[dict[str, np.ndarray], dict[str, Any]]
PER_PATH = {"solve_seconds": ("s", "wall time of the full-order path, one thread"),
            "iterations": ("1", "Newton iterations, failed steps included")}
PER_POSITION = {"reached": ("1", "whether the full-order path converged up to here"),
                "viscosity": ("Pa", "viscous resistance that carried the skin over snaps")}


def draw_paths(scene: FingerOnGlass, count: int, beyond: int = 0, seed: int = 0) -> tuple[PathArrays, xr.Dataset]:
    """``count`` paths within the ranges and ``beyond`` outside them, with both splits.

    Returns
    -------
    paths : PathArrays
    cases : xr.Dataset
        The same, labelled, with ``split_published``, ``split_hard`` and ``hard_region``.

    Raises
    ------
    ValueError
        For a count below one or above :data:`MOST_PATHS`.
    """
    if count < 1 or beyond < 0:
        raise ValueError(f"{count} paths and {beyond} beyond the ranges cannot be drawn: ask for at least one path")
    if max(count, beyond) > MOST_PATHS:
        raise ValueError(f"{max(count, beyond)} paths are more than the {MOST_PATHS} that are drawn at once: "
                         "ask for fewer")
    paths = scene.sample(count, seed)
    if beyond:
        paths = joined(paths, scene.sample_beyond(beyond, seed))
    splits = split_variables(scene, paths, count, seed)
    attributes = {"split_published": {"long_name": "random 20 % of the paths held out"},
                  "split_hard": {"long_name": "corners of the ranges, and what lies beyond them, held out"}}
    return paths, scene.cases_from(paths).assign({
        name: ("path", values, {**found, **attributes.get(name, {})}) for name, (_, values, found) in splits.items()})


def make_paths(scene: FingerOnGlass, count: int, path: str | Path, *, beyond: int = 0, seed: int = 0,
               compress: bool = False, scheduler: str | None = None, workers: int | None = None,
               progress: Progress = iter) -> Path:
    """Make the dataset ``path``, or finish the one whose pieces an earlier run left.

    Parameters
    ----------
    count, beyond : int
        Paths within and outside the ranges.
    scheduler : str, optional
        Address of a running dask scheduler, such as ``"tcp://host:8786"``; default: a local cluster.
    workers : int, optional
        Processes of the local cluster, default: one a core; 1 works without a cluster.
    progress : callable
        Wraps the iteration over paths, to show a bar.

    Raises
    ------
    ValueError
        For numbers of paths or workers that cannot be.
    SchemaError
        Where pieces of another recipe lie at the same place.
    FileExistsError
        Where the file exists and was made from another recipe, or is no dataset: nothing is overwritten.
    OSError
        Where no scheduler answers, or the disk is full; finished pieces stay and the next run goes on from them.
    """
    if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or not 1 <= workers <= 1024):
        raise ValueError(f"workers={workers!r} is no number of processes: give 1 to 1024")
    if scheduler is not None and workers is not None:
        raise ValueError(f"the cluster at {scheduler} has its own workers: give a scheduler or a number of workers")
    paths, cases = draw_paths(scene, count, beyond, seed)
    path = Path(path)
    recipe = recipe_for(scene, count, beyond, seed)
    folder = begin_or_resume(path, recipe, "paths")
    if folder is None:
        return path
    todo = [i for i in range(len(paths)) if not _piece(folder, i).exists()]
    with ExitStack() as stack:
        solved = _solved(stack, scene, paths, todo, scheduler, workers)
        for _ in progress(range(len(todo))):
            i, solution = next(solved)
            _write_piece(scene, solution, _piece(folder, i))
    _assemble(scene, cases, folder, path, compress, recipe)
    shutil.rmtree(folder)
    return path


def recipe_for(scene: FingerOnGlass, count: int, beyond: int, seed: int) -> dict[str, Any]:
    """Everything that the dataset depends on, the source of the full-order model included."""
    return {"scene": json.loads(scene.to_json())["options"], "content": scene.content_hash, "paths": count,
            "beyond": beyond, "seed": seed, "source": source_digest(
                "finger_on_glass", "scenes/finger_on_glass.py", "scenes/paths.py", "datasets/contact_schema.py",
                "datasets/path_solutions.py", "datasets/splits.py")}


def find_paths(scene: FingerOnGlass, count: int, beyond: int, seed: int, *, scheduler: str | None = None,
               workers: int | None = None, progress: Progress = iter) -> Path:
    """The dataset of a recipe from the cache, made if it is not there; see :func:`make_paths`."""
    path = cached_path("datasets", recipe_for(scene, count, beyond, seed))
    return make_paths(scene, count, path, beyond=beyond, seed=seed, scheduler=scheduler, workers=workers,
                      progress=progress)


def read_path_dataset(path: str | Path, index=None, scene: FingerOnGlass | None = None) -> xr.Dataset:
    """Read a dataset of load paths, or those selected by integers, a slice or a mask.

    Raises
    ------
    SchemaError
        Where the file is missing, truncated, foreign, or not of the given (or its own) scene.
    """
    with open_netcdf(path) as data:
        try:
            own = scene or scene_from_json(data.attrs["scene_parameters"])
        except (KeyError, ValueError) as error:
            raise SchemaError(f"{path} is no dataset of load paths: make one with `rom dataset`") from error
        if not isinstance(own, FingerOnGlass):
            raise SchemaError(f"{path} holds cases of {own.name}, not load paths: read it with read_dataset")
        check_paths(data, own, str(path))
        try:
            found = (data if index is None else data.isel(path=index)).load()
        except (OSError, RuntimeError) as error:
            raise SchemaError(f"{path} is damaged: delete it and make it again") from error
    return found.assign(reached=found["reached"].astype(bool))


# ---- solving ------------------------------------------------------------------------------------------------

def solve_task(scene_text: str, row: tuple) -> Solution:
    """One path, on one thread: what a worker runs.

    Parameters
    ----------
    scene_text : str
        From the scene's ``to_json``.
    row : tuple
        The five inputs of the path.
    """
    from threadpoolctl import threadpool_limits

    warm_up()
    scene = scene_from_json(scene_text)
    with threadpool_limits(1):
        return solve_path(scene, PathArrays(*(np.array([value]) for value in row)), 0)


def _solved(stack: ExitStack, scene: FingerOnGlass, paths: PathArrays, todo: list[int], scheduler: str | None,
            workers: int | None) -> Iterator[tuple[int, Solution]]:
    """Solutions of the paths ``todo`` as they come; ``stack`` closes the cluster."""
    text, rows = scene.to_json(), {i: tuple(a[i].item() for a in paths) for i in todo}
    workers = min(workers or usable_cores(), max(1, len(todo)))
    if not todo or (scheduler is None and workers == 1):
        yield from ((i, solve_task(text, rows[i])) for i in todo)
        return
    from distributed import as_completed

    client = stack.enter_context(_client(stack, scheduler, workers))
    place = {client.submit(solve_task, text, rows[i], pure=False): i for i in todo}
    finished = as_completed(place)
    for future in finished:
        yield place[future], future.result()
        future.release()  # its arrays leave the worker's memory


def _client(stack: ExitStack, scheduler: str | None, workers: int):
    from distributed import Client, LocalCluster

    # its comings and goings are no news to whom a bar is shown; a process that is slow to end is ended
    logging.getLogger("distributed").setLevel(logging.ERROR)
    if scheduler is None:
        cluster = stack.enter_context(LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=":0", silence_logs=40))
        return Client(cluster)
    try:
        return Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        raise OSError(f"no dask scheduler answers at {scheduler!r}: start one with `dask scheduler` and workers with "
                      "`dask worker`, or leave the address out for a local cluster") from error


# ---- files --------------------------------------------------------------------------------------------------

def _piece(folder: Path, i: int) -> Path:
    return folder / f"{i:05d}.nc"


def _write_piece(scene: FingerOnGlass, solution: Solution, path: Path) -> None:
    values, record = solution
    data = {name: (("position", *QUANTITIES[name].dims), array) for name, array in values.items()}
    write_netcdf(xr.Dataset({**data, "reached": ("position", record["reached"].astype(np.int8)),
                             "viscosity": ("position", record["viscosity"])},
                            attrs={name: record[name] for name in (*PER_PATH, "reason")}), path)


def _assemble(scene: FingerOnGlass, cases: xr.Dataset, folder: Path, path: Path, compress: bool, recipe: dict) -> None:
    """Write the final file, the displacement path by path."""
    count = cases.sizes["path"]
    values: dict[str, Any] = {name: [] for name in QUANTITIES if name != "displacement"}
    record: dict[str, Any] = {name: [] for name in (*PER_PATH, *PER_POSITION, "reason")}
    for i in range(count):
        piece = read_netcdf(_piece(folder, i))
        for name, found in values.items():
            found.append(piece[name].values)
        for name, found in record.items():
            found.append(piece.attrs[name] if name in piece.attrs else piece[name].values)
    frame = label_answers(scene, cases, {name: np.stack(found) for name, found in values.items()})
    units = {**PER_PATH, **PER_POSITION}
    frame = frame.assign({name: (("path", "position") if name in PER_POSITION else "path", np.array(record[name]), {
        "units": unit, "long_name": text}) for name, (unit, text) in units.items()})
    frame["reason"] = ("path", np.array(record["reason"], dtype=str), {
        "long_name": "where and why the path ends early"})
    frame = frame.assign(mesh_variables(scene))
    frame.attrs = {**dataset_attributes(scene), **stamp(), "recipe": json.dumps(recipe)}
    quantity = QUANTITIES["displacement"]
    attributes = {"long_name": quantity.long_name, "units": quantity.units, "mesh": "mesh", "location": "node",
                  "coordinates": "node_x node_y"}
    write_in_blocks(frame, path, "displacement", ("path", "position", *quantity.dims), np.dtype(float), attributes, (
        (np.array([i]), read_netcdf(_piece(folder, i))["displacement"].values[None]) for i in range(count)), compress)


