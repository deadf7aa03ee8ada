"""Strain where the mechanoreceptors lie, under 0.1 N at the fingerprint centroid, and what reduction adds to its error.

Meissner corpuscles sit in the papillae of the dermis, so the strain at the epidermis-dermis border is taken on its
dermal side; the dermis-hypodermis border, near which Pacinian corpuscles begin, is given on both sides, because strain
jumps there. Static answers stand for the slow limit of a cycle. Principal strains belong to the instant of the cycle at
which the strain energy density is largest; energy densities are peaks over the cycle (`rom.fingertip.strain_measures`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import script
import xarray as xr
from tissue_strain_figures import at, draw, errors_in_vibration, percent

from rom.datasets.schema import dataset_attributes
from rom.datasets.vtu import write_vtu
from rom.fingertip import DIRECTIONS, Fingertip, strain
from rom.fingertip import strain_measures as measures
from rom.fingertip.anatomy import TISSUES
from rom.fingertip.body import AXES
from rom.metamodels import create
from rom.relative import relative_errors
from rom.reporting import html, words
from rom.scenes import CaseArrays, LinearScene, get_scene
from rom.vibration.frequency_response import sweep_cases

FREQUENCY = (0.0, 50.0, 125.0, 250.0)
"""Static, and three within the bands of the fast-adapting receptors [Hz]."""
FORCE = 0.1
LOSS_FACTOR = 0.1
METHODS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("modal", {}), ("modal", {"modes": 40}), ("modal-static", {}), ("modal-static", {"modes": 40}),
    ("modal-krylov", {"modes": 12, "vectors": 2}), ("modal-krylov", {"modes": 12, "vectors": 4}),
    ("modal-krylov", {"modes": 12, "vectors": 8}),
    ("pod-galerkin", {"rank": 6}), ("pod-galerkin", {"rank": 12}), ("pod-galerkin", {"rank": 18}))
"""Without a number of modes, a modal method keeps those of the scene's band."""
TRAIN_HZ = np.linspace(10.0, 260.0, 14)
"""Frequencies of the snapshots of `pod-galerkin`, all three directions at each."""
MILLIMETRE = 1e-3


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """How large is the strain where the mechanoreceptors lie, and how wrong does reduction make it?"""
    scene = get_scene("harmonic-patch-forces", script.fingertip(quick, "study"))
    tip, mesh = scene.body.fingertip, scene.body.fingertip.mesh
    cases = load_cases(scene)
    truth = scene.solve(cases)[0]["displacement"]
    depths = receptor_depths(tip)
    pad = strain.pad_quads(mesh)
    points = [strain.points_at_depth(mesh, depth * MILLIMETRE, side, pad) for _, depth, side in depths]
    exact = Sampled(tip, points, truth)
    count = (len(FREQUENCY), len(DIRECTIONS))
    dims = ("frequency", "direction", "depth", "pad_quad")

    def on_pad(values: np.ndarray) -> np.ndarray:
        """(frequency, direction, depth, pad_quad) from (depth, case, pad_quad)."""
        return values.reshape(len(depths), *count, -1).transpose(1, 2, 0, 3)

    results = xr.Dataset(
        {
            "principal_strain": (dims, on_pad(exact.principal()), {
                "long_name": "largest principal strain at the instant of largest energy density", "units": "1"}),
            "cycle_principal_strain": (dims, on_pad(exact.cycle_principal()), {
                "long_name": "largest principal strain of the whole cycle, sampled", "units": "1"}),
            "energy_density": (dims, on_pad(exact.energy()), {
                "long_name": "strain energy density, peak over the cycle", "units": "J m-3"}),
            "depth_mm": ("depth", [depth for _, depth, _ in depths], {
                "long_name": "depth below the skin, along its normal", "units": "mm"}),
            "side": ("depth", [side for _, _, side in depths], {"long_name": "side of the border of elements"}),
            "pad_skin_quad": ("pad_quad", pad, {
                "long_name": "quadrilateral of the skin above, row of skin_quad", "units": "1"}),
            "skin_quads": (("skin_quad", "corner"), mesh.skin_quads, {
                "long_name": "corners of the skin's quadrilaterals, rows of skin_node", "units": "1"}),
            "load_node": ("load", mesh.skin_patch(mesh.fingerprint_centroid), {
                "long_name": "skin nodes that share the force", "units": "1"}),
            **{f"skin_{name}": ("skin_node", mesh.nodes[mesh.skin_nodes, a], {"long_name": text, "units": "m"})
               for a, (name, text) in enumerate(zip("xyz", AXES, strict=True))},
            **_profile(tip, truth, count)},
        coords={
            "frequency": ("frequency", list(FREQUENCY), {"long_name": "excitation frequency, 0 static", "units": "Hz"}),
            "direction": ("direction", list(DIRECTIONS), {"long_name": "direction of the force on the skin"}),
            "depth": ("depth", [name for name, _, _ in depths], {"long_name": "place below the skin"})},
        attrs={"force_n": FORCE, "loss_factor": LOSS_FACTOR, "formulation": tip.formulation,
               "fingertip": script.spoken(tip), "content_hash": tip.content_hash})
    return results.assign(_errors(scene, cases, truth, points, exact, progress))


