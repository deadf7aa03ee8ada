from urllib.parse import quote

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rom.interactive.state import AMPLITUDE, QUANTITIES, Limits, State, from_json, from_query
from rom.metamodels import method_names

PAD = list(range(10, 40))
LIMITS = Limits(frozenset(PAD), frozenset(range(100)), 20, dict.fromkeys("xyz", (-9.0, 28.0)))

amplitudes = st.floats(*AMPLITUDE) | st.floats(-AMPLITUDE[1], -AMPLITUDE[0])
forces = st.lists(st.sampled_from(PAD), min_size=1, max_size=3, unique=True).flatmap(
    lambda nodes: st.tuples(*[st.tuples(st.just(node), amplitudes) for node in nodes]))
valid_states = st.builds(
    State, forces, st.floats(0, 300).map(abs), st.floats(0, 1).map(abs), st.sampled_from(method_names()),
    st.sampled_from(QUANTITIES),
    st.none() | st.tuples(st.sampled_from("xyz"), st.floats(-9, 28).map(lambda x: x + 0.0)),
    st.none() | st.integers(0, 99))
anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=3), max_leaves=8)


@given(valid_states)
def test_a_state_survives_address_and_message_to_the_last_bit(state):
    assert from_json(state.to_json(), LIMITS) == state
    assert from_query(state.to_query(), LIMITS) == state


def test_what_is_left_out_is_the_default():
    state = from_query("", LIMITS)
    assert state == from_json({}, LIMITS) == State(((20, 0.1),))
    assert (state.method, state.frequency, state.loss_factor, state.cut) == ("modal-krylov", 0.0, 0.1, None)


def test_the_page_keeps_keys_of_its_own_in_the_address():
    assert from_query("view=1,2.5,-3e-2&scale=20&side=palmar&click=probe&selected=1", LIMITS) == State(((20, 0.1),))


@pytest.mark.parametrize(("name", "value"), [
    ("forces", []), ("forces", [[20, 0.1]] * 4), ("forces", [[20, 0.1], [20, 0.2]]), ("forces", [[20]]),
    ("forces", [[20, 0.0]]), ("forces", [[20, float("nan")]]), ("forces", [[20, 1e308]]), ("forces", [[20, 1e-300]]),
    ("forces", [[10**9, 0.1]]), ("forces", [[-1, 0.1]]), ("forces", [[20.5, 0.1]]), ("forces", [[True, 0.1]]),
    ("forces", [["20", 0.1]]), ("forces", "20:0.1"), ("forces", {"20": 0.1}), ("forces", [[10**400, 0.1]]),
    ("frequency", -1), ("frequency", 300.0001), ("frequency", float("inf")), ("frequency", float("nan")),
    ("frequency", 1e308), ("frequency", "120"), ("frequency", None), ("frequency", True), ("frequency", 10**400),
    ("loss_factor", 1.1), ("loss_factor", -0.1), ("loss_factor", [0.1]),
    ("method", "magic"), ("method", 3), ("method", ["direct"]), ("method", "x" * 10_000),
    ("quantity", "temperature"), ("quantity", {}), ("cut", ["w", 3]), ("cut", ["x"]), ("cut", ["x", 1e308]),
    ("cut", ["x", float("nan")]), ("cut", [["x"], 1]), ("cut", "x:3"), ("probe", 10**9), ("probe", 1.5),
    ("view", [1, 2]), ("__class__", "x")])
def test_hostile_values_are_refused_in_one_short_sentence(name, value):
    with pytest.raises(ValueError) as refusal:
        from_json({name: value}, LIMITS)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 300


@pytest.mark.parametrize("query", [
    "forces=", "forces=20", "forces=20:", "forces=20:nan", "forces=20:1e308", "forces=1000000000:0.1",
    "forces=" + "20:0.1," * 500, "forces=20:0x1p3", "forces=20:1_0", "forces=٢٠:0.1", "f=nan", "f=inf", "f=1e308",
    "f=1e-99999", "f=", "f= 3", "f=" + "9" * 5000, "f=120&f=130", "eta=2", "method=../../etc/passwd",
    "quantity=<script>",
    "cut=x", "cut=w:3", "cut=x:nan", "probe=-1", "probe=9" + "9" * 30, "nonsense=1", "view=<script>alert(1)</script>",
    "scale=" + "1" * 300, "%00=1", "f=%ff", "&".join(f"f{i}=1" for i in range(100))])
def test_hostile_addresses_are_refused_in_one_short_sentence(query):
    with pytest.raises(ValueError) as refusal:
        from_query(query, LIMITS)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 300


@given(st.dictionaries(st.sampled_from(["forces", "frequency", "loss_factor", "method", "quantity", "cut", "probe"])
                       | st.text(max_size=8), anything, max_size=4))
def test_any_json_is_a_state_or_refused(record):
    try:
        state = from_json(record, LIMITS)
    except ValueError:
        return
    assert from_query(state.to_query(), LIMITS) == state


@given(st.dictionaries(st.sampled_from(["forces", "f", "eta", "method", "cut", "probe"]), st.text(max_size=20),
                       max_size=4))
def test_any_address_is_a_state_or_refused(words):
    try:
        from_query("&".join(f"{key}={quote(text)}" for key, text in words.items()), LIMITS)
    except ValueError as refusal:
        assert len(str(refusal)) < 300


def test_the_limits_are_the_fingertips_own(engine):
    mesh = engine.tip.mesh
    assert engine.limits.pad_nodes == set(mesh.pad_nodes.tolist())
    assert engine.limits.pad_center in engine.limits.pad_nodes
    assert engine.limits.extent["x"] == pytest.approx((0.0, 28.0))
