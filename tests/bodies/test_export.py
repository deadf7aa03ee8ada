"""Reduced bodies read back by other programs' readers answer as the body itself does."""

import itertools
import math

import fmpy
import numpy as np
import pytest
import scipy.io
import scipy.linalg
import scipy.signal
import scipy.sparse as sp

from rom.bodies import Body, Loads, read_body
from rom.bodies.export import (
    craig_bampton,
    interface_error,
    read_universal,
    state_space,
    write_fmu,
    write_matrices,
    write_universal,
)

TIP = ["36 y", "36 z", "28 x"]


@pytest.fixture(scope="module")
def damped(block):
    """The block with dashpots that are not proportional, and loss in half of it."""
    model = block.model
    dashpot = np.zeros(model.n)
    dashpot[[5, 40]] = 2e3
    stiffness = sp.csr_array(model.stiffness)
    return Body(stiffness, model.mass, viscous=sp.csr_array(sp.diags_array(dashpot)), dof_names=block.dof_names,
                grid=block.grid, loss_stiffness=0.01 * stiffness, name="damped block")


@pytest.fixture(scope="module")
def top(block):
    """[Hz] between the second and the third mode."""
    return float(block.model.natural_modes(count=3).frequency_hz[1:].mean())


@pytest.fixture(scope="module")
def reduced(block, top):
    return craig_bampton(block, ["x=max"], band=top)


def test_the_interface_answers_as_the_whole_body_does(block, reduced, top):
    assert reduced.error < 1e-4
    assert interface_error(block, reduced, np.linspace(0, top, 15)).max() < 1e-4
    assert reduced.body.model.n < block.model.n / 1.2 and reduced.body.dof_names[-1].startswith("mode ")
    few = craig_bampton(block, ["x=max"], modes=0)
    np.testing.assert_allclose(interface_error(block, few, 0.0), 0, atol=1e-9)  # constraint modes are exact in statics
    assert interface_error(block, few, top).max() > 1e-3  # so the gate above can fail


@pytest.mark.parametrize(("name", "digits"), [("small.pch", 1e-11), ("small.inp", 1e-15), ("small.mtx", 1e-15)])
def test_superelements_read_back(tmp_path, block, reduced, top, name, digits):
    files = write_matrices(reduced.body, tmp_path / name)
    back = read_body(files[0])
    small = reduced.body.model
    for one, other in ((back.model.stiffness, small.stiffness), (back.model.mass, small.mass)):
        assert abs(one - other).max() <= digits * abs(other).max()
    interface = block.dof_names[reduced.interface].tolist()
    assert back.dof_names[:len(interface)].tolist() == interface
    error = interface_error(block, type(reduced)(back, reduced.basis, reduced.interface), np.linspace(0, top, 15))
    assert error.max() < 1e-4
    assert back.dof_names.tolist() == reduced.body.dof_names.tolist()


def test_an_independent_reader_reads_the_punch_file(tmp_path, reduced):
    bulk = pytest.importorskip("pyyeti.nastran.bulk")
    write_matrices(reduced.body, tmp_path / "small.pch")
    theirs = bulk.rddmig(str(tmp_path / "small.pch"))
    np.testing.assert_allclose(theirs["maax"].to_numpy(), reduced.body.model.mass.toarray(),
                               atol=1e-11 * abs(reduced.body.model.mass).max())


def test_damping_goes_with_the_superelement(tmp_path, damped):
    small = craig_bampton(damped, TIP, modes=40)
    back = read_body(write_matrices(small.body, tmp_path / "small.pch")[0])
    rows = [back.dof_names.tolist().index(name) for name in TIP]
    given = small.body
    for mine, theirs in ((back.viscous, given.viscous), (back.model.loss_stiffness, given.model.loss_stiffness)):
        expected = theirs[[0, 1, 2]][:, [0, 1, 2]]
        assert abs(mine[rows][:, rows] - expected).max() < 1e-11 * abs(expected).max() > 0
    assert "BAAX" in (tmp_path / "small.pch").read_text()


def test_refusals(tmp_path, block):
    with pytest.raises(ValueError, match="names no degree of freedom"):
        craig_bampton(Body(block.model.stiffness, block.model.mass), "q", modes=1)
    with pytest.raises(ValueError, match="give one of the two"):
        craig_bampton(block, TIP)
    with pytest.raises(ValueError, match="nothing is left to reduce"):
        craig_bampton(block, "x>=min", modes=0)
    with pytest.raises(ValueError, match=r"matrices are written as \.pch"):
        write_matrices(block, tmp_path / "a.txt")
    with pytest.raises(ValueError, match=r"name \.npz or \.mat"):
        state_space(block, TIP, TIP, modes=2).write(tmp_path / "a.txt")
    with pytest.raises(ValueError, match="there is no C compiler nosuchcc"):
        write_fmu(state_space(block, TIP, TIP, modes=2), tmp_path / "a.fmu", compiler="nosuchcc")