def load_cases(scene: LinearScene) -> CaseArrays:
    """The three directions at each frequency, directions fastest; statics without loss factor."""
    cases = sweep_cases(scene, FREQUENCY, amplitude=FORCE, loss_factor=LOSS_FACTOR)
    cases.loss_factor[cases.frequency == 0.0] = 0.0
    return cases


def receptor_depths(tip: Fingertip) -> list[tuple[str, float, strain.Side]]:
    """Name, depth [mm] and side of the places that are looked at."""
    anatomy = tip.anatomy
    dermis = anatomy.stratum_corneum_thickness + anatomy.epidermis_thickness
    hypodermis = dermis + anatomy.dermis_thickness
    middle = 1.0 if dermis < 1.0 < hypodermis else (dermis + hypodermis) / 2
    return [(f"{dermis:g} mm (dermal side)", dermis, "deep"), (f"{middle:g} mm (dermis)", middle, "deep"),
            (f"{hypodermis:g} mm (dermal side)", hypodermis, "shallow"),
            (f"{hypodermis:g} mm (hypodermal side)", hypodermis, "deep")]


class Sampled:
    """Strain and displacement of many cases at points of several depths.

    Parameters
    ----------
    tip : Fingertip
    points : list of StrainPoints
    values : (n_case, n_free) ndarray [m]
    """

    def __init__(self, tip: Fingertip, points: list[strain.StrainPoints], values: np.ndarray) -> None:
        free = tip.free_dofs
        full = np.zeros((len(values), 3 * tip.mesh.n_nodes), dtype=complex)
        full[:, free] = values
        self.moduli = [one.moduli(tip) for one in points]
        self.strain = [strain.apply(strain.operator_at(tip, one), full) for one in points]
        nodal = full.reshape(len(full), -1, 3)
        self.displacement = [np.stack([one.interpolation(tip.mesh) @ u for u in nodal]) for one in points]

    def principal(self) -> np.ndarray:
        """(depth, case, p) ndarray [-] : largest principal strain at the instant of peak energy."""
        return np.stack([measures.principal_strains(measures.strain_at_peak(one, *moduli))[..., 0]
                         for one, moduli in zip(self.strain, self.moduli, strict=True)])

    def cycle_principal(self) -> np.ndarray:
        """(depth, case, p) ndarray [-] : the same over the whole cycle."""
        return np.stack([measures.largest_principal_over_cycle(one) for one in self.strain])

    def energy(self) -> np.ndarray:
        """(depth, case, p) ndarray [J/m3] : peak over the cycle."""
        return np.stack([measures.energy_density(one, *moduli)
                         for one, moduli in zip(self.strain, self.moduli, strict=True)])


def _profile(tip: Fingertip, truth: np.ndarray, count: tuple[int, int]) -> dict[str, tuple]:
    """Means over the four quadrilaterals at the load's centre, at the upper and lower face of every element layer."""
    mesh = tip.mesh
    quads = np.flatnonzero((mesh.skin_quads == mesh.fingerprint_centroid).any(axis=1))
    levels = strain.node_depths(mesh)[:, mesh.skin_quads[quads]].mean(axis=(1, 2))
    faces = [(layer, face) for layer in range(mesh.n_shells - 1) for face in (1.0, -1.0)]
    points = [strain.StrainPoints(layer * len(mesh.skin_quads) + quads, np.tile([0.0, 0.0, face], (len(quads), 1)))
              for layer, face in faces]
    found = Sampled(tip, points, truth)
    dims = ("frequency", "direction", "face")
    tissue = [TISSUES[mesh.tissue[one.element[0]]].replace("_", " ") for one in points]
    return {
        "profile_principal_strain": (dims, found.principal().mean(axis=2).T.reshape(*count, -1), {
            "long_name": "largest principal strain below the load", "units": "1"}),
        "profile_energy_density": (dims, found.energy().mean(axis=2).T.reshape(*count, -1), {
            "long_name": "peak strain energy density below the load", "units": "J m-3"}),
        "profile_depth": ("face", [levels[layer + (face < 0)] / MILLIMETRE for layer, face in faces], {
            "long_name": "depth of the upper and lower faces of the element layers", "units": "mm"}),
        "profile_tissue": ("face", tissue, {"long_name": "tissue of the element layer"})}


