"""What do the published facts say about the surfaces that the tables leave open, and which facts disagree?

Table 1 gives dimensions, not surfaces.  Nine numbers describe the family (`analysis.surface_fit.FAMILY`); they are
fitted to the published volume, five frequencies and the order of the modes with either rear, on a cheap mesh with exact
frequency derivatives and factors to the real mesh found at the start.  Each fact is then left out in turn, to see
whether the others predict it, and the eighth frequency is pulled up and down, to see what it costs the rest.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import script
import surface_calibration_figures as figures
import xarray as xr
from analysis import surface_fit
from analysis.surface_fit import (
    FAMILY,
    LABELS,
    MARGIN,
    MODE_LABELS,
    ORDER,
    REARS,
    Characteristics,
    Facts,
    characteristics,
    fit_surface,
)

from rom.cache import cached_path
from rom.errors import AnatomyError
from rom.files import whole_file
from rom.fingertip import PRESETS, Anatomy, MeshDensity, build_mesh
from rom.provenance import source_digest

CHEAP, QUICK_CHEAP = MeshDensity((10, 10), 5, 5, (1, 1, 2, 3)), MeshDensity((6, 6), 3, 3, (1, 1, 1, 2))
PLAIN = {name: one.plain for name, one in FAMILY.items()}
FULLER = {"lower_exponent": 3.0, "equator_exponent": 2.2, "dorsal_fraction": 0.45, "bone_axis_rise": 0.5,
          "bone_base_length": 2.0, "bone_section_exponent": 2.5, "tuft_fraction": 0.7, "bone_end_exponent": 1.7,
          "nail_bed_thickness": 2.0}
"""A second start, found while families of up to twelve numbers were tried: squarer bone, fuller equator, deeper bed."""
LEFT_OUT = ("volume", "mode_1", "mode_2", "mode_4_about", "mode_7", "mode_8", "order_fixed")
OUTLINED = ("plain", "adopted")
PULLS = (0.96, 0.98, 1.0, 1.02)
"""Factors on the eighth frequency that the trade-off asks for, with a tenth of its usual tolerance."""


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """What do the published facts say about the surfaces that the tables leave open, and which facts disagree?"""
    cheap, real = (QUICK_CHEAP, CHEAP) if quick else (CHEAP, PRESETS["study"])
    evaluations = 3 if quick else 16
    facts = Facts.published()
    adopted = {name: getattr(Anatomy().shape, name) for name in FAMILY}

    plain, fuller = (_correction(start, cheap, real) for start in (PLAIN, FULLER))
    jobs = {"fit from plain": (facts, plain, PLAIN), "fit from fuller": (facts, fuller, FULLER)}
    jobs |= {f"without {name}": (facts.without(name), plain, PLAIN) for name in (LEFT_OUT[-2:] if quick else LEFT_OUT)}
    here = _correction(adopted, cheap, real)
    for pull in (PULLS[-1:] if quick else PULLS):
        frequency = {**facts.frequency, "mode_8": pull * facts.frequency["mode_8"]}
        hard = {**facts.tolerance, "mode_8": facts.tolerance["mode_8"] / 10}
        jobs[f"mode 8 at {pull:g}"] = (replace(facts, frequency=frequency, tolerance=hard), here, adopted)

    shapes = {"plain": PLAIN, "adopted": adopted}
    cost, counted = {"plain": np.nan, "adopted": np.nan}, {"plain": 0, "adopted": 0}
    for name, (wanted, correction, start) in progress(list(jobs.items()), "fits"):
        shapes[name], cost[name], counted[name] = _fit(wanted, cheap, correction, start, evaluations)
    found = {name: _on_real_mesh(shape, real) for name, shape in progress(list(shapes.items()), "real mesh")}
    outlines = {name: _outlines(Anatomy().replace_shape(**shapes[name])) for name in OUTLINED}
    return _dataset(facts, shapes, found, cost, counted).assign({
        f"outline_{section}": (("outlined", "surface", f"{section}_point", "axis"), np.stack(
            [outlines[name][section] for name in OUTLINED]), {
                "long_name": f"{section} section of skin, skin's lower face and bone", "units": "mm"})
        for section in ("longitudinal", "lateral")}).assign_coords(
            outlined=list(OUTLINED), surface=["skin", "lower face of dermis and nail bed", "bone"],
            axis=["horizontal", "vertical"])


def _outlines(anatomy: Anatomy) -> dict[str, np.ndarray]:
    """Mid-plane (x, z) and a section across (y, z) through skin, the hypodermis' upper face and bone [mm]."""
    mesh = build_mesh(anatomy, PRESETS["study"])
    per_shell, skin = mesh.nodes_per_shell, mesh.logical[: mesh.nodes_per_shell]
    middle = np.flatnonzero(skin[:, 0] == 0)
    middle = middle[np.argsort(skin[middle, 1])]
    rho = np.abs(skin[:, :2]).max(axis=1)
    front = np.unique(rho[(rho > 0.5) & (rho < 1)])
    ring = np.flatnonzero(rho == front[len(front) // 2])
    shells = per_shell * np.array([0, mesh.n_shells - 1 - mesh.density.layers[3], mesh.n_shells - 1])[:, None]
    return {"longitudinal": mesh.nodes[shells + middle][..., [0, 2]] * 1e3,
            "lateral": mesh.nodes[shells + np.append(ring, ring[0])][..., [1, 2]] * 1e3}


def _on_real_mesh(shape: dict[str, float], real: MeshDensity) -> Characteristics:
    """What a shape has on the real mesh; NaN where that finds no room for the layers, which the cheap one still did."""
    try:
        return characteristics(Anatomy().replace_shape(**shape), real)
    except AnatomyError:
        nothing = np.full((len(REARS), len(LABELS)), np.nan)
        return Characteristics(nothing, np.nan, np.empty((len(REARS), len(LABELS), 0)), np.empty(0))


def _correction(shape: dict[str, float], cheap: MeshDensity, real: MeshDensity) -> tuple[np.ndarray, float]:
    """Factors from the cheap mesh's frequencies and volume to the real mesh's."""
    anatomy = Anatomy().replace_shape(**shape)
    low, high = characteristics(anatomy, cheap), characteristics(anatomy, real)
    return high.frequency / low.frequency, high.volume / low.volume


def _fit(facts: Facts, density: MeshDensity, correction: tuple[np.ndarray, float], start: dict[str, float],
         evaluations: int) -> tuple[dict[str, float], float, int]:
    """Shape, cost and number of shapes looked at; kept, so that a run that was cut off goes on."""
    recipe = {"facts": asdict(facts), "density": density.to_dict(), "start": start, "evaluations": evaluations,
              "correction": [correction[0].round(9).tolist(), round(correction[1], 9)],
              "source": source_digest(surface_fit.__file__)}
    path = cached_path("surface-fits", recipe, ".json")
    if not path.exists():
        fit = fit_surface(facts, density, correction, start=start, evaluations=evaluations)
        with whole_file(path) as temporary:
            Path(temporary).write_text(json.dumps([fit.shape, fit.cost, fit.evaluations]), encoding="utf-8")
    shape, cost, counted = json.loads(path.read_text(encoding="utf-8"))
    return shape, cost, counted


def _dataset(facts: Facts, shapes: dict[str, dict[str, float]], found: dict[str, Characteristics],
             cost: dict[str, float], counted: dict[str, int]) -> xr.Dataset:
    names = ["volume", *MODE_LABELS]
    published = [facts.volume, *(facts.frequency[name] for name in MODE_LABELS)]
    values = np.array([[one.volume, *(_of(one, labels) for labels in MODE_LABELS.values())] for one in found.values()])
    gap = np.array([[[_row(one, r, above) / _row(one, r, below) - 1 for below, above in ORDER] for r in range(2)]
                    for one in found.values()])
    one = {"units": "1"}
    return xr.Dataset({
        "assumption_value": (("fit", "assumption"), [[s[name] for name in FAMILY] for s in shapes.values()], {
            "long_name": "value of the surface assumption (bone_axis_rise, bone_base_length, nail_bed_thickness in mm)",
            **one}),
        "bound": (("assumption", "end"), [[r.low, r.high] for r in FAMILY.values()], {
            "long_name": "least and largest value that the fit may take", **one}),
        "natural_frequency": (("fit", "rear", "label"), np.stack([c.frequency for c in found.values()]), {
            "long_name": "natural frequency on the real mesh, full integration", "units": "Hz"}),
        "published": ("fact", published, {"long_name": "published value, mm3 for the volume, else Hz", **one}),
        "found": (("fit", "fact"), values, {"long_name": "computed value, mm3 for the volume, else Hz", **one}),
        "deviation": (("fit", "fact"), values / np.array(published) - 1, {
            "long_name": "computed over published value, less one", **one}),
        "order_gap": (("fit", "rear", "neighbours"), gap, {
            "long_name": "relative distance of neighbours in the published order; negative where they change places",
            **one}),
        "rise": (("fit", "label"), np.stack([c.frequency[1] / c.frequency[0] - 1 for c in found.values()]), {
            "long_name": "relative rise of the frequency where the rear is fixed", **one}),
        "cost": ("fit", list(cost.values()), {"long_name": "sum of squared residuals on the cheap mesh", **one}),
        "evaluations": ("fit", list(counted.values()), {"long_name": "shapes whose modes were computed", **one}),
    }, coords={"fit": list(shapes), "assumption": list(FAMILY), "end": ["low", "high"], "rear": list(REARS),
               "label": list(LABELS), "fact": names, "neighbours": [f"{a} below {b}" for a, b in ORDER]},
        attrs={"margin": MARGIN})


def _row(found: Characteristics, rear: int, label: str) -> float:
    return float(found.frequency[rear, LABELS.index(label)])


def _of(found: Characteristics, labels: tuple[str, ...]) -> float:
    return min(_row(found, 0, label) for label in labels)


if __name__ == "__main__":
    script.run(main, figures.draw, figures.findings, "surface-calibration", tables=figures.tables)
