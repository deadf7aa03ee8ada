"""Derivatives of receptances against re-solved models, direct and reduced."""

from dataclasses import replace

import numpy as np
import pytest
from analysis.receptance_sensitivity import receptance_sensitivity, reduced_receptance_sensitivity
from analysis.tissue_damped_rom import TissueDampedModel
from analysis.tissue_damping import ASSUMED_LOSS_FACTORS, damped_model

from rom.fullorder import SecondOrderModel
from rom.vibration.matrix_derivatives import projected_derivatives
from rom.vibration.parameters import parameters, with_parameter

STEP = 2e-5
NAMES = ("fingertip_height", "bone_length", "stratum_corneum_thickness", "shape.lower_exponent",
         "hypodermis.elastic_modulus", "dermis.poisson_ratio", "dermis.density")
FREQUENCY = np.repeat([50.0, 130.0, 240.0], 3)


def unit_forces(tip):
    """Along x, y and z on the pad node nearest to the tip, which no fixed rear holds."""
    pad = tip.mesh.pad_nodes
    node = pad[np.argmax(tip.mesh.nodes[pad, 0])]
    return np.stack([tip.point_force(node, direction) for direction in np.eye(3)], axis=1)


def solved(tip, force, loss_factor):
    """One column a case: three loads at each of three frequencies."""
    model = damped_model(tip, loss_factor)
    return np.concatenate([model.solve_harmonic(force, f, 0.0) for f in np.unique(FREQUENCY)], axis=1)


@pytest.fixture(scope="module", params=[("b-bar", "free", 0.1), ("full", "fixed", ASSUMED_LOSS_FACTORS)],
                ids=["uniform", "by-tissue"])
def case(request, tiny_tip):
    formulation, rear, loss_factor = request.param
    tip = replace(tiny_tip, formulation=formulation, rear=rear)
    force = unit_forces(tip)
    u = solved(tip, force, loss_factor)
    return tip, loss_factor, np.tile(force, 3), u


def test_against_resolved_models(case):
    """The loads are those of the unchanged fingertip: same nodes, same directions in space."""
    tip, loss_factor, force, u = case
    found = receptance_sensitivity(tip, force, u, FREQUENCY, loss_factor, names=NAMES)
    np.testing.assert_allclose(found["receptance"], np.sum(force * u, axis=0), rtol=1e-12)
    for one in parameters(tip, NAMES):
        step = STEP * one.scale
        ends = [np.sum(force * solved(with_parameter(tip, one.name, one.value + s), force[:, :3], loss_factor), axis=0)
                for s in (-step, step)]
        slope, mean = (ends[1] - ends[0]) / (2 * step), (ends[1] + ends[0]) / 2
        derivative = found["derivative"].sel(parameter=one.name).values
        assert np.max(np.abs(derivative - slope) / np.abs(slope)) < 1e-4
        change = one.scale * (np.abs(ends[1]) - np.abs(ends[0])) / (2 * step) / np.abs(mean)
        np.testing.assert_allclose(found["logarithmic"].sel(parameter=one.name), change, rtol=1e-3, atol=1e-5)


def test_an_output_away_from_the_load_needs_one_adjoint(case):
    tip, loss_factor, force, u = case
    node = tip.free_dofs[len(tip.free_dofs) // 2] // 3  # any other free node, here inside the tissue
    output = np.repeat(tip.point_force(node, [0.3, -0.5, 0.8])[:, None], 3, axis=1)
    adjoint = solved(tip, output, loss_factor)
    output = np.tile(output, 3)
    name = "hypodermis.elastic_modulus"
    found = receptance_sensitivity(tip, output, u, FREQUENCY, loss_factor, adjoint=adjoint, names=[name])
    one, = parameters(tip, [name])
    ends = [np.sum(output * solved(with_parameter(tip, name, one.value + s), force[:, :3], loss_factor), axis=0)
            for s in (-STEP * one.value, STEP * one.value)]
    slope = (ends[1] - ends[0]) / (2 * STEP * one.value)
    assert np.max(np.abs(found["derivative"].sel(parameter=name) - slope) / np.abs(slope)) < 1e-4


def test_loss_factors(case):
    """Independent: re-solved with one tissue's loss factor changed."""
    tip, loss_factor, force, u = case
    found = receptance_sensitivity(tip, force, u, FREQUENCY, loss_factor, names=[])
    eta = dict.fromkeys(ASSUMED_LOSS_FACTORS, 0.1) if loss_factor == 0.1 else dict(loss_factor)
    for tissue in ("hypodermis", "stratum_corneum"):
        ends = [np.abs(np.sum(force * solved(tip, force[:, :3], eta | {tissue: eta[tissue] * (1 + s)}), axis=0))
                for s in (-1e-4, 1e-4)]
        slope = (ends[1] - ends[0]) / 1e-4 / (ends[1] + ends[0])
        np.testing.assert_allclose(found["loss_factor_logarithmic"].sel(tissue=tissue), slope, rtol=1e-4, atol=1e-7)


def test_the_reduced_model_converges_to_the_full_one(case):
    tip, loss_factor, force, u = case
    names = ["fingertip_width", "dermis.elastic_modulus"]
    full = receptance_sensitivity(tip, force, u, FREQUENCY, loss_factor, names=names)["derivative"].values
    model = SecondOrderModel(tip.stiffness, tip.mass)
    error = []
    for count, vectors in ((5, 1), (15, 2), (30, 4)):
        reduced = TissueDampedModel(tip, model.natural_modes(count=count), force[:, :3], vectors,
                                    [] if loss_factor == 0.1 else [loss_factor], model)
        y = np.concatenate(list(reduced.galerkin(np.unique(FREQUENCY), loss_factor)), axis=1)
        derivatives = projected_derivatives(tip, reduced.basis, names)
        found = reduced_receptance_sensitivity(derivatives, np.tile(reduced.force, 3), y, FREQUENCY, loss_factor)
        error.append(np.max(np.abs(found["derivative"].values - full) / np.abs(full)))
    assert error[0] > 5 * error[1] > 25 * error[2]
    assert error[2] < 1e-2


def test_refusals(tiny_tip):
    force = unit_forces(tiny_tip)
    with pytest.raises(ValueError, match="one column a case"):
        receptance_sensitivity(tiny_tip, force, force[:, :2], 50.0, 0.1)
    with pytest.raises(ValueError, match="at least 0"):
        receptance_sensitivity(tiny_tip, force, force, 50.0, -0.1, names=[])
    derivatives = projected_derivatives(tiny_tip, force, [])
    with pytest.raises(ValueError, match="one row a vector of the basis"):
        reduced_receptance_sensitivity(derivatives, force, force, 50.0, 0.1)
