"""What the experiment on a finger on glass found, in sentences and tables."""

from __future__ import annotations

import numpy as np
import xarray as xr
from collagen_contact_paths import FORCE, SLIDING

from rom.reporting import html, words


def convergence(results: xr.Dataset) -> dict[str, np.ndarray]:
    """(variant, mesh) ndarrays: largest differences from the finest mesh, means over the seeds that all meshes have.

    Normal force over the approach up to 2 N and tangential force over the travel, relative to the largest; contact area
    in pressing and in sliding, relative to itself.
    """
    common = results["sliding_area"].notnull().any("sliding_position").all("mesh") | (results["variant"] != "random")
    several = results.where(common)

    def mean(name: str) -> np.ndarray:
        return several[name].mean("seed", skipna=True).values

    u, force, area = mean("pressing_normal_displacement"), mean("pressing_normal_force"), mean("pressing_area")
    found: dict[str, np.ndarray] = {}
    n_variant, n_mesh = u.shape[:2]
    for name in ("normal force", "area, pressing", "tangential force", "area, sliding"):
        found[name] = np.full((n_variant, n_mesh), np.nan)
    traction, slid = mean("sliding_tangential_force"), mean("sliding_area")
    for i in range(n_variant):
        for k in range(n_mesh):
            grid = np.linspace(u[i, -1, 0], u[i, -1, -1], 30)
            grid = grid[(grid >= u[i, k, 0]) & (grid <= u[i, k, -1])]
            one, last = (np.interp(grid, u[i, m], force[i, m]) for m in (k, n_mesh - 1))
            found["normal force"][i, k] = np.abs(one - last).max() / force[i, -1].max()
            found["area, pressing"][i, k] = np.abs(area[i, k] / area[i, -1] - 1).max()
            if not np.isfinite(slid[i, -1]).any():
                continue
            found["tangential force"][i, k] = np.nanmax(np.abs(traction[i, k] - traction[i, -1])) / FORCE
            change = np.abs(slid[i, k] / slid[i, -1] - 1)
            found["area, sliding"][i, k] = np.nanmax(change[len(SLIDING.normal_force) - 1:])
    return found


def checks(results: xr.Dataset) -> dict[str, float]:
    """Largest open energy, largest tangential over normal force, largest fibre strain, over all main paths."""
    worst = {"balance": 0.0, "friction": 0.0, "fibre": 0.0}
    for kind in ("pressing", "sliding"):
        work = results[f"{kind}_work"]
        open_ = abs(work - results[f"{kind}_energy"] - results[f"{kind}_dissipated"]) / work
        ratio = abs(results[f"{kind}_tangential_force"]) / results[f"{kind}_normal_force"]
        for name, value in (("balance", open_), ("friction", ratio), ("fibre", results[f"{kind}_largest_fibre"])):
            worst[name] = max(worst[name], float(value.max()))
    return worst


def wanted(results: xr.Dataset) -> list[str]:
    """What each swept input alone must be for published slip, between the swept values, and what that costs."""
    sentences = []
    base = results["assumption_measure"].sel(assumption="as assumed")
    inputs = list(dict.fromkeys(results["sweep_input"].values.tolist()))
    assumed = {"c [kPa]": 3.0, "effective length [mm]": 10.0, "offset of the bone [mm]": 1.0,
               "out-of-plane stiffness [N]": 100.0}
    for name in inputs:
        some = results.isel(sweep=results["sweep_input"].values == name)
        texts = []
        for variant in ("radial", "random"):
            target = results.attrs[f"published_slip_{variant}"]
            x = np.append(some["sweep_value"].values, assumed.get(name, 1.0))
            order = np.argsort(x)
            curves = {m: np.append(some[f"sweep_{m}"].sel(two=variant).values, float(base.sel(
                variant=variant, measure=m)))[order] for m in ("slip", "approach", "area")}
            x, known = x[order], np.isfinite(curves["slip"])
            gap = curves["slip"] - target
            change = np.flatnonzero(known[1:] & known[:-1] & (gap[1:] * gap[:-1] <= 0))
            if not len(change):
                texts.append(f"{variant} stays at {np.nanmin(curves['slip']):.1f} to "
                             f"{np.nanmax(curves['slip']):.1f} mm")
                continue
            k = change[np.argmin(np.abs(x[change] - assumed.get(name, 1.0)))]
            share = gap[k] / (gap[k] - gap[k + 1])
            curves["x"] = x
            at = {m: float(values[k] + share * (values[k + 1] - values[k])) for m, values in curves.items()}
            was = {m: float(base.sel(variant=variant, measure=m)) for m in ("approach", "area")}
            texts.append(
                f"{variant} needs {words.significant(at['x'], 2)}, with an approach of {at['approach']:.2f} mm at "
                f"{FORCE:g} N (instead of {was['approach']:.2f}) and {at['area']:.0f} mm² (instead of "
                f"{was['area']:.0f})")
        sentences.append(f"{name}: " + "; ".join(texts))
    return sentences


