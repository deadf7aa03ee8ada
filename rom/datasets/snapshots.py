"""Datasets: cases of a scene with the full-order model's answers, made in parallel and in resumable pieces.

Each finished piece is a whole small file in ``FILE.pieces/``; a killed run finds them again and solves only what is
missing. Pieces are handed to the workers of a dask cluster, a local one unless an address is given, and come back as
arrays: the workers need this package, but no common disk. Each piece is solved on one thread and starts afresh, so that
the bits do not hang on who solved it, on how many there were, or on what came before. The final file is assembled under
a temporary name and renamed, then the pieces are removed.
"""

from __future__ import annotations

import hashlib
import json
import logging
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from rom.cache import cached_path
from rom.checks import shown, whole_number
from rom.datasets.pieces import pieces_of
from rom.datasets.schema import dataset_attributes, mesh_variables
from rom.datasets.splits import split_variables
from rom.datasets.storage import open_netcdf, read_netcdf, write_in_blocks, write_netcdf
from rom.files import is_intact
from rom.fullorder import threads
from rom.provenance import source_digest, stamp, usable_cores
from rom.scenes import Answers, Cases, Quantity, Scene

Progress = Callable[[Iterable], Iterable]
Solution = tuple[Answers, dict[str, np.ndarray]]
MOST_CASES = 10_000_000
"""Of one dataset; every case is drawn before the first is solved."""
SECONDS = Quantity((), "s", "wall time of the full-order answer, one thread, factorizations shared")


def draw_cases(scene: Scene, count: int, beyond: int = 0, seed: int = 0) -> tuple[Any, xr.Dataset]:
    """``count`` cases within the ranges and ``beyond`` outside them, with both splits.

    Returns
    -------
    arrays : Cases
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
        arrays = arrays.joined(scene.sample_beyond(beyond, seed))
    return arrays, scene.cases_from(arrays).assign(split_variables(scene, arrays, count, seed))


def recipe_for(scene: Scene, count: int, beyond: int, seed: int) -> dict[str, Any]:
    """Everything that a dataset depends on, the source of the full-order model included."""
    return {"scene": json.loads(scene.to_json()), "content": scene.content_hash, "cases": count, "beyond": beyond,
            "seed": seed, "source": solver_sources(scene)}


def solver_sources(scene: Scene) -> str:
    """Digest of the source files that a scene's full-order answers and splits depend on."""
    parts = [scene, getattr(scene, "body", scene), getattr(scene, "population", scene)]
    return source_digest(*sorted({type(part).__module__ for part in parts}), "rom.datasets.splits")


def make_dataset(scene: Scene, count: int, path: str | Path | None = None, *, beyond: int = 0, seed: int = 0,
                 compress: bool = False, scheduler: str | None = None, workers: int | None = 1,
                 progress: Progress = iter) -> Path:
    """Make a dataset, or finish the one whose pieces an earlier run left.

    Parameters
    ----------
    count, beyond : int
        Cases within and outside the ranges.
    path : path, optional
        Default: the cache, where a finished one is found again.
    scheduler : str, optional
        Address of a running dask scheduler, such as ``"tcp://host:8786"``; default: a local cluster.
    workers : int, optional
        Processes of the local cluster; 1 works in this process, None takes one a core.
    progress : callable
        Wraps the iteration over pieces, to show a bar.

    Raises
    ------
    ValueError
        For numbers of cases or workers that cannot be.
    SchemaError
        Where pieces of another recipe lie at the same place.
    FileExistsError
        Where the file exists and was made from another recipe, or is no dataset: nothing is overwritten.
    OSError
        Where no scheduler answers, or the disk is full; finished pieces stay and the next run goes on from them.
    """
    arrays, cases = draw_cases(scene, count, beyond, seed)
    return _make(scene, arrays, cases, path, recipe_for(scene, count, beyond, seed), compress, scheduler, workers,
                 progress)


def solve_dataset(scene: Scene, arrays: Any, path: str | Path | None = None, *, compress: bool = False,
                  scheduler: str | None = None, workers: int | None = 1, progress: Progress = iter) -> Path:
    """Like :func:`make_dataset`, for given cases (plain arrays): no draw, no splits, resumable all the same."""
    digest = hashlib.sha256()
    for values in (a for a in arrays if a is not None):
        digest.update(f"{values.shape} {values.dtype}".encode() + np.ascontiguousarray(values).tobytes())
    recipe = {"scene": json.loads(scene.to_json()), "content": scene.content_hash, "cases": digest.hexdigest(),
              "source": solver_sources(scene)}
    return _make(scene, arrays, scene.cases_from(arrays), path, recipe, compress, scheduler, workers, progress)


