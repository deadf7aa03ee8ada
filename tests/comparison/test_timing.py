"""Clocks: interleaved, raw repeats kept. No test here depends on how fast anything is."""

import numpy as np

from rom.comparison.timing import interleaved, memory_bandwidth, product_rate, threads_in_use


def test_methods_take_turns_and_every_repeat_is_kept():
    order = []
    seconds = interleaved({name: (lambda i, n=name: order.append((n, i))) for name in ("a", "b")}, 4, warm_up=2)
    assert {name: found.shape for name, found in seconds.items()} == {"a": (4,), "b": (4,)}
    assert all((found > 0).all() for found in seconds.values())
    rounds = [order[k:k + 12] for k in range(0, len(order), 12)]  # quick calls are made once and then five times
    assert len(rounds) == 6  # two rounds of warm-up, four timed
    for k, turn in zip(range(-2, 4), rounds, strict=True):
        assert [name for name, _ in turn] == 6 * ["a"] + 6 * ["b"]
        assert [i for _, i in turn] == 2 * [(k + j) % 4 for j in range(6)]  # each call another case


def test_slow_calls_are_made_once_a_repeat():
    import time

    calls = []
    seconds = interleaved({"slow": lambda i: calls.append(i) or time.sleep(0.03)}, 3, warm_up=1)
    assert calls == [2, 0, 1, 2]
    assert (seconds["slow"] >= 0.03).all()


def test_a_progress_bar_sees_every_round():
    seen = []
    interleaved({"a": lambda i: None}, 3, 1, progress=lambda items: seen.extend(items) or seen)
    assert seen == [-1, 0, 1, 2]


def test_floors_are_finite_rates():
    for rate in (memory_bandwidth(100_000, 2), product_rate("float64", 1)):
        assert np.isfinite(rate) and rate > 1e6  # any machine does a million a second
    assert "direct solver" in threads_in_use()
