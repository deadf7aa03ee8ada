"""Natural modes against closed forms and dense LAPACK; no mode may be missed unnoticed."""

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp

from rom.errors import SolverError
from rom.fullorder import SecondOrderModel, factorize, modal_assurance_criterion, modes, natural_modes, sturm_count
from rom.fullorder.refinement import _Rows


def check_modes(result, stiffness, mass, tolerance=1e-9):
    """Orthogonality and residual are the definition of modes; the tolerance is the documented one."""
    x, scale = result.shape, np.sqrt(result.eigenvalue)
    assert np.all(np.diff(result.eigenvalue) >= 0)
    assert np.abs(x.T @ (mass @ x) - np.eye(result.count)).max() <= tolerance
    elastic = x.T @ (stiffness @ x) / np.outer(scale, scale)
    assert np.abs(elastic - np.eye(result.count)).max() <= tolerance
    assert np.all(result.residual <= tolerance)


@pytest.mark.parametrize(("n", "count"), [(50, 50), (50, 7), (500, 20)])
def test_modes_of_a_rod_are_sines(rod, backend, n, count):
    body = rod(n)
    result = natural_modes(body.stiffness, body.mass, count=count, backend=backend)
    np.testing.assert_allclose(result.eigenvalue, body.eigenvalue[:count], rtol=1e-9)  # analytic
    np.testing.assert_allclose(result.frequency_hz, body.frequency_hz[:count], rtol=1e-9)
    mac = modal_assurance_criterion(result.shape, body.shape[:, :count], body.mass)
    np.testing.assert_allclose(mac, np.eye(count), atol=1e-9)
    check_modes(result, body.stiffness, body.mass)
    assert result.sturm_count == count
    assert result.sturm_shift > result.eigenvalue[-1]
    if count == n:
        assert result.next_eigenvalue_bound == np.inf
    else:
        assert result.eigenvalue[-1] < result.next_eigenvalue_bound <= body.eigenvalue[count]
        assert result.next_eigenvalue_bound == result.sturm_shift


def test_block_against_dense(block, backend):
    k, m = block()
    reference = sla.eigh(k.toarray(), m.toarray(), eigvals_only=True)
    result = natural_modes(k, m, count=30, backend=backend)
    np.testing.assert_allclose(result.eigenvalue, reference[:30], rtol=1e-9)
    check_modes(result, k, m)
    band = natural_modes(k, m, below_hz=result.frequency_hz[11] * 1.0001, backend=backend)
    assert band.count == 12
    np.testing.assert_allclose(band.eigenvalue, reference[:12], rtol=1e-9)
    for below in (0, 1, 5, 30, 200):
        shift = (reference[below] + reference[below - 1]) / 2 if below else reference[0] / 2
        assert sturm_count(k, m, np.sqrt(shift) / (2 * np.pi), backend=backend) == below


def test_square_bar_has_double_bending_modes(block):
    """Symmetry of the section: bending about y and z at one frequency; dense reference."""
    k, m = block((6, 3, 3), (0.03, 0.01, 0.01))
    reference = sla.eigh(k.toarray(), m.toarray(), eigvals_only=True)
    assert abs(reference[1] / reference[0] - 1) < 1e-9
    result = natural_modes(k, m, count=12)
    np.testing.assert_allclose(result.eigenvalue, reference[:12], rtol=1e-9)
    check_modes(result, k, m)


def test_cut_cluster_is_counted_whole_and_bounded_below_the_next_mode(block):
    k, m = block((6, 3, 3), (0.03, 0.01, 0.01))
    reference = sla.eigh(k.toarray(), m.toarray(), eigvals_only=True)
    result = natural_modes(k, m, count=1)
    assert result.count == 1 and result.sturm_count == 2
    assert result.sturm_shift > reference[1]
    assert reference[1] * (1 - 1e-6) < result.next_eigenvalue_bound < reference[1]


@pytest.mark.parametrize("copies", [2, 3, 5])
@pytest.mark.parametrize("spread", [0.0, 1e-9, 1e-5])
def test_repeated_and_close_modes(rod, copies, spread):
    """Rods side by side, equal or nearly: every eigenvalue comes `copies` times, known in closed form."""
    body = rod(150)
    factors = 1 + spread * np.arange(copies)
    k = sp.block_diag([body.stiffness * factor for factor in factors], format="csr")
    m = sp.block_diag([body.mass] * copies, format="csr")
    exact = np.sort(np.outer(factors, body.eigenvalue).ravel())
    result = natural_modes(k, m, count=4 * copies)
    np.testing.assert_allclose(result.eigenvalue, exact[: 4 * copies], rtol=1e-9)
    check_modes(result, k, m)
    assert result.sturm_count == 4 * copies
    assert result.next_eigenvalue_bound <= exact[4 * copies]


