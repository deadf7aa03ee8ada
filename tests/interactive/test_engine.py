from dataclasses import replace

import numpy as np
import pytest

from rom.errors import SolverError
from rom.fingertip import strain
from rom.interactive.engine import SUMMED, SWEEP, Engine
from rom.interactive.models import Models
from rom.interactive.state import State
from rom.metamodels import create
from rom.metamodels.validity import ValidityWarning
from rom.relative import relative_errors
from rom.scenes import CaseArrays

FORCES = 0.1, -0.25, 0.4


@pytest.fixture(scope="module")
def three(engine):
    nodes = engine.tip.mesh.pad_nodes[[2, 9, 17]].tolist()
    return tuple(zip(nodes, FORCES, strict=True))


@pytest.fixture(scope="module")
def truth(models):
    """`direct` of both scenes, by whether anything moves."""
    return {harmonic: create("direct", models.scene(harmonic)).fit() for harmonic in (False, True)}


def predicted(model, engine, state):
    cases = model.scene.cases_from(engine.cases(state, model.scene))
    return model.scene.values(model.predict(cases))[0]


@pytest.mark.parametrize("method", ["modal", "modal-static", "modal-krylov"])
@pytest.mark.parametrize("frequency", [0.0, 0.5, 123.4, 300.0])
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.filterwarnings("ignore::rom.metamodels.ValidityWarning")
def test_the_modal_family_answers_as_predict_does(engine, three, method, frequency, count):
    state = State(three[:count], frequency, 0.2, method)
    expected = predicted(engine.models.model(method, True), engine, state)
    found = engine.answer(state)
    assert np.linalg.norm(found.values - expected) <= 1e-12 * np.linalg.norm(expected)
    assert np.iscomplexobj(found.values) == (frequency > 0)