def test_state_space_is_exact_at_rest_and_in_its_modes(block, top):
    system = state_space(block, TIP[:2], TIP, modes=6, loss_factor=0.03)
    assert system.inputs == ("36 y", "36 z") and system.a.shape == (12, 12)
    force = np.zeros((block.model.n, 2))
    at = [block.dof_names.tolist().index(name) for name in TIP]
    force[at[:2], [0, 1]] = 1
    static = block.model.solve_static(force)[at]
    np.testing.assert_allclose(system.frequency_response(0.0)[0].real, static, rtol=1e-9, atol=1e-9 * abs(static).max())
    # six modes with half the loss factor as viscous damping, all others static, from a dense eigensolution
    square, shape = scipy.linalg.eigh(block.model.stiffness.toarray(), block.model.mass.toarray())
    for frequency in (0.5 * top, top):
        omega = 2 * math.pi * frequency
        pole = np.where(np.arange(len(square)) < 6, square - omega**2 + 1j * omega * 0.03 * np.sqrt(square), square)
        exact = shape[at] @ ((shape.T @ force) / pole[:, None])
        np.testing.assert_allclose(system.frequency_response(frequency)[0], exact, atol=1e-9 * abs(exact).max())


def test_viscous_damping_is_kept_whole(damped, top):
    """All modes: the state space is the body, dashpots that are not proportional included."""
    plain = Body(damped.model.stiffness, damped.model.mass, viscous=damped.viscous, dof_names=damped.dof_names)
    system = state_space(plain, TIP, TIP, modes=plain.model.n)
    at = [plain.dof_names.tolist().index(name) for name in TIP]
    omega = 2 * math.pi * top
    z = (plain.model.stiffness + 1j * omega * plain.viscous - omega**2 * plain.model.mass).toarray()
    exact = np.linalg.inv(z)[np.ix_(at, at)]
    np.testing.assert_allclose(system.frequency_response(top)[0], exact, rtol=1e-6, atol=1e-7 * abs(exact).max())
    lossy = state_space(damped, TIP, TIP, modes=10)
    np.testing.assert_allclose(np.trace(lossy.a - state_space(plain, TIP, TIP, modes=10).a),
                               -0.01 * np.sqrt(damped.model.natural_modes(count=10).eigenvalue).sum(), rtol=1e-9)


@pytest.mark.parametrize("ending", [".npz", ".mat"])
def test_state_space_files(tmp_path, block, ending):
    column = np.zeros((block.model.n, 1))
    column[3:6] = 1 / 3
    system = state_space(block, Loads.named(column, ["push"]), TIP, modes=3)
    system.write(tmp_path / f"small{ending}")
    read = np.load(tmp_path / "small.npz") if ending == ".npz" else scipy.io.loadmat(tmp_path / "small.mat",
                                                                                      simplify_cells=True)
    for key, matrix in zip("ABCD", matrices(system), strict=True):
        np.testing.assert_array_equal(np.reshape(read[key], matrix.shape), matrix)
    assert np.atleast_1d(read["inputs"]).tolist() == ["push"] and read["outputs"].tolist() == TIP


def test_python_control_gives_the_same_response(block, top):
    pytest.importorskip("control")
    system = state_space(block, TIP, TIP[:1], modes=4, loss_factor=0.02)
    theirs = system.to_control()
    assert theirs.input_labels == TIP
    np.testing.assert_allclose(theirs(2j * math.pi * top), system.frequency_response(top)[0], rtol=1e-9)


def test_universal_files(tmp_path, block):
    system = state_space(block, TIP[:2], [*TIP, "36 x"], modes=4, loss_factor=0.02)
    frequency = np.linspace(10.0, 500.0, 50)
    response = system.frequency_response(frequency)
    write_universal(tmp_path / "frf.uff", frequency, response, list(system.outputs), list(system.inputs))
    back = read_universal(tmp_path / "frf.uff")
    assert back.output.values.tolist() == list(system.outputs) and back.input.values.tolist() == list(system.inputs)
    np.testing.assert_allclose(back.frequency, frequency, rtol=1e-6)  # start and step have six digits in the format
    np.testing.assert_allclose(back.response, response, rtol=1e-11)
    assert back.attrs["kind"] == "receptance" and back.response.attrs["units"] == "m/N"


