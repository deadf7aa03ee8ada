"""A finger on glass: the published study of collagen fibres and contact, computed anew and judged claim by claim.

Three arrangements of fibres are pressed with up to 2 N and slid 8 mm under 0.5 N on three meshes, the random one with
several seeds. What the publication leaves open (dimensions of the section, out-of-plane stiffness, effective length,
penalties) is varied one by one, and every claim judged again. Where full slip is not where it is published, a sweep
shows what would put it there, and what that costs.
"""

from __future__ import annotations

from dataclasses import fields, replace

import collagen_contact_claims as claims
import numpy as np
import script
import xarray as xr
from analysis.contact_outputs import RECEPTOR_DEPTH, receptor_strain, stretches
from collagen_contact_claims import PROFILE, Measures, judge, mean_of, measures, profiles
from collagen_contact_figures import draw
from collagen_contact_findings import findings, tables
from collagen_contact_paths import FORCE, PRESSING, SLIDING, Run, followed, runs

from rom.finger_on_glass.finger import State
from rom.finger_on_glass.tissue import VARIANTS

TRAVELS = (0.0, 2.0, 3.0, 4.0)
"""Of the published profiles [mm]."""
CURVES = ("normal_displacement", "tangential_displacement", "normal_force", "tangential_force", "area", "width",
          "peak_pressure", "largest_fibre", "energy", "work", "dissipated", "viscosity", "iterations",
          "slipping", "touching")