def findings(results: xr.Dataset) -> list[str]:
    """Claims met and not; what slip takes; what claims hang on; convergence, balance, viscosity."""
    reference = results.sel(mesh=results.attrs["reference"])
    met = reference["claim_met"].values.astype(bool)
    claims = results["claim"].values
    sentences = [
        f"{met.sum()} of {len(met)} published claims hold on the reference mesh ({results.attrs['reference']} "
        "elements): " + words.listed([str(c) for c in claims[met]]) + "."
        + (f" Not: {words.listed([str(c) for c in claims[~met]])}." if not met.all() else "")]
    sentences += [f"{name}: {'met' if ok else 'not met'}; {text}." for name, ok, text in zip(
        claims, met, results["claim_text"].values, strict=True)]
    sentences.append("What would put full slip where it is published, each input alone: "
                     + ". ".join(wanted(results)) + ".")
    changed = results["assumption_met"].sel(assumption=results["assumption"] != "as assumed")
    fragile = [f"{name} in {int(changed.sel(claim=name).sum())} of {changed.sizes['assumption']}" for name in claims]
    sentences.append("With one open assumption changed at a time the claims hold: " + words.listed(fragile) + ".")
    far = convergence(results)
    sentences.append("Mesh, largest difference of the middle from the finest: " + words.listed([
        f"{name} {' / '.join(words.error(float(v)) for v in values[:, -2])}" for name, values in far.items()])
        + f" ({' / '.join(results['variant'].values)}; forces over their largest, wanted 1 %; areas over themselves, "
        "wanted 3 %).")
    at_force = abs(results["measure_mean"].isel(mesh=-2) / results["measure_mean"].isel(mesh=-1) - 1)
    sentences.append(f"At {FORCE:g} N itself the same difference is " + words.listed([
        f"{text} {' / '.join(words.error(float(v)) for v in at_force.sel(measure=name).values)}" for name, text in (
            ("approach", "in the approach"), ("area", "in the area"), ("slip", "in the travel at full slip"))])
        + "; nodes that come into contact one by one leave stairs of a few percent in the area elsewhere, though its "
        "edge is looked for inside the elements.")
    worst = checks(results)
    travelled = results["sliding_tangential_displacement"].max("sliding_position")
    short = travelled.where(travelled < 7.999e-3)
    names = [f"{v} on {m} ({1e3 * float(short.sel(variant=v, mesh=m).max()):.1f} mm)" for v in results["variant"].values
             for m in results["mesh"].values if np.isfinite(short.sel(variant=v, mesh=m)).any()]
    names += [f"{v} on {m} (left out: it had not ended after several minutes)"
              for v in results["variant"].values for m in results["mesh"].values
              if not np.isfinite(travelled.sel(variant=v, mesh=m)).any()]
    sentences.append(
        ("All variants reach 2 N and 8 mm under 0.5 N, strictly converged, on every mesh" if not names else
         f"All variants reach 2 N, strictly converged; all paths reach 8 mm but {words.listed(names)}")
        + f"; energy closes within {words.error(worst['balance'])} of the work, tangential over normal force stays at "
        f"{worst['friction']:.6f} at most, the largest fibre strain lambda² - 1 at {worst['fibre']:.2f} of 0.9.")
    viscosity = results["sliding_viscosity"].max(["sliding_position", "seed"])
    used = [f"{v} on {m} {float(viscosity.sel(variant=v, mesh=m)):.0f} Pa" for v in results["variant"].values
            for m in results["mesh"].values if float(viscosity.sel(variant=v, mesh=m)) > 0]
    levels = results["viscosity"].values
    influence = [f"{level:.0f} Pa {words.error(float(results['viscous_force'].sel(viscosity=level).max()))} and "
                 f"{words.error(float(results['viscous_area'].sel(viscosity=level).max()))}"
                 for level in levels[levels > 0]]
    sentences.append(f"Viscous resistance is needed by {words.listed(used) or 'none'}; up to 4 mm, where all paths do "
                     f"without, it changes tangential force and area at most by {words.listed(influence)}.")
    counts = results["bulk_iterations"]
    sentences.append("Newton iterations a step from bulk over shear modulus "
                     f"{words.significant(float(counts['bulk_ratio'].min()))} to "
                     f"{words.significant(float(counts['bulk_ratio'].max()))}: " + words.listed([
                         f"{v} {float(counts.sel(variant=v).min()):.1f} to {float(counts.sel(variant=v).max()):.1f}"
                         for v in counts["variant"].values]) + ".")
    return sentences


def tables(results: xr.Dataset) -> list[str]:
    """Measures by variant and mesh; claims by assumption."""
    rows = []
    for v in results["variant"].values:
        for m in results["mesh"].values:
            one, spread = (results[f"measure_{kind}"].sel(variant=v, mesh=m).values for kind in ("mean", "spread"))
            rows.append(("", [html.named(f"{v}, {m}"), *(html.cell(
                words.NONE if np.isnan(a) else f"{a:.3g}" + (f" (spread {s:.2g})" if s > 0 else ""))
                for a, s in zip(one, spread, strict=True))]))
    listed = [html.table("Measures at 0.5 N, by variant and mesh; the random variant's are means over seeds.",
                         ["variant, mesh", "approach [mm]", "area [mm²]", "peak [kPa]", "peak over mean",
                          "full slip [mm]", "peak at 4 mm [mm]", "same, inside the contact", "suddenness [mm]",
                          "rolling at 8 mm [mm]", "area left at 4 mm", "F_T / (μ F_N) at 8 mm"], rows)]
    rows = []
    for name in results["assumption"].values:
        met = results["assumption_met"].sel(assumption=name).values
        slip = results["assumption_measure"].sel(assumption=name, measure="slip", variant=["radial", "random"]).values
        rows.append(("headline" if name == "as assumed" else "", [html.named(str(name)), *(
            html.cell("yes" if ok else "no", kind="pass" if ok else "fail") for ok in met),
            html.cell(" / ".join(words.NONE if np.isnan(s) else f"{s:.2f}" for s in slip))]))
    listed.append(html.table("Claims with one assumption changed, on a coarser mesh; the last column is full slip of "
                             "the radial and the random variant [mm].",
                             ["assumption", *(str(c) for c in results["claim"].values), "slip"], rows))
    if results.attrs["ended"]:
        listed.append(html.paragraph("Paths that ended early: " + results.attrs["ended"].replace(" | ", "; ")))
    return listed
