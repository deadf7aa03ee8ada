"""Results files as a comparison would write them, with invented but realistic numbers."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr

DIRECT_SECONDS = 0.55
# method: list of (setting, one case [s], published error, hard error, unseen-node error, offline [s])
HARMONIC = {
    "direct": [("", DIRECT_SECONDS, 0.0, 0.0, 0.0, 0.0)],
    "direct-reused": [("", 0.50, 2e-12, 2e-12, 2e-12, 0.0)],
    "coarse-fem": [("density=coarse", 0.06, 0.21, 0.3, 0.25, 0.5), ("density=medium", 0.2, 0.09, 0.14, 0.1, 1.1)],
    "modal": [("modes=11", 5e-5, 0.93, 1.4, 0.95, 4.0), ("modes=40", 9e-5, 0.55, 0.6, 0.56, 9.0),
              ("modes=100", 2e-4, 0.40, 0.41, 0.4, 20.0)],
    "modal-static": [("modes=40", 9.5e-5, 0.09, 0.15, 0.09, 14.0), ("modes=100", 2.1e-4, 0.023, 0.03, 0.023, 25.0)],
    "modal-krylov": [(f"modes={m} vectors={v} precision={p}",
                      (8e-5 + 1.5e-6 * m + 4e-6 * v) * (0.6 if p == "float32" else 1),
                      max(10.0 ** (-0.35 * v - m / 30 - 0.3), 3e-7 if p == "float32" else 1e-9),
                      max(10.0 ** (-0.33 * v - m / 33), 4e-7 if p == "float32" else 1e-9),
                      max(10.0 ** (-0.35 * v - m / 30 - 0.3), 3e-7 if p == "float32" else 1e-9), 12.0 + v + 0.1 * m)
                     for m in (20, 40, 60) for v in (2, 4, 8) for p in ("float64", "float32")],
    "pod-galerkin": [("rank=64", 2e-4, 0.2, 0.5, 0.6, 90.0), ("rank=256", 3e-4, 0.005, 0.33, 0.33, 95.0)],
    "pod-regression": [("rank=64", 6e-4, 0.6, 1.1, 1.0, 130.0)],
    "mlp": [("width=128", 4e-4, 0.55, 1.3, 0.9, 150.0), ("width=256", 6e-4, 0.31, 0.8, 0.7, 220.0)],
    "mlp-residual": [("width=256", 7e-4, 0.18, 0.4, 0.25, 240.0)],
}
STATIC = {
    "direct": [("", 0.08, 0.0, 0.0, 0.0, 0.0)],
    "direct-reused": [("", 0.031, 1e-13, 1e-13, 1e-13, 0.8)],
    "coarse-fem": [("density=coarse", 0.006, 0.13, 0.14, 0.13, 0.3)],
    "superposition": [("", 7e-5, 3e-14, 5e-14, 4e-14, 8.0)],
    "pod-galerkin": [("rank=32", 5e-5, 0.3, 0.6, 0.6, 7.0), ("rank=239", 9e-5, 0.004, 0.21, 0.21, 7.5)],
    "pod-regression": [("rank=64", 3e-4, 0.25, 0.9, 0.9, 12.0)],
    "transformer": [("width=64", 1.2e-3, 0.2, 0.7, 0.7, 160.0)],
}
HARMONIC_REGIONS = ["unseen node", "unseen frequency band", "301-400 Hz", "loss factor 0.05 or 0.6"]
STATIC_REGIONS = ["unseen node", "four or five forces"]


def make(kind: str = "harmonic", methods: dict | None = None, cases: int = 200, seed: int = 0) -> xr.Dataset:
    """A results dataset; ``methods`` replaces the invented table."""
    harmonic = kind == "harmonic"
    table = methods or (HARMONIC if harmonic else STATIC)
    rng = np.random.default_rng(seed)
    rows = [(method, *row) for method, settings in table.items() for row in settings]
    names, settings = [r[0] for r in rows], [r[1] for r in rows]
    labels = [f"{m} {s}".strip() for m, s in zip(names, settings, strict=True)]
    numbers = np.array([r[2:] for r in rows])
    seconds, errors, unseen, offline = numbers[:, 0], numbers[:, 1:3], numbers[:, 3], numbers[:, 4]
    headline = np.array([i == max(k for k, n in enumerate(names) if n == m) for i, m in enumerate(names)])
    regions = HARMONIC_REGIONS if harmonic else STATIC_REGIONS
    gate = 0.05 if harmonic else 0.01

    region_code, frequency, loss_factor, load_node = _cases(harmonic, cases, rng)
    held = np.stack([region_code < 3 if harmonic else region_code < 2, region_code > 0])
    case_error = np.full((len(rows), 2, cases), np.nan)
    peak = 1 + (4 * np.exp(-((frequency - 160) / 30) ** 2) if harmonic else load_node.sum(axis=1) % 3)
    for i in range(len(rows)):
        for s in range(2):
            raw = peak[held[s]] * rng.lognormal(-1, 0.8, held[s].sum())
            case_error[i, s, held[s]] = errors[i, s] * raw / raw.max()
    with np.errstate(all="ignore"):
        by_split = {"max": np.nanmax(case_error, axis=2), "p95": np.nanpercentile(case_error, 95, axis=2),
                    "median": np.nanmedian(case_error, axis=2)}
    known = np.where(np.isnan(case_error), -1, case_error)
    by_region = np.stack([unseen] + [errors[:, 1] * f for f in (0.6, 1.0, 0.8)[:len(regions) - 1]], axis=1)
    direct = seconds[names.index("direct")]
    batch, pad = np.where(headline, 0.3, 0.4) * seconds, 0.12 * seconds
    batch[names.index("direct")] = 0.3 * direct
    pad[names.index("direct")] = 0.98 * direct
    solver = np.isin(names, ["direct", "direct-reused", "coarse-fem"])
    pod = np.char.startswith(names, "pod")
    bounded = np.isin(names, ["modal-static", "modal-krylov"])
    with np.errstate(divide="ignore"):
        even = np.where(seconds < direct, offline / np.maximum(direct - seconds, 1e-12), np.inf)
    even[names.index("direct")] = np.nan

    def entry(values, units="1"):
        return "entry", np.asarray(values, dtype=float), {"units": units}

    data = xr.Dataset({
        **{f"error_{n}": (("entry", "split"), v, {"units": "1"}) for n, v in by_split.items()},
        "error_by_region": (("entry", "region"), by_region), "case_error": (("entry", "split", "case"), case_error),
        "worst_case": (("entry", "split"), known.argmax(axis=2)),
        "projection_error_max": (("entry", "split"), np.where(pod[:, None], 0.8 * errors, np.nan)),
        "online_seconds": (("entry", "repeat"), seconds[:, None] * rng.lognormal(0, 0.05, (len(rows), 15)),
                           {"units": "s"}),
        "batch_seconds": entry(batch, "s"), "output_seconds": entry(pad, "s"),
        "call_seconds": entry(0 * seconds + 3e-4, "s"),
        "batch_size": ("entry", np.where(solver, 8, 512)),
        "offline_seconds": entry(offline, "s"), "snapshot_seconds": entry(0.6 * offline, "s"),
        "fit_seconds": entry(0.4 * offline, "s"), "model_bytes": entry(np.where(solver, 0, 4e7 * seconds / 1e-4), "B"),
        "floor_seconds": entry(np.where(solver, np.nan, 0.4 * seconds), "s"),
        "batch_floor_seconds": entry(np.where(solver, np.nan, 0.6 * batch), "s"),
        "speedup": entry(direct / seconds), "batch_speedup": entry(batch[0] / batch),
        "output_speedup": entry(pad[0] / pad),
        "break_even_cases": entry(even),
        **{f"effectivity_{n}": entry(np.where(bounded, v + 0.01 * np.arange(len(rows)), np.nan))
           for n, v in (("min", 1.001), ("median", 1.1), ("max", 1.6))},
        "mesh_floor_median": ((), 0.028), "mesh_floor_max": ((), 0.061),
        **_worst(harmonic, errors[headline, 0], load_node[known[headline, 0].argmax(axis=1)], rng)},
        coords={"entry": labels, "method": ("entry", names), "setting": ("entry", settings),
                "headline": ("entry", headline),
                "split": ["published", "hard"], "region": regions, "case": np.arange(cases),
                "load_node": (("case", "force"), load_node), "hard_region": ("case", region_code),
                "worst": np.array(labels)[headline], "component": ["x", "y", "z"]},
        attrs=_attributes(kind, gate, cases))
    if harmonic:
        data = data.assign_coords(frequency=("case", frequency), loss_factor=("case", loss_factor))
        data["natural_frequency"] = ("natural_mode", np.array(
            [118.0, 159.8, 164.5, 214.5, 215.4, 240, 253.4, 268.6, 281, 290, 297, 311, 330, 352]), {"units": "Hz"})
    return data


def _cases(harmonic: bool, cases: int, rng: np.random.Generator):
    frequency, loss_factor = rng.uniform(1, 300, cases).round(), rng.choice([0.1, 0.3, 0.5], cases)
    code = np.zeros(cases, dtype=int)
    if harmonic:
        code[((frequency >= 112) & (frequency <= 126)) | ((frequency >= 206) & (frequency <= 220))] = 2
        code[rng.random(cases) < 0.1] = 1
        code[: cases // 6] = 3
        frequency[: cases // 6] = rng.uniform(301, 400, cases // 6).round()
        code[cases // 6: cases // 4] = 4
        load = rng.integers(0, 60, (cases, 1))
    else:
        number = rng.integers(1, 4, cases)
        code[rng.random(cases) < 0.15] = 1
        code[: cases // 5], number[: cases // 5] = 2, rng.integers(4, 6, cases // 5)
        load = np.where(np.arange(5) < number[:, None], rng.integers(0, 60, (cases, 5)), -1)
    return code, frequency, loss_factor, load


def skin(around: int = 20, along: int = 14) -> tuple[np.ndarray, np.ndarray]:
    """Positions [m] and quadrilaterals of a closed half ellipsoid with the size of a fingertip, the pad first."""
    t, s = np.linspace(0, 1, along) * 0.48 * np.pi, np.linspace(0, 2 * np.pi, around, endpoint=False)
    t, s = np.meshgrid(t, s, indexing="ij")
    s = s + np.pi * 1.5
    points = np.stack([26e-3 * np.sin(t), 9e-3 * np.cos(t) * np.cos(s), 7.5e-3 * np.cos(t) * np.sin(s)], axis=-1)
    i = np.arange(around)
    ring = np.stack([i, (i + 1) % around, around + (i + 1) % around, around + i], axis=1)
    quads = [k * around + ring for k in range(along - 1)]
    return points.reshape(-1, 3), np.concatenate(quads)


def _worst(harmonic: bool, errors: np.ndarray, loads: np.ndarray, rng: np.random.Generator) -> dict:
    points, quads = skin()
    truth = np.zeros((len(errors), len(points), 3), dtype=complex if harmonic else float)
    answer = truth.copy()
    for k, error in enumerate(errors):
        for node in loads[k][loads[k] >= 0]:
            bump = np.exp(-np.linalg.norm(points - points[node], axis=1) / 4e-3)
            turn = np.exp(0.6j) if harmonic else 1.0
            truth[k] += 8e-5 * turn * bump[:, None] * np.array([0.1, 0.2, 1.0])
        noise = rng.standard_normal(truth[k].shape)
        answer[k] = truth[k] + error * np.linalg.norm(truth[k]) / np.linalg.norm(noise) * noise
    return {"worst_truth": (("worst", "skin_node", "component"), truth, {"units": "m"}),
            "worst_answer": (("worst", "skin_node", "component"), answer, {"units": "m"}),
            "worst_load_node": ("worst", loads[:, 0]), "worst_error": ("worst", errors),
            "skin_quads": (("skin_quad", "corner"), quads),
            **{f"skin_{axis}": ("skin_node", points[:, i], {"units": "m"}) for i, axis in enumerate("xyz")}}


def _attributes(kind: str, gate: float, cases: int) -> dict:
    harmonic = kind == "harmonic"
    return {
        "scene": "harmonic-point-force" if harmonic else "static-point-forces",
        "title": "Vibrating normal force on the finger pad" if harmonic else "Static normal forces on the finger pad",
        "question": "How does the whole fingertip move under forces on its pad?", "gate": gate,
        "scene_needs": json.dumps({"stiffness": "K, real symmetric", "pad loads": "unit normals at the pad nodes"}),
        "scene_leaves_out": json.dumps({"time stepping": "the steady state is asked for", "torch": "networks only"}),
        "method_summaries": json.dumps({"direct": "factorises and solves each case", "modal": "sums natural modes"}),
        "not_applicable": json.dumps({"wavelets": "there is no such scene"}),
        "omitted": json.dumps(["pod-galerkin rank=1024: more than the 240 snapshots"]), "quick": 0,
        "machine": "Some processor, 2 cores, Linux", "threads": "2", "backend": "PARDISO mtype 6",
        "software_versions": "python 3.11, numpy 2.0", "commit": "0123456789abcdef", "seed": 0, "n_free": 21513,
        "n_nodes": 7695, "n_train": json.dumps({"published": 800, "hard": 640}),
        "n_test": json.dumps({"published": cases, "hard": cases}), "residual_max": 3.2e-13,
        "created": "2025-01-01T12:00:00Z"}
