"""Clocks: interleaved, every call kept, one protocol. No test here depends on how fast anything is."""

import numpy as np

from rom.comparison import timing
from rom.comparison.timing import interleaved, memory_bandwidth, product_rate, threads_in_use


def recorder(order, name):
    return [lambda i, part=part: order.append((name, part, i)) for part in ("first", "again")]


def test_methods_take_turns_and_every_call_is_kept():
    order = []
    seconds = interleaved({name: recorder(order, name) for name in ("a", "b")}, 4)
    assert {name: found.shape for name, found in seconds.items()} == {"a": (2, 4), "b": (2, 4)}
    assert all((found > 0).all() for found in seconds.values())
    assert len(order) == 16  # nothing is called that is not kept
    for k in range(4):
        turn = order[4 * k:4 * k + 4]
        assert [(name, part) for name, part, _ in turn] == [
            ("a", "first"), ("a", "again"), ("b", "first"), ("b", "again")]
        assert [i for *_, i in turn] == 2 * [2 * k, 2 * k + 1]  # each call another case, the same for every method


def test_what_has_spent_its_budget_gets_no_further_round(monkeypatch):
    monkeypatch.setattr(timing, "clocked", lambda call, i: call(i))
    seconds = interleaved({"slow": [lambda _: 5.0], "fast": [lambda _: 0.1]}, 6, budget=8.0, least=3)
    # 5 s, 10 s: the third round is due, a fourth is not
    np.testing.assert_array_equal(seconds["slow"][0], [5, 5, 5, np.nan, np.nan, np.nan])
    np.testing.assert_array_equal(seconds["fast"][0], 6 * [0.1])


def test_a_progress_bar_sees_every_round():
    seen = []
    interleaved({"a": [lambda i: None]}, 3, progress=lambda items: seen.extend(items) or seen)
    assert seen == [0, 1, 2]


def test_floors_are_finite_rates():
    for rate in (memory_bandwidth(100_000, 2), product_rate("float64", 1)):
        assert np.isfinite(rate) and rate > 1e6  # any machine does a million a second
    assert "direct solver" in threads_in_use()
