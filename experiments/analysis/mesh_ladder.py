"""A ladder of meshes, and the modes on each rung, computed in a process of their own and kept.

Each rung has about 1.5 times the nodes of the one before, the published factor. Cap, rings and layers grow together, by
1.5^(1/3) a rung from the `study` mesh both ways, each rounded to a count that exists; of the layers the hypodermis and
the dermis grow first, the thin layers keep one element until the mesh is fine enough for two. A process of its own has
a peak of memory of its own, which is what is reported.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from analysis.mode_pairing import on_mesh
from rom.cache import cached_path
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.errors import SolverError
from rom.fingertip import TISSUES, Anatomy, Fingertip, MeshDensity
from rom.provenance import source_digest
from rom.vibration.modal_analysis import analyse_modes

LADDER = (
    MeshDensity((8, 8), 5, 5, (1, 1, 1, 2)),  # 2,406 nodes
    MeshDensity((10, 10), 5, 5, (1, 1, 1, 3)),  # 3,647
    MeshDensity((12, 12), 6, 6, (1, 1, 1, 3)),  # 5,215
    MeshDensity((14, 14), 7, 7, (1, 1, 2, 3)),  # 8,072
    MeshDensity((16, 16), 8, 8, (1, 1, 2, 4)),  # 11,817: the study's
    MeshDensity((18, 18), 10, 9, (1, 1, 2, 5)),  # 17,290
    MeshDensity((20, 20), 11, 11, (2, 1, 3, 5)),  # 26,412
    MeshDensity((24, 24), 13, 12, (2, 1, 3, 6)),  # 39,325
    MeshDensity((28, 28), 15, 14, (2, 1, 4, 7)),  # 61,335
)
"""From some 2,000 nodes to more than 60,000."""
QUICK_LADDER = (
    MeshDensity((6, 6), 2, 2, (1, 1, 1, 1)),  # 725 nodes
    MeshDensity((6, 6), 3, 3, (1, 1, 1, 2)),  # 1,158
    MeshDensity((8, 8), 4, 3, (1, 1, 1, 2)),  # 1,830
)
"""Three coarse rungs, to see that everything runs."""
SOURCES = ("fingertip", "fullorder", *(f"vibration/{name}.py" for name in (
    "modal_analysis", "mode_pairing", "parity", "skin_motion")))
"""What a rung's content depends on beside its settings."""


def node_count(density: MeshDensity) -> int:
    """Nodes of a mesh, without making it."""
    return density.nodes_per_shell * (sum(density.layers) + 1)


def modes_on(tip: Fingertip, reference: MeshDensity, count: int) -> xr.Dataset:
    """Modes of a fingertip from the cache, or computed in another process and then kept there.

    Parameters
    ----------
    tip : Fingertip
    reference : MeshDensity
        On whose nodes the shapes are given, so that those of all meshes can be compared.
    count : int

    Returns
    -------
    xr.Dataset
        `natural_frequency`, `parity` (mode); `shape` (mode, dof of the reference); `nodes`, `elements`, `free_dofs`,
        `volume`, `nail_volume`, `seconds`, `peak_memory`.

    Raises
    ------
    SolverError
        If the process fails; with its last words.
    """
    task = {"fingertip": tip.to_dict(), "reference": reference.to_dict(), "count": count}
    path = cached_path("mesh-convergence", task | {"source": source_digest(__file__)})
    if not path.is_file():
        words = [sys.executable, __file__, json.dumps(task), str(path)]
        here = os.pathsep.join(filter(None, (str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH"))))
        done = subprocess.run(words, capture_output=True, text=True, check=False,
                              env={**os.environ, "PYTHONPATH": here})
        if done.returncode or not path.is_file():
            last = (done.stderr.strip().splitlines() or ["no message: perhaps there was not enough memory"])[-1]
            raise SolverError(f"the modes on {node_count(tip.density):,} nodes were not computed ({last}): finished "
                              "meshes are kept, run again with more memory or fewer meshes")
    return read_netcdf(path)


def _solve(task: dict[str, Any]) -> xr.Dataset:
    start = time.perf_counter()
    settings = task["fingertip"]
    tip = Fingertip(Anatomy.from_dict(settings["anatomy"]), MeshDensity.from_dict(settings["density"]),
                    settings["formulation"], settings["rear"])
    found = analyse_modes(tip, task["count"])
    seconds, peak = time.perf_counter() - start, _peak_memory()
    mesh = tip.mesh
    reference = Fingertip(tip.anatomy, MeshDensity.from_dict(task["reference"]), tip.formulation, tip.rear)
    shape = on_mesh(mesh, tip.free_dofs, found.modes.shape, reference).T
    shape /= np.abs(shape).max(axis=1, keepdims=True)
    nail = float(mesh.element_volumes[mesh.tissue == TISSUES.index("nail_plate")].sum())
    numbers = {"nodes": (mesh.n_nodes, "1"), "elements": (len(mesh.hexahedra), "1"),
               "free_dofs": (len(tip.free_dofs), "1"), "volume": (mesh.volume, "m3"), "nail_volume": (nail, "m3"),
               "seconds": (seconds, "s"), "peak_memory": (peak, "byte")}
    return xr.Dataset({
        "natural_frequency": ("mode", found.modes.frequency_hz, {"units": "Hz", "long_name": "natural frequency"}),
        "parity": ("mode", found.parity.astype(object), {"units": "1", "long_name": "parity about the mid-plane"}),
        "shape": (("mode", "dof"), shape.astype(np.float32), {
            "units": "1", "long_name": "shape on the free dofs of the reference mesh, largest component 1"}),
        **{name: ((), value, {"units": units, "long_name": name.replace("_", " ")})
           for name, (value, units) in numbers.items()}})


def _peak_memory() -> float:
    """Largest resident size of this process [byte]; NaN where the system does not tell."""
    try:
        status = Path("/proc/self/status").read_text(encoding="utf-8")
        return 1024.0 * int(status.split("VmHWM:")[1].split()[0])
    except (OSError, IndexError):
        return float("nan")


if __name__ == "__main__":
    write_netcdf(_solve(json.loads(sys.argv[1])), sys.argv[2])