def test_universal_files_over_uneven_frequencies_of_named_points(tmp_path):
    frequency, values = np.array([1.0, 2.0, 5.0]), (np.arange(6.0).reshape(3, 2, 1) + 1j)
    write_universal(tmp_path / "frf.unv", frequency, values, ["root", "tip"], ["tip"], kind="accelerance")
    back = read_universal(tmp_path / "frf.unv")
    assert back.output.values.tolist() == ["root", "tip"] and back.attrs["kind"] == "accelerance"
    np.testing.assert_allclose(back.response.sel(output="tip", input="tip"), values[:, 1, 0])
    np.testing.assert_allclose(back.frequency, frequency)
    with pytest.raises(ValueError, match="one for each frequency"):
        write_universal(tmp_path / "frf.unv", frequency, values, ["tip"], ["tip"])
    (tmp_path / "junk.unv").write_text("hello\n")
    with pytest.raises(ValueError, match=r"no frequency response|no readable universal file"):
        read_universal(tmp_path / "junk.unv")


@pytest.fixture(scope="module")
def unit(tmp_path_factory, damped):
    system = state_space(damped, TIP[:2], TIP, modes=5, loss_factor=0.02)
    return system, write_fmu(system, tmp_path_factory.mktemp("fmu") / "small.fmu")


def matrices(system):
    return system.a, system.b, system.c, system.d


def test_the_units_description_is_valid(unit):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(unit[1])) == []


def test_the_units_step_response_is_that_of_scipy(unit, top):
    system, path = unit
    time = np.arange(0, 400) / (20 * top)
    force = np.zeros(len(time), dtype=[("time", float), ("force 36 y", float), ("force 36 z", float)])
    force["time"], force["force 36 y"], force["force 36 z"] = time, 2.0, -1.0
    found = fmpy.simulate_fmu(str(path), stop_time=time[-1], output_interval=time[1], input=force,
                              fmi_type="CoSimulation", output=[f"displacement {name}" for name in TIP])
    _, exact, _ = scipy.signal.lsim(matrices(system), np.tile([2.0, -1.0], (len(time), 1)), time)
    values = np.column_stack([found[f"displacement {name}"] for name in TIP])
    assert values.shape == exact.shape
    assert abs(values - exact).max() < 1e-6 * abs(exact).max()


def test_the_unit_integrated_from_outside_does_the_same(unit, top):
    system, path = unit
    time = np.arange(0, 40) / (20 * top)
    found = fmpy.simulate_fmu(str(path), stop_time=time[-1], output_interval=time[1], fmi_type="ModelExchange",
                              start_values={"force 36 y": 1.0}, output=["displacement 36 y"], relative_tolerance=1e-10)
    _, exact, _ = scipy.signal.lsim(matrices(system), np.tile([1.0, 0.0], (len(time), 1)), time)
    np.testing.assert_allclose(np.interp(time, found["time"], found["displacement 36 y"]), exact[:, 0],
                               atol=1e-6 * abs(exact).max())


def test_the_units_frequency_response_is_that_of_the_state_space(unit, top):
    """From the unit's own derivatives: u = C (i omega - A)^-1 B + D with each matrix asked of the unit."""
    system, path = unit
    description = fmpy.read_model_description(str(path))
    folder = fmpy.extract(str(path))
    slave = fmpy.fmi2.FMU2Model(guid=description.guid, unzipDirectory=folder, modelIdentifier="body",
                                instanceName="one")
    slave.instantiate()
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    inputs, outputs, states = len(system.inputs), len(system.outputs), len(system.a)
    ends = np.cumsum([0, inputs, outputs, states, states]).tolist()
    force, displacement, state, slope = (list(range(*pair)) for pair in itertools.pairwise(ends))

    def matrix(unknowns, knowns):
        return np.column_stack([slave.getDirectionalDerivative(unknowns, [known], [1.0]) for known in knowns])

    a, b, c, d = matrix(slope, state), matrix(slope, force), matrix(displacement, state), matrix(displacement, force)
    slave.terminate()
    slave.freeInstance()
    frequency = np.linspace(0, top, 7)
    expected = system.frequency_response(frequency)
    for f, response in zip(frequency, expected, strict=True):
        found = c @ np.linalg.solve(2j * math.pi * f * np.eye(states) - a, b) + d
        np.testing.assert_allclose(found, response, rtol=1e-12)
