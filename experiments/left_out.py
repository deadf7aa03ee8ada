"""What it saves to leave out what a scene does not need: each way to a first answer in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from itertools import product

import numpy as np
import script
import xarray as xr
from left_out_figures import draw

from rom.reporting import html, words
from rom.scenes import get_scene

WORKER = """
import json, sys, time
start = time.perf_counter()
scene_name, extras, density, imports = json.loads(sys.argv[1])
if imports is not None:
    __import__(imports)
    print(json.dumps([time.perf_counter() - start, 0.0, 0.0, len(sys.modules)]))
    sys.exit()
import numpy as np
from rom.fingertip import Fingertip, MeshDensity
from rom.metamodels import create
from rom.scenes import CaseArrays, get_scene
if "torch" in extras:
    import torch
if "figures" in extras:
    import matplotlib.figure
imported = time.perf_counter()
tip = Fingertip.preset("metamodel") if density is None else Fingertip(density=MeshDensity.from_dict(density))
scene = get_scene(scene_name, tip)
if "mass" in extras or "modes" in extras or "complex" in extras:
    tip.mass
model = create("direct", scene).fit()
point = () if not scene.harmonic else (np.array([100.0]), np.array([0.1]))
answer = model.evaluate(CaseArrays(np.zeros((1, 1), dtype=int), np.ones((1, 1)), *point))
if "modes" in extras or "complex" in extras:
    from rom.fullorder import SecondOrderModel
    full = SecondOrderModel(tip.stiffness, tip.mass)
    if "modes" in extras:
        modes = full.natural_modes(count=12)
    if "complex" in extras:
        full.solve_harmonic(scene.unit_loads[:, 0], 100.0, 0.1)
done = time.perf_counter()
with open("/proc/self/status") as lines:
    peak = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) * 1024