MESH = ("variant", "seed", "mesh")


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """What do collagen fibres do to a finger that is pressed on glass and slides, and which published claims hold?"""
    listed = runs(quick)
    main_runs = [run for run in listed if run.group in ("pressing", "sliding")]
    meshes = sorted({(run.finger.rays, run.finger.layers) for run in main_runs})
    seeds = sorted({run.finger.tissue.seed for run in main_runs})
    store = _Store(len(meshes), len(seeds))
    found: dict[str, list[tuple[Run, Measures]]] = {"sliding": [], "assumption": [], "sweep": []}
    bulk, viscous, ended = [], [], []
    for run, path in followed(listed, progress):
        if not path.attrs["complete"]:
            ended.append(f"{run.group} {run.label}: {path.attrs['reason']}")
        if run.group in ("pressing", "sliding"):
            mesh = meshes.index((run.finger.rays, run.finger.layers))
            store.add(run, path, seeds.index(run.finger.tissue.seed), mesh)
        if run.group in found and int((path["tangential_displacement"] == 0).sum()) == len(SLIDING.normal_force):
            found[run.group].append((run, measures(path)))
        elif run.group == "bulk":
            bulk.append((run, path))
        elif run.group == "viscosity":
            viscous.append((run, path))
    parts = [store.dataset(), _claims(found["sliding"], meshes), _assumptions(found["assumption"]),
             _sweeps(found["sweep"]), _bulk(bulk), _viscous(viscous)]
    names = [f"{rays} x {layers}" for rays, layers in meshes]
    return xr.merge(parts, combine_attrs="drop").assign_coords(
        variant=list(VARIANTS), seed=seeds, mesh=names).assign_attrs(
        reference=names[len(names) // 2], ended=" | ".join(ended), window_mm=claims.WINDOW, full_slip=claims.FULL_SLIP,
        **{f"published_slip_{name}": slip for name, slip in claims.published_slip().items()})


class _Store:
    """Curves of all main paths; profiles, maps and receptor strains on the reference mesh."""

    def __init__(self, n_mesh: int, n_seed: int) -> None:
        self.reference = n_mesh // 2
        shape = (len(VARIANTS), n_seed, n_mesh)
        self.curves = {kind: {name: np.full((*shape, n), np.nan) for name in CURVES} for kind, n in (
            ("pressing", len(PRESSING.normal_force)), ("sliding", len(SLIDING.normal_force) + len(SLIDING.travel)))}
        self.traction = np.full((2, len(VARIANTS), n_seed, len(TRAVELS), len(PROFILE)), np.nan)
        self.maps: dict[str, tuple] = {}
        self.strain: dict[str, tuple] = {}

    def add(self, run: Run, path: xr.Dataset, seed: int, mesh: int) -> None:
        """Keep what is wanted of one path."""
        variant = VARIANTS.index(run.finger.tissue.variant)
        reached = _on_positions(path)
        for name in CURVES:
            self.curves[run.group][name][variant, seed, mesh, :reached] = path[name].values[:reached]
        if mesh != self.reference:
            return
        if run.group == "sliding":
            travel = 1e3 * path["tangential_displacement"].values
            for k, wanted in enumerate(TRAVELS):
                at = np.flatnonzero(np.abs(travel - wanted) < 1e-6)
                if len(at):
                    self.traction[:, variant, seed, k] = 1e3 * np.stack(profiles(path, int(at[-1])))
        if seed == 0:
            self._fields(run, path, variant)

    def _fields(self, run: Run, path: xr.Dataset, variant: int) -> None:
        finger = run.finger
        chosen = (int(np.argmin(np.abs(path["normal_displacement"].values - 1e-3))) if run.group == "pressing"
                  else path.sizes["position"] - 1)
        state = _state(run, path, chosen)
        n_quad, n_node = len(finger.mesh.quads), len(finger.mesh.nodes)
        for name, shape in (("lambda_r", (n_quad,)), ("lambda_theta", (n_quad,)), ("map_displacement", (n_node, 2))):
            self.maps.setdefault(name, np.full((2, len(VARIANTS), *shape), np.nan))
        row = 0 if run.group == "pressing" else 1
        self.maps["lambda_r"][row, variant], self.maps["lambda_theta"][row, variant] = stretches(finger, state)
        self.maps["map_displacement"][row, variant] = 1e-3 * state.displacement
        self.mesh = finger.mesh
        if run.group == "sliding":
            travel = 1e3 * path["tangential_displacement"].values
            for k, wanted in enumerate(TRAVELS):
                at = np.flatnonzero(np.abs(travel - wanted) < 1e-6)
                if not len(at):
                    continue
                strain = receptor_strain(finger, _state(run, path, int(at[-1])))
                shape = len(VARIANTS), len(TRAVELS), finger.mesh.rays
                for name in ("radial", "circumferential", "shear"):
                    self.strain.setdefault(name, np.full(shape, np.nan))[variant, k] = getattr(strain, name)
                self.position = strain.position

    def dataset(self) -> xr.Dataset:
        """Everything that was kept."""
        data: dict[str, tuple] = {}
        for kind, curves in self.curves.items():
            for name, values in curves.items():
                data[f"{kind}_{name}"] = ((*MESH, f"{kind}_position"), values, _meaning(name))
        pascal = {"units": "Pa"}
        for k, name in enumerate(("pressure", "shear")):
            data[f"profile_{name}"] = (("variant", "seed", "travel", "x"), self.traction[k], {
                "long_name": f"{name} along the plate, moving average", **pascal})
        for name in ("lambda_r", "lambda_theta"):
            data[name] = (("state", "variant", "quad"), self.maps[name].astype(np.float32), {
                "long_name": f"stretch {'away from' if name == 'lambda_r' else 'around'} the bone", "units": "1"})
        data["map_displacement"] = (("state", "variant", "node", "component"),
                                    self.maps["map_displacement"].astype(np.float32), {
            "long_name": "displacement in that state", "units": "m"})
        for name, values in self.strain.items():
            data[f"receptor_{name}"] = (("variant", "travel", "ray"), values, {
                "long_name": f"Green strain, {name}, {RECEPTOR_DEPTH:g} mm below the skin", "units": "1"})
        data["quads"] = (("quad", "corner"), self.mesh.quads, {"long_name": "corners of the elements", "units": "1"})
        return xr.Dataset(data, coords={
            "state": ["pressed to about 1 mm", "slid 8 mm under 0.5 N"],
            "travel": ("travel", 1e-3 * np.array(TRAVELS), {"long_name": "travel of the plate", "units": "m"}),
            "x": ("x", 1e-3 * PROFILE, {"long_name": "along the plate, from the bone's middle", "units": "m"}),
            "ray_position": ("ray", 1e-3 * self.position, {
                "long_name": "along the undeformed skin from the pad's middle", "units": "m"}),
            **{f"node_{axis}": ("node", 1e-3 * self.mesh.nodes[:, k], {
                "long_name": f"{axis} of an undeformed node", "units": "m"}) for k, axis in enumerate("xy")}})


def _state(run: Run, path: xr.Dataset, k: int) -> State:
    """A recorded position as far as strains ask for it: its displacement."""
    return replace(run.finger.at_rest(), displacement=1e3 * path["displacement"].values[k])


def _on_positions(path: xr.Dataset) -> int:
    """How many records stand on positions of the path; the last one of a cut path does not."""
    return path.sizes["position"] - (0 if path.attrs["complete"] else 1)


def _meaning(name: str) -> dict[str, str]:
    from rom.finger_on_glass.record import SCALARS

    _, _, units, spoken = SCALARS[name]
    return {"long_name": spoken, "units": units}


# ---- claims, assumptions, sweeps ----------------------------------------------------------------------------

def _claims(found: list[tuple[Run, Measures]], meshes: list[tuple[int, int]]) -> xr.Dataset:
    """Measures of each variant on each mesh, mean and spread over seeds; the claims on the reference mesh."""
    names = [entry.name for entry in fields(Measures)]
    mean, spread = (np.full((len(VARIANTS), len(meshes), len(names)), np.nan) for _ in range(2))
    judged = {}
    for k, (rays, _) in enumerate(meshes):
        here = [(run, m) for run, m in found if run.finger.rays == rays]
        at = {v: [m for run, m in here if run.finger.tissue.variant == v] for v in VARIANTS}
        for i, variant in enumerate(VARIANTS):
            if at[variant]:
                values = np.array([list(vars(one).values()) for one in at[variant]])
                mean[i, k], spread[i, k] = values.mean(axis=0), np.ptp(values, axis=0)
        judged[k] = judge({v: mean_of(at[v]) if at[v] else Measures(*[np.nan] * len(names)) for v in VARIANTS})
    one, reference = {"units": "1"}, judged[len(meshes) // 2]
    return xr.Dataset({
        "measure_mean": (("variant", "mesh", "measure"), mean, {
            "long_name": "mean over seeds, lengths in mm, areas in mm2, pressure in kPa", **one}),
        "measure_spread": (("variant", "mesh", "measure"), spread, {
            "long_name": "largest less smallest over seeds", **one}),
        "claim_met": (("mesh", "claim"), np.array([[int(c.met) for c in judged[k]] for k in judged]), {
            "long_name": "whether a published claim holds", **one}),
        "claim_text": (("claim",), np.array([c.text for c in reference], dtype=object), {
            "long_name": "what was found on the reference mesh", **one}),
    }, coords={"measure": names, "claim": [c.name for c in reference]})


def _assumptions(found: list[tuple[Run, Measures]]) -> xr.Dataset:
    """The claims judged again with one input changed at a time."""
    levels: dict[str, dict[str, Measures]] = {}
    for run, one in found:
        variant, group, level = run.label.split("|")
        levels.setdefault(group if group == level else f"{group}: {level}", {})[variant] = one
    names = [entry.name for entry in fields(Measures)]
    none = Measures(*[np.nan] * len(names))
    met = [[int(c.met) for c in judge({v: some.get(v, none) for v in VARIANTS})] for some in levels.values()]
    values = [[list(vars(some.get(v, none)).values()) for v in VARIANTS] for some in levels.values()]
    return xr.Dataset({
        "assumption_met": (("assumption", "claim"), np.array(met), {
            "long_name": "whether a claim holds with one input changed", "units": "1"}),
        "assumption_measure": (("assumption", "variant", "measure"), np.array(values), {
            "long_name": "measures with one input changed", "units": "1"})},
        coords={"assumption": list(levels)})


def _sweeps(found: list[tuple[Run, Measures]]) -> xr.Dataset:
    """Slip, approach and area of radial and random over inputs that might put slip where it is published."""
    entries: dict[tuple[str, float], dict[str, Measures]] = {}
    for run, one in found:
        variant, name, value = run.label.split("|")
        entries.setdefault((name, float(value)), {})[variant] = one
    values = np.array([[[one[v].slip, one[v].approach, one[v].area, one[v].flatness] for v in ("radial", "random")]
                       for one in entries.values()])
    return xr.Dataset({
        f"sweep_{name}": (("sweep", "two"), values[..., k], {"long_name": spoken, "units": units})
        for k, (name, spoken, units) in enumerate((
            ("slip", "travel at full slip [mm]", "1"), ("approach", "approach at 0.5 N [mm]", "1"),
            ("area", "contact area at 0.5 N [mm2]", "1"), ("flatness", "largest over mean pressure", "1")))},
        coords={"two": ["radial", "random"], "sweep_input": ("sweep", [name for name, _ in entries]),
                "sweep_value": ("sweep", [value for _, value in entries])})


def _bulk(found: list[tuple[Run, xr.Dataset]]) -> xr.Dataset:
    ratios = sorted({run.finger.tissue.bulk_ratio for run, _ in found})
    counts = np.full((len(VARIANTS), len(ratios)), np.nan)
    for run, path in found:
        counts[VARIANTS.index(run.finger.tissue.variant), ratios.index(run.finger.tissue.bulk_ratio)] = float(
            path["iterations"][-1]) / float(path["steps"][-1])
    return xr.Dataset({"bulk_iterations": (("variant", "bulk_ratio"), counts, {
        "long_name": "Newton iterations a step", "units": "1"})}, coords={"bulk_ratio": ratios})


def _viscous(found: list[tuple[Run, xr.Dataset]]) -> xr.Dataset:
    """What viscous resistance changes, against the same path without it."""
    levels = sorted({run.viscosities[0] for run, _ in found})
    n = len(SLIDING.normal_force) + 20
    curves = np.full((2, len(VARIANTS), len(levels), n), np.nan)
    for run, path in found:
        m = min(n, _on_positions(path))
        at = VARIANTS.index(run.finger.tissue.variant), levels.index(run.viscosities[0])
        for k, name in enumerate(("tangential_force", "area")):
            curves[(k, *at, slice(None, m))] = path[name].values[:m]
    force = np.nanmax(np.abs(curves[0] - curves[0][:, :1]), axis=-1) / FORCE
    area = np.nanmax(np.abs(curves[1] / curves[1][:, :1] - 1), axis=-1)
    one = {"units": "1"}
    return xr.Dataset({
        "viscous_force": (("variant", "viscosity"), force, {
            "long_name": "largest change of the tangential force over the normal one, up to 4 mm", **one}),
        "viscous_area": (("variant", "viscosity"), area, {
            "long_name": "largest relative change of the area, up to 4 mm", **one})},
        coords={"viscosity": ("viscosity", 1e6 * np.array(levels), {"long_name": "viscous resistance", "units": "Pa"})})


if __name__ == "__main__":
    script.run(main, draw, findings, "collagen-contact", tables=tables)
