"""The load paths of the experiment on a finger on glass: which there are, and each followed once and kept.

A path that was followed is found again under a digest of its settings and of the model's source, so a killed run goes
on.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing import get_context
from typing import Any

import numpy as np
import script
import xarray as xr

from rom.cache import cached_path
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.finger_on_glass.finger import Finger
from rom.finger_on_glass.path import VISCOSITIES, LoadPath, follow
from rom.finger_on_glass.record import recorded, settings
from rom.finger_on_glass.section import Section
from rom.finger_on_glass.tissue import VARIANTS, Tissue
from rom.provenance import source_digest, usable_cores

FORCE, HIGHEST, TRAVEL = 0.5, 2.0, 8.0
"""Held while the plate slides [N]; reached by pressing alone [N]; how far the plate slides [mm]."""
PRESSING = LoadPath(tuple(np.round(np.arange(0.1, HIGHEST + 1e-9, 0.1), 6)))
SLIDING = LoadPath((0.1, 0.2, 0.3, 0.4, FORCE), tuple(np.round(np.arange(0.2, TRAVEL + 1e-9, 0.2), 6)))
MESHES = ((100, 12), (160, 16), (240, 24))
TOO_LONG = ("sliding", "circumferential", MESHES[-1])
"""Left out: snap follows snap while that skin rolls, and the path had not ended after several minutes of computing."""
REFERENCE = 1
"""Mesh of the figures."""
SEEDS = (0, 1, 2, 3, 4)
MESH_SEEDS = (0, 1, 2)
"""Seeds of the random variant on the reference mesh, and on the others."""
COARSE = (60, 8)
"""Mesh on which assumptions are varied, against the same mesh without change."""
BULK_RATIOS = (1e2, 1e3, 1e4, 1e5)
VISCOUS = (1e-5, 3e-5, 1e-4)
"""Used from the start, to see what they do [MPa]."""


@dataclass(frozen=True)
class Run:
    """A path to follow.

    Parameters
    ----------
    group : str
        What it is for.
    label : str
        Within the group.
    finger : Finger
    path : LoadPath
    viscosities : tuple of float [MPa]
    """

    group: str
    label: str
    finger: Finger
    path: LoadPath
    viscosities: tuple[float, ...] = VISCOSITIES

    @property
    def recipe(self) -> dict[str, Any]:
        inputs = {name: str(value) if value == np.inf else value for name, value in settings(self.finger).items()}
        return inputs | {"normal_force": self.path.normal_force, "travel": self.path.travel,
                         "viscosities": self.viscosities,
                         "source": source_digest("rom.finger_on_glass.path", "rom.finger_on_glass.finger")}


def finger_of(variant: str, rays: int, layers: int, seed: int = 0,
              changes: Mapping[str, float] | None = None) -> Finger:
    """A finger with some inputs changed.

    Parameters
    ----------
    variant : str
    rays, layers, seed : int
    changes : mapping, optional
        ``section.width`` and the like; ``section.scale`` multiplies all of the section's lengths.
    """
    finger = Finger(tissue=Tissue(variant, seed=seed), rays=rays, layers=layers)
    parts: dict[str, dict[str, float]] = {}
    for name, value in (changes or {}).items():
        part, field = name.split(".")
        if name == "section.scale":
            lengths = {key: value * float(size) for key, size in vars(Section()).items()}
            parts["section"] = lengths | parts.get("section", {})
        else:
            parts.setdefault(part, {})[field] = value
    return replace(finger, **{part: replace(getattr(finger, part), **some) for part, some in parts.items()})


# ---- which there are ----------------------------------------------------------------------------------------

ASSUMPTIONS: dict[str, tuple[tuple[str, dict[str, float]], ...]] = {
    "width of the section": (("16 mm", {"section.width": 16.0}), ("20 mm", {"section.width": 20.0})),
    "height of the section": (("13.5 mm", {"section.height": 13.5}), ("16.5 mm", {"section.height": 16.5})),
    "size of the section": (("85 %", {"section.scale": 0.85}), ("120 %", {"section.scale": 1.2})),
    "width of the bone": (("7 mm", {"section.bone_width": 7.0}), ("10 mm", {"section.bone_width": 10.0})),
    "height of the bone": (("3.4 mm", {"section.bone_height": 3.4}), ("5 mm", {"section.bone_height": 5.0})),
    "offset of the bone": (("0 mm", {"section.bone_offset": 0.0}), ("2 mm", {"section.bone_offset": 2.0})),
    "out-of-plane stiffness": (("0 N", {"out_of_plane.stiffness": 0.0}), ("10 N", {"out_of_plane.stiffness": 10.0}),
                               ("1000 N", {"out_of_plane.stiffness": 1e3}),
                               ("infinite", {"out_of_plane.stiffness": np.inf})),
    "effective length": (("7 mm", {"out_of_plane.effective_length": 7.0}),
                         ("15 mm", {"out_of_plane.effective_length": 15.0})),
    "normal penalty": (("5 MPa/mm", {"plate.normal_stiffness": 5.0}), ("80 MPa/mm", {"plate.normal_stiffness": 80.0})),
    "tangential penalty": (("1.25 MPa/mm", {"plate.tangential_stiffness": 1.25}),
                           ("20 MPa/mm", {"plate.tangential_stiffness": 20.0})),
}
"""Inputs that the publication leaves open, each changed alone."""
SWEEPS: dict[str, tuple[tuple[float, dict[str, float]], ...]] = {
    "c [kPa]": tuple((c, {"tissue.c": 1e-3 * c}) for c in (1.0, 1.5, 2.0, 4.0)),
    "effective length [mm]": tuple((n, {"out_of_plane.effective_length": n}) for n in (3.0, 5.0, 7.0, 15.0)),
    "size of the section [-]": tuple((s, {"section.scale": s}) for s in (0.85, 1.2, 1.5, 1.8)),
    "size of the bone [-]": tuple((s, {"section.bone_width": 8.6 * s, "section.bone_height": 4.2 * s})
                                  for s in (0.4, 0.6, 0.8, 1.2)),
    "offset of the bone [mm]": tuple((y, {"section.bone_offset": y}) for y in (0.0, 2.0, 3.0)),
    "out-of-plane stiffness [N]": tuple((k, {"out_of_plane.stiffness": k}) for k in (0.0, 10.0, 1e3)),
}
"""What might put full slip where it is published; the values as drawn, and the inputs."""


def runs(quick: bool) -> list[Run]:
    """Every path of the experiment, the main ones first."""
    meshes = ((40, 4), (50, 5), (60, 6)) if quick else MESHES
    found: list[Run] = []
    for k, (rays, layers) in enumerate(meshes):
        for variant in VARIANTS:
            seeds = (0,) if variant != "random" else (0, 1) if quick else SEEDS if k == REFERENCE else MESH_SEEDS
            for seed in seeds:
                finger = finger_of(variant, rays, layers, seed)
                for name, path in (("pressing", PRESSING), ("sliding", SLIDING)):
                    if (name, variant, (rays, layers)) == TOO_LONG:
                        continue
                    found.append(Run(name, f"{variant} {seed} {k}", finger, path))
    rays, layers = meshes[0] if quick else COARSE
    assumptions = {"offset of the bone": ASSUMPTIONS["offset of the bone"]} if quick else ASSUMPTIONS
    assumptions = {"as assumed": (("as assumed", {}),), **assumptions}
    for group, levels in assumptions.items():
        for level, changes in levels:
            for variant in VARIANTS:
                found.append(Run("assumption", f"{variant}|{group}|{level}",
                                 finger_of(variant, rays, layers, 0, changes), SLIDING))
    sweeps = {"c [kPa]": SWEEPS["c [kPa]"][1:2]} if quick else SWEEPS
    for name, steps in sweeps.items():
        for value, changes in steps:
            for variant in ("radial", "random"):
                found.append(Run("sweep", f"{variant}|{name}|{value:g}", finger_of(variant, rays, layers, 0, changes),
                                 SLIDING))
    little = LoadPath(SLIDING.normal_force, SLIDING.travel[:5])
    for variant in VARIANTS:
        for ratio in BULK_RATIOS[:2] if quick else BULK_RATIOS:
            found.append(Run("bulk", f"{variant}|{ratio:g}", finger_of(variant, rays, layers, 0,
                                                                       {"tissue.bulk_ratio": ratio}), little))
        for viscosity in (0.0, *(VISCOUS[1:2] if quick else VISCOUS)):
            found.append(Run("viscosity", f"{variant}|{viscosity:g}", finger_of(variant, rays, layers),
                             replace(SLIDING, travel=SLIDING.travel[:20]), (viscosity,)))
    return found


# ---- following them -----------------------------------------------------------------------------------------

def followed(listed: Iterable[Run], progress: script.Progress) -> Iterator[tuple[Run, xr.Dataset]]:
    """Each run with what was recorded of it, in order; followed on two processes where the machine has the cores."""
    listed = list(listed)
    missing = {cached_path("collagen", run.recipe): run for run in listed}
    # the longest one last, so that a look at what is there already says most
    waiting = sorted((run for path, run in missing.items() if not path.exists()),
                     key=lambda run: run.finger.rays == MESHES[-1][0] and "circumferential" in run.label)
    workers = min(2, usable_cores(), len(waiting) // 40)
    if workers < 2:
        for run in progress(waiting, "paths"):
            keep(run)
    else:
        # imported libraries read these when a worker starts; two workers share the cores
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        os.environ.setdefault("MKL_NUM_THREADS", "1")
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            for done in progress(Finished([pool.submit(keep, run) for run in waiting]), "paths"):
                done.result()
    for run in listed:
        yield run, read_netcdf(cached_path("collagen", run.recipe))


class Finished:
    """Futures as they end, with their number for a progress bar."""

    def __init__(self, waiting: list) -> None:
        self.waiting = waiting

    def __len__(self) -> int:
        return len(self.waiting)

    def __iter__(self) -> Iterator:
        return as_completed(self.waiting)


def keep(run: Run) -> None:
    """Follow one path and store what was recorded."""
    answer = follow(run.finger, run.path, viscosities=run.viscosities)
    write_netcdf(recorded(run.finger, answer), cached_path("collagen", run.recipe), compress=True)