@pytest.mark.parametrize("method", ["superposition", "pod-galerkin", "transformer"])
def test_static_methods_answer_as_predict_does(engine, three, method):
    state = State(three, method=method)
    model = engine.models.model(method, False)
    with np.errstate(all="raise"):
        found = engine.answer(state)
    if model.learns:
        with pytest.warns(ValidityWarning):
            expected = predicted(model, engine, state)
    else:
        expected = predicted(model, engine, state)
    np.testing.assert_allclose(found.values, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
    assert found.note == ""


@pytest.mark.parametrize(("method", "frequency"), [("modal-krylov", 0.0), ("modal-krylov", 210.0),
                                                   ("superposition", 0.0), ("pod-galerkin", 0.0)])
def test_good_methods_agree_with_direct(engine, truth, three, method, frequency):
    state = State(three, frequency, 0.15, method)
    exact = truth[state.harmonic].evaluate(engine.cases(state, engine.scene(state)), "field")
    assert relative_errors(engine.answer(state).values[None], exact)[0] < 1e-8


@pytest.mark.parametrize("method", ["mlp", "pod-galerkin"])
def test_networks_of_one_force_are_summed_over_several(engine, three, method):
    state = State(three, 77.0, 0.3, method)
    found = engine.answer(state)
    assert found.note == SUMMED
    singles = sum(engine.answer(replace(state, forces=(force,))).values for force in three)
    np.testing.assert_allclose(found.values, singles, rtol=1e-5, atol=1e-6 * np.abs(singles).max())
    assert engine.answer(replace(state, forces=three[:1])).note == ""


def test_what_a_method_does_not_stand_behind_is_said(engine, three):
    assert "frequency outside" in engine.answer(State(three[:1], 0.2, 0.3, "mlp")).validity
    assert "loss factor outside" in engine.answer(State(three, 50.0, 0.9, "mlp")).validity
    assert engine.answer(State(three, 50.0, 0.3, "modal-krylov")).validity == ""


def test_methods_that_do_not_apply_are_refused(engine, three):
    with pytest.raises(ValueError, match="superposition cannot answer a moving state: unit-load"):
        engine.answer(State(three, 50.0, method="superposition"))
    with pytest.raises(ValueError, match="mlp-residual cannot answer a moving state: has not been fitted"):
        engine.answer(State(three, 50.0, method="mlp-residual"))


def test_figures_are_the_fields_own(engine, three):
    state = State(three, 140.0, 0.1, probe=3, cut=("y", 1.0))
    answer = engine.answer(state)
    header, arrays = engine.shown(state, answer)
    full = engine.models.harmonic.grid.on_all_nodes(answer.values[None])[0]
    for probe, (node, _) in zip([*header["probes"], header["probe"]], [*three, (3, 0)], strict=True):
        assert probe["node"] == node
        u = np.array([complex(*pair) for pair in probe["u"]])
        np.testing.assert_array_equal(u, full[node])
        assert complex(*probe["normal"]) == pytest.approx(-u @ engine.tip.mesh.normals[node], rel=1e-12)
    size = np.linalg.norm(full, axis=1)
    assert header["largest"] == {"node": int(size.argmax()), "magnitude": pytest.approx(size.max(), rel=1e-12)}
    picture = arrays["u"][..., 0] + 1j * arrays["u"][..., 1]
    np.testing.assert_allclose(picture, full[engine.surface.vertex_node], rtol=1e-6, atol=1e-7 * size.max())
    cut = arrays["cut_u"][..., 0] + 1j * arrays["cut_u"][..., 1]
    np.testing.assert_allclose(cut, engine.section("y", 1.0).field(full), rtol=1e-6, atol=1e-7 * size.max())
    assert len(engine.cut(state)[1]["cut_vertices"]) == len(cut)


def test_pressing_in_is_positive(engine):
    state = State(((engine.limits.pad_center, 0.1),))
    header, _ = engine.shown(state, engine.answer(state))
    assert header["probes"][0]["normal"][0] > 0
    assert header["probes"][0]["normal"][1] == 0.0


@pytest.mark.parametrize("frequency", [0.0, 140.0])
@pytest.mark.parametrize("method", ["modal-krylov", "modal"])
def test_the_residual_is_that_of_the_equation(engine, three, method, frequency):
    state = State(three, frequency, 0.1, method)
    u, tip = engine.answer(state).values, engine.tip
    omega, loss = 2 * np.pi * frequency, 0.1 * (frequency > 0)
    force = tip.pad_loads @ np.bincount(np.searchsorted(tip.mesh.pad_nodes, [node for node, _ in three]), FORCES,
                                        len(tip.mesh.pad_nodes))
    left = (1 + 1j * loss) * (tip.stiffness @ u) - omega**2 * (tip.mass @ u) - force
    expected = np.linalg.norm(left) / np.linalg.norm(force)
    assert engine.residual(state, u) == pytest.approx(expected, rel=1e-6, abs=1e-13)


@pytest.mark.parametrize("count", [1, 3])
def test_the_bound_holds(engine, truth, three, count):
    for frequency in (0.0, 125.0, 290.0):
        for method in ("modal-static", "modal-krylov"):
            state = State(three[:count], frequency, 0.1, method)
            answer = engine.answer(state)
            exact = truth[state.harmonic].evaluate(engine.cases(state, engine.scene(state)), "field")[0]
            stiffness = engine.tip.stiffness
            miss, size = (np.sqrt((u.conj() @ (stiffness @ u)).real) for u in (answer.values - exact, exact))
            assert answer.bound is not None
            assert miss / size <= answer.bound + 1e-9


def test_the_frequency_response_is_the_full_answers(engine, three):
    state = State(three, 140.0, 0.25)
    model = engine.models.model("modal-krylov", True)
    one = engine.cases(state, model.scene)
    pick = [0, 60, 149]
    cases = CaseArrays(*(np.repeat(a, 3, axis=0) for a in (one.node, one.force)), SWEEP[pick], np.full(3, 0.25))
    full = model.scene.grid.on_all_nodes(model.evaluate(cases, "field"))
    for node in (engine.limits.pad_center, three[0][0], 1):
        header, arrays = engine.frequency_response(state, node)
        found = arrays["receptance"][pick, 0] + 1j * arrays["receptance"][pick, 1]
        np.testing.assert_allclose(found, -full[:, node] @ engine.tip.mesh.normals[node], rtol=1e-10)
        assert header["node"] == node
    expected = np.sqrt(model.eigenvalue) / (2 * np.pi)
    np.testing.assert_array_equal(arrays["natural_frequencies"], expected[expected <= 300])


def test_a_frequency_response_needs_a_node_of_the_skin(engine, three):
    rear = int(engine.surface.vertex_node[-1])
    with pytest.raises(ValueError, match="not on the skin"):
        engine.frequency_response(State(three, 100.0), rear)


def test_strain_at_receptor_depth_of_a_uniform_stretch(engine):
    tip = engine.tip
    stretch = np.zeros((tip.mesh.n_nodes, 3))
    stretch[:, 0] = 0.02 * tip.mesh.nodes[:, 0]
    u = stretch.ravel()[tip.free_dofs]
    quads = strain.pad_quads(tip.mesh)
    points = strain.points_at_depth(tip.mesh, 0.5e-3, "deep", quads)
    free_alone = ~np.isin(tip.mesh.hexahedra[points.element], tip.mesh.bone_nodes).any(axis=1)
    found = engine.strain.at_quads(u)
    np.testing.assert_allclose(found[free_alone], 0.02, rtol=1e-10)
    at_nodes = engine.strain.at_pad_nodes(u)
    assert at_nodes.shape == (len(tip.mesh.pad_nodes),)
    np.testing.assert_allclose(at_nodes[np.isfinite(at_nodes)], 0.02, rtol=1e-10)


def test_strain_stands_at_the_pads_vertices_alone(engine, three):
    state = State(three, 80.0, quantity="strain")
    _, arrays = engine.shown(state, engine.answer(state))
    shown = np.isfinite(arrays["strain"])
    assert shown.any()
    assert set(engine.surface.vertex_node[shown]) <= engine.limits.pad_nodes
    assert (arrays["strain"][shown] > 0).all()


def test_every_method_is_listed_with_reasons(models):
    listed = {one["name"]: one for one in models.listed()}
    from rom.metamodels import method_names

    assert list(listed) == method_names()
    for one in listed.values():
        assert one["static"] == (one["reason_static"] == "")
        assert one["harmonic"] == (one["reason_harmonic"] == "")
        assert (one["reason"] == "") == (one["static"] or one["harmonic"])
    assert listed["modal-krylov"]["static"] and listed["modal-krylov"]["harmonic"]
    assert listed["mlp"]["harmonic"] and not listed["mlp"]["static"]
    assert "rom serve --fit" in listed["mlp-residual"]["reason"]


def test_speed_up_is_unknown_until_direct_was_timed(engine, three):
    state = State(three, 80.0)
    engine.direct_seconds.clear()
    assert engine.speedup(state, 0.001) is None
    for seconds in (0.6, 0.5, 0.9):
        engine.time_direct(state, seconds)
    assert engine.speedup(state, 0.001) == pytest.approx(500)
    assert engine.speedup(State(three), 0.001) is None
    engine.direct_seconds.clear()


def test_an_undamped_resonance_is_refused_in_one_sentence(engine, three):
    eigenvalue = engine.models.model("modal", True).eigenvalue
    exact = [(k, np.nextafter(np.sqrt(one) / (2 * np.pi), towards)) for k, one in enumerate(eigenvalue)
             for towards in (0.0, np.inf)] + [(k, np.sqrt(one) / (2 * np.pi)) for k, one in enumerate(eigenvalue)]
    hits = [f for k, f in exact if (2.0 * np.pi * f) ** 2 == eigenvalue[k] and f <= 300]
    assert hits
    with pytest.raises(SolverError, match="undamped resonance: give a loss factor"):
        for frequency in hits:  # a mode that three forces do not stir stays finite
            engine.answer(State(three, float(frequency), 0.0, "modal"))


def test_a_locking_fingertip_is_told(models):
    tip = replace(models.tip, formulation="full", anatomy=models.tip.anatomy.replace(
        dermis=replace(models.tip.anatomy.dermis, poisson_ratio=0.4999)))
    assert "lock" in Engine(Models(tip, quick=True)).validity("")
    assert Engine(models).validity("", "one", "one") == "one"
