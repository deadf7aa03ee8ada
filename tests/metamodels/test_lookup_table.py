"""Interpolation between stored responses: exact on the grid, of the order it claims between, honest outside."""

import numpy as np
import pytest

from rom.metamodels import create
from rom.metamodels.lookup_table import lagrange
from rom.relative import relative_errors
from rom.scenes import CaseArrays, get_scene

ROM = {"modes": 30, "vectors": 4}


@pytest.fixture(scope="module")
def rom(tiny_harmonic):
    return create("modal-krylov", tiny_harmonic, **ROM).fit()


def cases(frequency, loss_factor, n_pad=15):
    frequency, loss_factor = np.broadcast_arrays(np.asarray(frequency, float), np.asarray(loss_factor, float))
    node = np.arange(len(frequency))[:, None] % n_pad
    return CaseArrays(node, np.full(node.shape, 0.3), frequency.copy(), loss_factor.copy())


def errors(scene, rom, asked, **settings):
    table = create("lookup-table", scene, **ROM, **settings).fit()
    return relative_errors(table.evaluate(asked, "field"), rom.evaluate(asked, "field"))


BETWEEN = cases(np.random.default_rng(2).uniform(40, 290, 60), np.random.default_rng(3).uniform(0.1, 0.5, 60))


@pytest.mark.parametrize("variable", ["point", "s"])
@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_entries_of_the_table_are_exact(tiny_harmonic, rom, interpolation, variable):
    on_grid = cases(np.linspace(1, 300, 14)[[0, 3, 7, 13]], np.linspace(0.1, 0.5, 6)[[0, 5, 2, 3]])
    found = errors(tiny_harmonic, rom, on_grid, frequencies=14, loss_factors=6, interpolation=interpolation,
                   variable=variable)
    assert found.max() < 1e-12


@pytest.mark.parametrize(("interpolation", "variable", "order"), [
    ("linear", "point", 2), ("cubic", "point", 4), ("linear", "s", 4)])
def test_errors_fall_at_the_order_of_the_polynomial(tiny_harmonic, rom, interpolation, variable, order):
    coarse, fine = (errors(tiny_harmonic, rom, BETWEEN, frequencies=n, loss_factors=m, interpolation=interpolation,
                           variable=variable) for n, m in ((61, 9), (121, 17)))
    # at the median, since the worst cases lie where halving the mesh does not yet resolve a resonance
    assert np.median(coarse) / np.median(fine) > 0.7 * 2 ** order
    assert fine.max() < 0.02


def test_the_complex_variable_is_worth_its_name(tiny_harmonic, rom):
    grid = {"frequencies": 61, "loss_factors": 9}
    for interpolation in ("linear", "cubic"):
        plain, better = (errors(tiny_harmonic, rom, BETWEEN, **grid, interpolation=interpolation, variable=name).max()
                         for name in ("point", "s"))
        assert better < 0.3 * plain


def test_the_memory_of_whole_fields_is_stated(tiny_harmonic):
    table = create("lookup-table", tiny_harmonic, frequencies=31, loss_factors=5, **ROM).fit()
    assert table.table_bytes == 31 * 5 * tiny_harmonic.n_loads * tiny_harmonic.n_free * 16
    assert 0 < table.model_bytes < 0.2 * table.table_bytes


def test_points_outside_the_table_are_named(tiny_harmonic):
    table = create("lookup-table", tiny_harmonic, frequencies=31, loss_factors=5, **ROM).fit()
    reasons = table.reasons(cases([1, 300, 301, 100, 100], [0.1, 0.5, 0.3, 0.05, 0.6]))
    assert list(reasons) == ["", "", "frequency outside the 1 to 300 Hz of the table",
                             *["loss factor outside the 0.1 to 0.5 of the table"] * 2]


@pytest.mark.parametrize(("settings", "text"), [
    ({"interpolation": "quintic"}, "interpolation='quintic'"), ({"variable": "z"}, "in variable='z'"),
    ({"frequencies": 3}, "cubic interpolation needs 4 of each"),
    ({"loss_factors": 1, "interpolation": "linear"}, "linear interpolation needs 2 of each")])
def test_tables_that_cannot_be_are_refused(tiny_tip, settings, text):
    with pytest.raises(ValueError, match=text):
        create("lookup-table", get_scene("harmonic-point-force", tiny_tip), **settings)


def test_lagrange_polynomials_reproduce_polynomials():
    rng = np.random.default_rng(0)
    nodes = rng.normal(size=(5, 4)) + 1j * rng.normal(size=(5, 4))
    x = rng.normal(size=5) + 1j * rng.normal(size=5)
    weights = lagrange(x, nodes)
    for power in range(4):
        np.testing.assert_allclose((weights * nodes ** power).sum(axis=1), x ** power, rtol=1e-10)