@pytest.mark.parametrize("missing", [0, 3, 9])
def test_missed_mode_is_noticed_and_found(block, monkeypatch, caplog, missing):
    k, m = block()
    lanczos, searches = modes._lanczos, []

    def forgetful(*arguments):
        searches.append(1)
        found = lanczos(*arguments)
        order = np.argsort(np.sum(found * (k @ found), axis=0) / np.sum(found * (m @ found), axis=0))
        return np.delete(found[:, order], missing, axis=1) if len(searches) == 1 else found

    monkeypatch.setattr(modes, "_lanczos", forgetful)
    result = natural_modes(k, m, count=10)
    assert len(searches) == 2 and "Sturm count" in caplog.text
    np.testing.assert_allclose(result.eigenvalue, sla.eigh(k.toarray(), m.toarray(), eigvals_only=True)[:10], rtol=1e-9)


def test_mode_missed_for_good_is_an_error(block, monkeypatch):
    k, m = block()
    lanczos = modes._lanczos
    exact = sla.eigh(k.toarray(), m.toarray())[1][:, :1]
    monkeypatch.setattr(modes, "_lanczos", lambda *a: (x := lanczos(*a)) - exact @ (exact.T @ (m @ x)))
    with pytest.raises((SolverError, np.linalg.LinAlgError)):
        natural_modes(k, m, count=10)


def test_imprecise_search_is_polished(block, monkeypatch, rng):
    k, m = block()
    lanczos = modes._lanczos

    def rough(*arguments):
        found = lanczos(*arguments)
        return found + 1e-10 * rng.standard_normal(found.shape) * np.abs(found).max()

    monkeypatch.setattr(modes, "_lanczos", rough)
    check_modes(natural_modes(k, m, count=10), k, m)


def test_band_without_modes(block):
    k, m = block()
    first = natural_modes(k, m, count=1).eigenvalue[0]
    result = natural_modes(k, m, below_hz=1.0)
    assert result.count == 0 and result.shape.shape == (k.shape[0], 0) and result.sturm_count == 0
    assert 0 < result.next_eigenvalue_bound <= first


def test_band_that_ends_on_a_mode(rod):
    body = rod(300)
    result = natural_modes(body.stiffness, body.mass, below_hz=body.frequency_hz[4] * (1 + 1e-13))
    assert result.count in (4, 5)  # rounding decides
    assert (
        body.eigenvalue[result.count - 1] < result.next_eigenvalue_bound <= body.eigenvalue[result.count] * (1 + 1e-9)
    )


def test_seed_decides_everything(block):
    k, m = block()
    factor = factorize(k)
    first, again, other = (natural_modes(k, m, count=10, factorization=factor, seed=seed) for seed in (0, 0, 1))
    np.testing.assert_allclose(again.shape, first.shape, rtol=0, atol=1e-9 * np.abs(first.shape).max())
    np.testing.assert_allclose(other.shape, first.shape, rtol=0, atol=1e-6 * np.abs(first.shape).max())


def test_model_passes_its_factor_on(block):
    model = SecondOrderModel(*block())
    result = model.natural_modes(count=5)
    static = model.static_factorization
    np.testing.assert_allclose(natural_modes(*block(), count=5, factorization=static).eigenvalue, result.eigenvalue)
    assert result.sturm_shift_hz == pytest.approx(np.sqrt(result.sturm_shift) / (2 * np.pi))


def test_assurance_criterion(rng):
    a = rng.standard_normal((30, 3))
    np.testing.assert_allclose(np.diag(modal_assurance_criterion(a, a * [1, -2, 1e-3j])), 1.0)  # scale and sign
    assert modal_assurance_criterion(np.eye(4)[:, :1], np.eye(4)[:, 1:2]).item() == 0.0  # orthogonal
    angle = 0.3
    b = np.array([[np.cos(angle)], [np.sin(angle)]])
    np.testing.assert_allclose(modal_assurance_criterion(np.eye(2)[:, :1], b), np.cos(angle) ** 2)  # by definition
    with pytest.raises(ValueError, match="same n"):
        modal_assurance_criterion(a, a[1:])
    with pytest.raises(ValueError, match="positive norm"):
        modal_assurance_criterion(a, a * 0)


def test_refusals(block):
    k, m = block()
    for options in ({}, {"count": 3, "below_hz": 10.0}, {"count": 0}, {"count": 2.5}, {"below_hz": -1.0}):
        with pytest.raises(ValueError):
            natural_modes(k, m, **options)
    with pytest.raises(ValueError, match="positive definite"):
        natural_modes(k - 1e6 * m, m, count=3)
    with pytest.raises(ValueError, match="factorization"):
        natural_modes(k, m, count=3, factorization=factorize(k * (1 + 0.1j)))
    with pytest.raises(SolverError, match="rigid"):
        natural_modes(*block(held=False), count=3)


def test_eigenvalues_hold_to_the_last_digits(small_tip):
    """Rayleigh quotients of the shapes in doubled precision: what remains is the square of the shapes' error."""
    model = SecondOrderModel(small_tip.stiffness, small_tip.mass)
    modes = model.natural_modes(8)
    elastic, inertia = (sum(part.astype(np.longdouble) for part in _Rows(matrix).product(modes.shape))
                        for matrix in (model.stiffness, model.mass))
    quotient = np.sum(modes.shape * elastic, axis=0) / np.sum(modes.shape * inertia, axis=0)
    np.testing.assert_allclose(modes.eigenvalue, quotient.astype(float), rtol=1e-14)