def _errors(scene: LinearScene, cases: CaseArrays, truth: np.ndarray, points: list[strain.StrainPoints],
            exact: Sampled, progress: script.Progress) -> dict[str, tuple]:
    """Errors of the reduced models, over the pad at each depth and over the whole field."""
    train = training(scene)
    area = _areas(scene.body.fingertip)
    rows: dict[str, list] = {name: [] for name in ("strain_error", "strain_error_max", "displacement_error",
                                                   "displacement_error_max", "field_error")}
    for name, settings in progress(list(METHODS), "reduced models"):
        model = create(name, scene, **settings).fit(train if name.startswith("pod") else None)
        answer = model.evaluate(cases)
        found = Sampled(scene.body.fingertip, points, answer)
        rows["field_error"].append(relative_errors(answer, truth).reshape(len(FREQUENCY), -1))
        for kind, mine, reference in (("strain", found.strain, exact.strain),
                                      ("displacement", found.displacement, exact.displacement)):
            pairs = [_over_pad(a, b, area) for a, b in zip(mine, reference, strict=True)]
            for key, values in zip((f"{kind}_error", f"{kind}_error_max"), zip(*pairs, strict=True), strict=True):
                rows[key].append(np.stack(values, axis=1).reshape(len(FREQUENCY), len(DIRECTIONS), -1))
    text = {"strain_error": "relative L2 error of the strain tensor over the pad",
            "strain_error_max": "largest error of the strain tensor over its largest size on the pad",
            "displacement_error": "relative L2 error of the displacement at the same points",
            "displacement_error_max": "largest error of the displacement over its largest size at the same points",
            "field_error": "relative error of the displacement of the whole field"}
    dims = ("method", "frequency", "direction")
    labels = [f"{name}: " + ", ".join(f"{key} {value}" for key, value in (settings or {"modes": "in band"}).items())
              for name, settings in METHODS]
    return {"method": ("method", labels, {"long_name": "reduced model and its settings"}),
            **{key: (dims if key == "field_error" else (*dims, "depth"), np.stack(values), {
                "long_name": text[key], "units": "1"}) for key, values in rows.items()}}


def training(scene: LinearScene) -> xr.Dataset:
    """Snapshots of the three directions over the band."""
    arrays = sweep_cases(scene, TRAIN_HZ, amplitude=FORCE, loss_factor=LOSS_FACTOR)
    values = scene.solve(arrays)[0]["displacement"]
    data = scene.label(scene.cases_from(arrays), values)
    data.attrs.update(dataset_attributes(scene))
    return data


def _areas(tip: Fingertip) -> np.ndarray:
    """(p,) ndarray [m2] : areas of the pad's quadrilaterals."""
    a, b, c, d = tip.mesh.nodes[tip.mesh.skin_quads[strain.pad_quads(tip.mesh)]].transpose(1, 0, 2)
    return np.linalg.norm(np.cross(c - a, d - b), axis=1) / 2