def _make(scene: Scene, arrays: Any, cases: xr.Dataset, path: str | Path | None, recipe: dict, compress: bool,
          scheduler: str | None, workers: int | None, progress: Progress) -> Path:
    """Solve the pieces that are missing, then assemble them."""
    if workers is not None:
        whole_number("workers", workers, 1, 1024)
        if scheduler is not None and workers > 1:
            raise ValueError(f"workers={workers} cannot be: the scheduler {shown(scheduler)} has its own; leave "
                             "one of them out")
    path = Path(path or cached_path("datasets", recipe))
    with pieces_of(path, recipe, "cases") as folder, ExitStack() as stack:
        if folder is None:
            return path
        pieces = scene.pieces(arrays)
        files = [folder / f"{k:05d}.nc" for k in range(len(pieces))]
        todo = [k for k in range(len(pieces)) if not is_intact(files[k])]
        solved = _solved(stack, scene, {k: arrays.take(pieces[k]) for k in todo}, scheduler, workers)
        for _ in progress(range(len(todo))):
            k, solution = next(solved)
            _write_piece(scene, solution, pieces[k], files[k])
        _assemble(scene, cases, files, path, compress, recipe)
    return path


# ---- solving ------------------------------------------------------------------------------------------------

def solve_piece(scene: Scene, cases: Cases) -> Solution:
    """One piece on one thread, from a state that depends on nothing before: what a worker runs."""
    with threadpool_limits(1), threads(1):
        scene.begin_piece()
        start = time.perf_counter()
        answers, record = scene.solve(cases)
        seconds = (time.perf_counter() - start) / len(cases)
    return answers, {**record, "solve_seconds": np.full(len(cases), seconds)}


def _solved(stack: ExitStack, scene: Scene, pieces: dict[int, Any], scheduler: str | None, workers: int | None
            ) -> Iterator[tuple[int, Solution]]:
    """Solutions of the pieces as they come; ``stack`` closes the cluster."""
    count = min(workers or usable_cores(), max(1, len(pieces)))
    if not pieces or (scheduler is None and count == 1):
        own = scene.afresh()
        yield from ((k, solve_piece(own, cases)) for k, cases in pieces.items())
        return
    from distributed import as_completed

    client = stack.enter_context(_client(stack, scheduler, count))
    shared = client.scatter(scene.afresh(), broadcast=True)
    place = {client.submit(solve_piece, shared, cases, pure=False): k for k, cases in pieces.items()}
    for future in as_completed(place):
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

def _write_piece(scene: Scene, solution: Solution, index: np.ndarray, path: Path) -> None:
    """A piece as it was solved: the judged quantity with dimensions of its own, since held nodes are not in it."""
    answers, record = solution
    data: dict[str, Any] = {}
    for name, values in {**answers, **record}.items():
        dims = [f"{name}_{axis}" for axis in range(1, values.ndim)]
        kind = values.astype(np.int8) if values.dtype == bool else values
        data[name] = (("case", *dims), kind)
    write_netcdf(xr.Dataset(data, coords={"case": index}), path)


def _assemble(scene: Scene, cases: xr.Dataset, files: list[Path], path: Path, compress: bool, recipe: dict) -> None:
    """Write the dataset from its pieces, one after another: of the judged quantity memory holds one piece."""
    judged, *others = scene.quantities
    small: dict[str, Quantity] = {**{name: scene.quantities[name] for name in others}, **scene.record,
                                  "solve_seconds": SECONDS}
    n_case = cases.sizes["case"]
    table: dict[str, np.ndarray] = {}
    for file in files:
        with open_netcdf(file) as piece:
            index = piece["case"].values
            for name in small:
                values = piece[name].values
                # words grow with the longest; objects are turned into text below
                kind = object if values.dtype.kind in "OU" else values.dtype
                table.setdefault(name, np.empty((n_case, *values.shape[1:]), dtype=kind))[index] = values
    frame = cases.assign_coords(scene.coordinates()).assign({
        name: (("case", *quantity.dims), table[name].astype(str) if table[name].dtype == object else table[name], {
            **quantity.attributes, **_at_nodes(scene, quantity)}) for name, quantity in small.items()})
    frame = frame.assign(mesh_variables(scene.grid))
    frame.attrs = {**dataset_attributes(scene), **stamp(), "recipe": json.dumps(recipe)}
    quantity = scene.quantities[judged]

    def blocks() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        for file in files:
            piece = read_netcdf(file)
            yield piece["case"].values, scene.whole(piece[judged].values)

    sample = read_netcdf(files[0])[judged]
    write_in_blocks(frame, path, judged, ("case", *quantity.dims), sample.dtype,
                    {**quantity.attributes, **_at_nodes(scene, quantity)}, blocks(), compress)


def _at_nodes(scene: Scene, quantity: Quantity) -> dict[str, str]:
    if scene.grid is None or "node" not in quantity.dims:
        return {}
    axes = "xyz"[:scene.grid.nodes.shape[1]]
    return {"mesh": "mesh", "location": "node", "coordinates": " ".join(f"node_{axis}" for axis in axes)}