print(json.dumps([imported - start, done - imported, peak, len(sys.modules)]))
"""
"""Prints seconds of imports, seconds to the first answer, peak memory [B], modules loaded."""

EVERYTHING = "everything"
EXTRAS = {"static-point-forces": ("mass", "modes", "complex", "torch", "figures"),
          "harmonic-point-force": ("modes", "torch", "figures"),
          "harmonic-patch-forces": ("modes", "torch", "figures")}
"""What the direct answer to a case of each scene leaves out, and a program that builds everything would not."""
SPOKEN = {"lean": "only what the scene needs", "mass": "and the mass matrix", "modes": "and twelve natural modes",
          "complex": "and a complex factorization", "torch": "and torch loaded", "figures": "and matplotlib loaded",
          EVERYTHING: "everything"}
MODULES = ("rom", "rom.scenes", "rom.metamodels", "torch", "matplotlib.figure")
MEASURES = ("import_seconds", "answer_seconds", "peak_bytes", "modules")
REPEATS = 3


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """What does it save, in time and memory, to build only what a scene needs?"""
    tip = script.fingertip(quick)
    density = tip.density.to_dict() if quick else None
    ways = list(SPOKEN)
    repeats = 1 if quick else REPEATS
    shape = len(EXTRAS), len(ways), repeats
    found = {name: np.full(shape, np.nan) for name in MEASURES}
    runs = [(repeat, i, j) for repeat in range(repeats) for i, scene in enumerate(EXTRAS)
            for j, way in enumerate(ways) if way in ("lean", EVERYTHING, *EXTRAS[scene])]
    for repeat, i, j in progress(runs, "processes"):
        scene, way = list(EXTRAS)[i], ways[j]
        extras = {"lean": (), EVERYTHING: EXTRAS[scene]}.get(way, (way,))
        for name, value in zip(MEASURES, _measure(scene, extras, density), strict=True):
            found[name][i, j, repeat] = value
    imports = np.full((len(MODULES), repeats), np.nan)
    for i, repeat in product(range(len(MODULES)), range(repeats)):
        imports[i, repeat] = _measure("", (), None, MODULES[i])[0]
    scenes = [get_scene(name, tip) for name in EXTRAS]
    size = np.array([[scene.dtype.itemsize * scene.n_outputs(outputs) for outputs in ("field", "pad")]
                     for scene in scenes])
    dims = ("scene", "way", "repeat")
    units = {"import_seconds": ("time of the imports", "s"),
             "answer_seconds": ("time from there to the first answer", "s"),
             "peak_bytes": ("peak resident memory of the process", "byte"), "modules": ("modules loaded", "1")}
    return xr.Dataset({
        **{name: (dims, found[name], {"long_name": text, "units": unit}) for name, (text, unit) in units.items()},
        "module_seconds": (("module", "repeat"), imports, {"long_name": "time of one import", "units": "s"}),
        "output_bytes": (("scene", "outputs"), size, {"long_name": "size of one answer", "units": "byte"}),
    }, coords={"scene": list(EXTRAS), "way": ways, "module": list(MODULES), "outputs": ["field", "pad"]},
        attrs={"fingertip": script.spoken(tip)})


def _measure(scene: str, extras: tuple[str, ...], density: dict | None, imports: str | None = None) -> list[float]:
    """One process; its four measures."""
    done = subprocess.run([sys.executable, "-c", WORKER, json.dumps([scene, extras, density, imports])],
                          capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def medians(results: xr.Dataset) -> xr.Dataset:
    """Over the repeats; NaN where a way does not exist for a scene."""
    found = results[list(MEASURES)].median("repeat")
    return found.assign(seconds=found["import_seconds"] + found["answer_seconds"])


def findings(results: xr.Dataset) -> list[str]:
    """Time and memory saved scene by scene; the dearest part; the imports."""
    middle = medians(results)
    sentences = []
    for scene in middle["scene"].values:
        one = middle.sel(scene=scene)
        lean, full = one.sel(way="lean"), one.sel(way=EVERYTHING)
        parts = (one["seconds"] - lean["seconds"]).sel(way=list(EXTRAS[str(scene)]))
        dearest = str(parts["way"].values[int(np.argmax(parts.values))])
        sentences.append(
            f"{scene}: the first answer takes {words.seconds(float(lean['seconds']))} and "
            f"{float(lean['peak_bytes']) / 1e6:.0f} MB, everything built "
            f"{words.seconds(float(full['seconds']))} and {float(full['peak_bytes']) / 1e6:.0f} MB: "
            f"{float(full['seconds'] / lean['seconds']):.1f} times the time and "
            f"{float(full['peak_bytes'] / lean['peak_bytes']):.1f} times the memory; the dearest thing left out is "
            f"`{dearest}`, {words.seconds(max(0.0, float(parts.max())))}.")
    imports = results["module_seconds"].median("repeat")
    share = results["output_bytes"].sel(outputs="field") / results["output_bytes"].sel(outputs="pad")
    sentences.append("Imports: " + ", ".join(f"`{name}` {words.seconds(float(imports.sel(module=name)))}"
                                             for name in results["module"].values) + ".")
    sentences.append(f"An answer for the pad alone is {float(share.min()):.0f} times smaller than the full field; "
                     "a direct solve computes the field all the same, stored responses and modes do not.")
    return sentences


def tables(results: xr.Dataset) -> list[str]:
    """Every way of every scene."""
    middle, rows = medians(results), []
    for scene in middle["scene"].values:
        for way in middle["way"].values:
            one = middle.sel(scene=scene, way=way)
            if np.isfinite(one["seconds"]):
                rows.append(("", [html.named(f"{scene}, {SPOKEN[str(way)]}"), *(html.cell(text) for text in (
                    words.seconds(float(one["import_seconds"])), words.seconds(float(one["answer_seconds"])),
                    f"{float(one['peak_bytes']) / 1e6:.0f} MB", f"{int(one['modules']):,}"))]))
    return [html.table(f"Medians of {results.sizes['repeat']} processes each; the direct solver answers one case.",
                       ["way", "imports", "from there to the first answer", "peak memory", "modules loaded"], rows)]


if __name__ == "__main__":
    script.run(main, draw, findings, "left-out", tables=tables)
