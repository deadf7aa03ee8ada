"""The whole system: tangent against finite differences, Newton's iteration, its refusals."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from rom.finger_on_glass.equilibrium import FORCE_TOLERANCE, ConvergedStep, FailedStep, solve_step
from rom.finger_on_glass.finger import Finger, OutOfPlane, tributary
from rom.finger_on_glass.section import Section
from rom.finger_on_glass.tissue import Tissue


def pressed(finger, depth=0.3):
    state = finger.at_rest()
    for y in (0.02, depth):
        step = solve_step(finger, state, plate_y=finger.lowest + y)
        assert isinstance(step, ConvergedStep)
        state = step.state
    return step


@pytest.mark.parametrize("stiffness", [100.0, np.inf])
@pytest.mark.parametrize("shift", [0.001, 0.6])
def test_tangent_of_the_whole_system(stiffness, shift, coarse):
    """Central differences along random directions, pressures eliminated; pressed on further so that nodes newly touch.

    A small shift of the plate leaves nodes sticking, a large one makes them slip; viscous resistance acts in both.
    """
    finger = coarse("random", out_of_plane=OutOfPlane(stiffness))
    before = pressed(finger).state
    rng = np.random.default_rng(8)
    drag = (1e-4, before.displacement)
    wobble = 1e-3 * rng.standard_normal(before.displacement.shape)
    wobble[finger.mesh.bone_nodes] = 0
    moved = replace(before, displacement=before.displacement + wobble, plate_x=shift, plate_y=before.plate_y + 0.15)

    def residual(step):
        trial = finger.moved(moved, step, 1.0, np.zeros(len(before.pressure)))
        found = finger.residual(trial, before.contact, 0.05, drag=drag)
        # eliminated pressures follow the volume
        held = replace(trial, pressure=finger.tissue.bulk * found.dilatation)
        return finger.residual(held, before.contact, 0.05, drag=drag)

    at = residual(np.zeros(finger.n_unknowns))
    assert (at.contact.closed & ~before.contact.closed).any()
    assert at.contact.slipping.any() == (shift > 0.1) or not at.contact.slipping.all()
    values = finger.tangent(at, plate_held=False, drag=drag[0])
    indptr, indices = finger.solver.indptr, finger.solver.indices
    matrix = sp.csr_matrix((values, indices, indptr))
    for _ in range(4):
        direction = np.zeros(finger.n_unknowns)
        direction[finger.free_rows] = rng.standard_normal(len(finger.free_rows))
        h = 1e-7
        exact = matrix @ direction[finger.free_rows]
        found = (residual(h * direction).force - residual(-h * direction).force)[finger.free_rows] / (2 * h)
        assert np.abs(found - exact).max() < 1e-6 * np.abs(exact).max()


def test_converged_means_converged(coarse):
    finger = coarse()
    step = pressed(finger)
    assert step.force_residual <= FORCE_TOLERANCE
    assert step.residual.volume_error <= 1e-9
    assert np.abs(step.state.displacement[finger.mesh.bone_nodes]).max() == 0


@pytest.mark.parametrize("variant", ["radial", "random"])
def test_iterations_do_not_depend_on_the_bulk_modulus(variant, coarse):
    """The pressure enters and is updated linearly: the same steps from K = 1e2 to 1e5 times the shear modulus."""
    counts = []
    for ratio in (1e2, 1e3, 1e4, 1e5):
        finger = coarse(tissue=Tissue(variant, bulk_ratio=ratio))
        state, count = finger.at_rest(), 0
        for y in (0.02, 0.2, 0.4):
            step = solve_step(finger, state, plate_y=finger.lowest + y)
            assert isinstance(step, ConvergedStep)
            state, count = step.state, count + step.iterations
        counts.append(count)
    assert max(counts) - min(counts) <= 2


def test_force_and_height_prescribe_the_same_equilibrium(coarse):
    finger = coarse()
    by_height = pressed(finger, 0.25)
    force = float(finger.skin_length @ by_height.residual.contact.pressure)
    state = solve_step(finger, finger.at_rest(), plate_y=finger.lowest + 0.02).state
    by_force = solve_step(finger, state, normal_force=force)
    assert isinstance(by_force, ConvergedStep)
    assert by_force.state.plate_y == pytest.approx(by_height.state.plate_y, abs=1e-7)


def test_symmetric_input_gives_symmetric_results(coarse):
    """Mirror images agree as far as the mesh does (its rays are symmetric to 1e-9 or so)."""
    finger = coarse()
    step = pressed(finger, 0.5)
    n = finger.mesh.rays
    mirror = (-np.arange(n)) % n
    skin = step.state.displacement[finger.mesh.skin_nodes]
    assert np.abs(skin[mirror, 0] + skin[:, 0]).max() < 1e-6
    assert np.abs(skin[mirror, 1] - skin[:, 1]).max() < 1e-6
    pressure = step.residual.contact.pressure
    assert np.abs(pressure[mirror] - pressure).max() < 1e-5 * pressure.max()


def test_plane_strain_keeps_the_stretch(coarse):
    finger = coarse(out_of_plane=OutOfPlane(np.inf))
    step = pressed(finger)
    assert step.state.stretch_z == 1.0
    free = pressed(coarse(out_of_plane=OutOfPlane(0.0)))
    assert free.state.stretch_z > 1.0  # squeezed tissue gives way along the finger


def test_failure_says_why(coarse):
    finger = coarse()
    step = solve_step(finger, finger.at_rest(), plate_y=finger.lowest + 6.0)
    assert isinstance(step, FailedStep)
    assert step.state is None
    assert step.reason


def test_other_objects_are_refused():
    with pytest.raises(ValueError, match="class Section"):
        Finger(section="18 x 15")
    with pytest.raises(ValueError, match="class Tissue"):
        Finger(tissue=Section())
    for bad in (-1.0, True, "10"):
        with pytest.raises(ValueError, match="out-of-plane stiffness"):
            OutOfPlane(stiffness=bad)
    with pytest.raises(ValueError, match="length"):
        OutOfPlane(effective_length=0.0)


def test_tributary_lengths_add_up_to_the_line():
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
    assert tributary(square).tolist() == [1.5, 1.5, 1.5, 1.5]
