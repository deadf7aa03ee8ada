"""Results of load paths as a comparison would write them, with invented but realistic numbers."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr
from synthetic_results import make

QUANTITIES = ["tangential force", "contact area", "pressure", "approach"]
METHODS = {
    "direct": [("", 2.5, 0.0, 0.0, 0.0, 0.0)], "coarse-fem": [("scale=0.5", 0.6, 0.08, 0.09, 0.09, 0.0)],
    "interpolation": [("", 4e-4, 0.12, 0.6, 0.6, 700.0)],
    "pod-galerkin": [("rank=10", 0.01, 0.04, 0.06, 0.06, 730.0), ("rank=40", 0.03, 0.008, 0.02, 0.02, 750.0)],
    "pod-regression": [("rank=20", 2e-3, 0.06, 0.3, 0.3, 720.0)],
}


def make_contact(cases: int = 30, seed: int = 0) -> xr.Dataset:
    """A results dataset of the contact scene."""
    rng = np.random.default_rng(seed)
    base = make("static", METHODS, cases, seed)
    linear = ("worst_truth", "worst_answer", "worst_load", "skin", "mesh_floor")
    keep = [name for name in base.data_vars if not name.startswith(linear)]
    data = base[keep].drop_vars(["load_node", "component"], errors="ignore")
    share = np.r_[np.linspace(0.25, 1, 4), np.ones(8)]
    travel = np.r_[np.zeros(4), np.linspace(0.5e-3, 4e-3, 8)]
    n_entry, n_position = data.sizes["entry"], len(share)
    shape = rng.lognormal(-1, 0.5, (n_entry, 2, cases, n_position))
    state = data["case_error"].values[..., None] * shape / shape.max(axis=-1, keepdims=True)
    contact = data["case_error"].values[..., None] * np.array([0.6, 1.5, 3.0, 0.4])
    angle, depth = np.meshgrid(np.linspace(0, 2 * np.pi, 16, endpoint=False), [4e-3, 6e-3, 8e-3], indexing="ij")
    nodes = np.column_stack([(depth * np.cos(angle)).ravel(), (depth * np.sin(angle)).ravel()])
    i, j = np.meshgrid(np.arange(16), np.arange(2), indexing="ij")
    here, after = 3 * i + j, 3 * ((i + 1) % 16) + j
    quads = np.stack([here, here + 1, after + 1, after], axis=-1).reshape(-1, 4)
    worst = list(data["worst"].values)
    truth = np.repeat((1e-3 * np.exp(-((nodes[:, 1] + 8e-3) / 4e-3) ** 2))[None, :, None], 2, axis=2)
    truth = np.repeat(truth, len(worst), axis=0)
    error = data["worst_error"].values[:, None]
    force = np.repeat(0.5 * np.minimum(travel / 2.5e-3, 1)[None], len(worst), axis=0)
    area = np.repeat(4e-5 * (1 - 0.4 * np.minimum(travel / 2.5e-3, 1))[None], len(worst), axis=0)
    data = data.assign({
        "position_error": (("entry", "split", "case", "position"), state),
        "contact_case_error": (("entry", "split", "case", "quantity"), contact),
        "contact_error_max": (("entry", "split", "quantity"), np.nanmax(contact, axis=2)),
        "contact_error_median": (("entry", "split", "quantity"), np.nanmedian(contact, axis=2)),
        "worst_section_truth": (("worst", "section_node", "component"), truth),
        "worst_section_answer": (("worst", "section_node", "component"), truth * (1 + error[..., None])),
        "worst_force_truth": (("worst", "position"), force),
        "worst_force_answer": (("worst", "position"), force * (1 - error)),
        "worst_area_truth": (("worst", "position"), area),
        "worst_area_answer": (("worst", "position"), area * (1 + error)),
        "worst_position": ("worst", np.full(len(worst), 8)), "section_quads": (("section_quad", "corner"), quads),
        "section_x": ("section_node", nodes[:, 0]), "section_y": ("section_node", nodes[:, 1])})
    data = data.assign_coords({
        "quantity": QUANTITIES, "component": ["x", "y"], "force_share": ("position", share),
        "travel": ("position", travel),
        "variant": ("case", np.array(["radial", "circumferential", "random"])[np.arange(cases) % 3]),
        "c": ("case", rng.uniform(2e3, 4.5e3, cases)), "friction": ("case", rng.uniform(0.5, 1.2, cases)),
        "normal_force": ("case", rng.uniform(0.2, 0.8, cases))})
    data.attrs = {**base.attrs, "scene": "finger-on-glass", "title": "A finger pressed on glass", "gate": 0.05,
                  "partial_output": "contact quantities", "error_definition": "A case is a whole load path.",
                  "quantity_definitions": json.dumps({"approach": "difference of the plate's displacement"})}
    return data