def _over_pad(answer: np.ndarray, truth: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Relative L2 and maximum errors of each case, (case,) each; strains in the norm of the tensor."""
    weight = np.array([1, 1, 1, 0.5, 0.5, 0.5]) if truth.shape[-1] == 6 else np.ones(3)
    miss = np.sum(weight * np.abs(answer - truth) ** 2, axis=-1)
    size = np.sum(weight * np.abs(truth) ** 2, axis=-1)
    return np.sqrt(miss @ area / (size @ area)), np.sqrt(miss.max(axis=1) / size.max(axis=1))


def findings(results: xr.Dataset) -> list[str]:
    """Where strain peaks, how it changes with frequency and depth, what reduction does to it."""
    hertz, way, depth, method = (results[name].values for name in ("frequency", "direction", "depth", "method"))
    peak, cycle = (results[name].transpose("frequency", "direction", "depth", "pad_quad").values.max(axis=3)
                   for name in ("principal_strain", "cycle_principal_strain"))
    f, d, k = np.unravel_index(peak.argmax(), peak.shape)
    rise = peak[1:, :, 0] / peak[0, :, 0]
    g, e = np.unravel_index(rise.argmax(), rise.shape)
    jump = peak[..., -1] / peak[..., -2]
    strain_error, other = errors_in_vibration(results)
    ratio = strain_error / other
    by_depth = np.median(ratio, axis=0)
    worst = strain_error.max(axis=1)
    least = int(worst.argmin())
    profile = results["profile_principal_strain"].values.max(axis=(0, 1))
    face = int(profile.argmax())
    return [
        f"Under {results.attrs['force_n']:g} N the largest principal strain of the pad's receptor layers is "
        f"{percent(peak[f, d, k])}, at {depth[k]}, with {way[d]} force, {at(hertz[f])}; below the load it is "
        f"{percent(profile[face])} in the {results['profile_tissue'].values[face]}, "
        f"{results['profile_depth'].values[face]:.1f} mm deep.",
        f"Reduction errs {words.ratio(float(np.median(ratio)))} as much in strain as in displacement at the same "
        f"points in the median over methods and depths, most at {depth[by_depth.argmax()]} "
        f"({words.ratio(by_depth.max())}), least at {depth[by_depth.argmin()]} ({words.ratio(by_depth.min())}).",
        f"In vibration the modes of the band alone miss up to {words.error(worst[0])} of the strain "
        f"({words.error(other[0].max())} of the displacement); the best method, {method[least]}, is off by at "
        f"most {words.error(worst[least])}.",
        f"Vibration changes the largest strain at {depth[0]} from its static value by {words.ratio(rise.min())} to "
        f"{words.ratio(rise.max())} ({way[e]} force, {at(hertz[1 + g])}).",
        "Across the border of dermis and hypodermis the largest principal strain changes by "
        f"{words.ratio(jump.min())} to {words.ratio(jump.max())}.",
        f"The instant of largest energy density misses up to {words.error(max((1 - peak / cycle).max(), 0.0))} of the "
        "largest principal strain of the whole cycle."]


def tables(results: xr.Dataset) -> list[str]:
    """Errors of every method, the largest of the vibrating cases."""
    moving = results.sel(frequency=results["frequency"] > 0)
    whole = moving["field_error"].max(("frequency", "direction")).values
    peak = moving["strain_error_max"].max(("frequency", "direction")).transpose("method", "depth").values
    strain_error, other = errors_in_vibration(results)
    depths = [str(name) for name in results["depth"].values]
    head = ["method", html.named("displacement", "whole field"), *(html.named("strain", str(name)) for name in depths)]
    rows = [("", [html.named(str(name)), html.cell(words.error(whole[i])),
                  *(html.cell(words.error(strain_error[i, k]), f"displacement {words.error(other[i, k])}, "
                              f"largest strain {words.error(peak[i, k])}") for k in range(len(depths)))])
            for i, name in enumerate(results["method"].values)]
    return [html.table("Relative L2 errors over the pad, largest over directions and frequencies above zero; below "
                       "them displacement at the same points, and largest error of strain over the largest strain.",
                       head, rows)]


def extra(results: xr.Dataset, folder: Path) -> list[Path]:
    """The whole field at the highest frequency for ParaView; nothing where the fingertip is no longer the same."""
    tip = script.fingertip(str(results.attrs.get("quick", "0")) == "1", "study")
    if tip.content_hash != results.attrs["content_hash"]:
        return []
    scene = get_scene("harmonic-patch-forces", tip)
    cases = load_cases(scene)
    hertz = float(results["frequency"].values[-1])
    values = scene.solve(cases.take(cases.frequency == hertz))[0]["displacement"]
    found = Sampled(tip, [strain.element_centres(tip.mesh)], values)
    nodal = scene.whole(values)
    points, cells = {}, {}
    for i, direction in enumerate(DIRECTIONS):
        points[f"displacement_{direction}_m"] = nodal[i].astype(np.complex64)
        cells[f"principal_strain_{direction}"] = found.principal()[0, i].astype(np.float32)
        cells[f"energy_density_{direction}_J_per_m3"] = found.energy()[0, i].astype(np.float32)
    return [write_vtu(folder / f"tissue-strain-{hertz:g}hz.vtu", tip.mesh, points, cells)]


if __name__ == "__main__":
    script.run(main, draw, findings, "tissue-strain", tables=tables, extra=extra)
