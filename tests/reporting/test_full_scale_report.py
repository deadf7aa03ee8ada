"""What the report says of networks at full scale follows from the numbers: gates, wins, price, figures."""

from __future__ import annotations

import re

import numpy as np
import pytest
import synthetic_results
import xarray as xr

from rom.reporting import full_scale, words
from rom.reporting.network_verdict import network_tables, network_verdict
from rom.reporting.report import page
from rom.reporting.results import Results

TRAINED = {"mlp": 0.02, "mlp-residual": 0.004}
REGIONS = ["within training", "unseen node", "301-400 Hz"]
N_PAD = 30


def with_full_scale(errors=TRAINED) -> Results:
    """Invented results whose networks were trained on everything."""
    table = dict(synthetic_results.HARMONIC)
    for method, error in errors.items():
        table[method] = [("trained=large precision=float64", 2e-3, error, 9 * error, 9 * error, 240.0),
                         ("trained=large", 1e-3, error, 9 * error, 9 * error, 240.0)]
    data = synthetic_results.make(methods=table)
    n, methods = data.sizes["entry"], data["method"].values.astype(str)
    headline = data["headline"].values
    judged = headline & ~np.isin(methods, ["direct", "direct-reused", "coarse-fem"])
    network = np.char.startswith(data["setting"].values.astype(str), "trained=")
    peak = np.where(judged[:, None], data["error_max"].values, np.nan)
    rng = np.random.default_rng(0)

    def spread(size):
        return ("entry", "split"), peak[:, :, None] * rng.uniform(0.2, 1.0, (n, 2, size))

    frequency, loss = np.arange(1.0, 401.0), np.array([0.05, 0.1, 0.5, 0.6])
    found = xr.Dataset({
        "full_scale_count": (("entry", "split"), np.where(judged[:, None], np.where(network, 129060, 8192)[:, None],
                                                          [[0, 0]])),
        **{f"full_scale_{k}": (("entry", "split"), f * peak) for k, f in (("max", 1.0), ("p95", 0.5), ("median", 0.1))},
        **{f"by_{name}": ((*spread(1)[0], name), spread(len(values))[1]) for name, values in (
            ("full_scale_frequency", frequency), ("full_scale_loss_factor", loss), ("pad_node", np.arange(N_PAD)),
            ("full_scale_region", REGIONS))},
        "learned_cases": ("entry", np.where(network, 516240.0, np.nan)),
        "peak_frequency_error": ("entry", np.where(judged, 0.3, np.nan)),
        "peak_height_error": ("entry", np.where(judged, 0.01, np.nan)), "peak_count": ((), 60),
        "fewer_error_max": (("learner", "snapshots"), np.array([[0.9, 0.4], [0.3, 0.2]])[:len(errors)]),
        "fewer_error_median": (("learner", "snapshots"), np.array([[0.3, 0.1], [0.1, 0.04]])[:len(errors)])},
        coords={"full_scale_frequency": frequency, "full_scale_loss_factor": loss, "pad_node": np.arange(N_PAD),
                "full_scale_region": REGIONS, "learner": list(errors), "snapshots": [143, 1147],
                "pad_x": ("pad_node", np.linspace(0, 0.02, N_PAD)), "pad_y": ("pad_node", np.zeros(N_PAD))})
    return Results(data.merge(found))


def said(found: Results, word: str) -> str:
    return next(sentence for sentence in network_verdict(found) if word in sentence)


def row(table: str, method: str, setting: str) -> str:
    """One row of a table, as plain words."""
    rows = [re.sub(r"<[^>]+>", " ", one).replace("\u00a0", " ") for one in table.split("<tr")]
    return next(one for one in rows if re.search(rf"\s{method}\s+{setting}\s", one))


def test_every_held_out_case_is_counted():
    first, _ = network_tables(with_full_scale())
    told = row(first, "mlp-residual", "trained=large")
    assert "516,000" in told and "129,060" in told and "0.4 %" in told


def test_wins_and_losses_follow_from_error_and_time():
    text = said(with_full_scale(), "Where mlp-residual wins")
    nearer, rest = text.split("nearer but slower than")
    assert "coarse-fem" in nearer  # slower and worse in the invented table
    assert "pod-regression" in rest.split("farther")[0]
    assert "farther off and slower than modal-krylov" in text
    worse = said(with_full_scale({"mlp-residual": 0.9}), "Where mlp-residual wins")
    assert "pod-regression" in worse.split("farther off and slower than")[1]


def test_price_extrapolation_and_peaks_are_told():
    found = with_full_scale()
    direct = 516240 * found.seconds("batch")[found.baseline("batch")]
    assert f"many at once, would take {words.seconds(direct)}" in said(found, "516,240 answers that mlp learned from")
    _, second = network_tables(found)
    assert "unseen node" in second and "60 frequency responses" in second
    told = row(second, "mlp", "")
    assert words.error(full_scale.by(found, "full_scale_region", found.headline("mlp"), "hard")[2]) in told
    assert re.search(r"0\.3\s+1 %", told)  # Hz and height of synthetic peaks


def test_results_without_networks_at_full_scale_say_nothing():
    plain = Results(synthetic_results.make())
    assert list(network_verdict(plain)) == list(network_tables(plain)) == []
    assert full_scale.error_over_population(plain) is None and full_scale.pad_map(plain) is None
    assert full_scale.fewer_snapshots(plain) is None
    assert "whole published population" not in page(plain, {})


@pytest.mark.parametrize("draw", [full_scale.error_over_population, full_scale.pad_map, full_scale.fewer_snapshots])
@pytest.mark.parametrize("errors", [TRAINED, {"mlp": 0.1}], ids=["two", "one"])
def test_figures_are_drawn(draw, errors, tmp_path):
    figure = draw(with_full_scale(errors))
    figure.write(tmp_path)
    assert (tmp_path / figure.file).stat().st_size > 10_000


def test_the_page_has_the_table():
    text = page(with_full_scale(), {})
    assert "whole published population" in text and "129,060" in text
