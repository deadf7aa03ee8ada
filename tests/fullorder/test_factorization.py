"""Factorizations against dense LAPACK, analytic inertia, and everything that must be refused."""

import copy
import gc
import logging
import pickle

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from rom.errors import SolverError
from rom.fullorder import available_backends, factorization, factorize, get_threads, pardiso, threads

needs_pardiso = pytest.mark.skipif("pardiso" not in available_backends(), reason="no oneMKL runtime here")


def damped(stiffness, mass, frequency=30.0, loss_factor=0.2):
    return stiffness * (1 + 1j * loss_factor) - (2 * np.pi * frequency) ** 2 * mass


def close(value, reference, tolerance=1e-10):
    """Tolerance: rounding (2e-16) times the blocks' condition (1e4 to 1e5), with room."""
    assert np.linalg.norm(value - reference) <= tolerance * np.linalg.norm(reference)


@pytest.mark.parametrize("kind", ["definite", "indefinite", "complex"])
def test_solution_is_that_of_a_dense_solver(block, rng, backend, kind):
    k, m = block()
    matrix = {"definite": k, "indefinite": k - (2 * np.pi * 60) ** 2 * m, "complex": damped(k, m)}[kind]
    b = rng.standard_normal((k.shape[0], 3))
    factor = factorize(matrix, backend=backend)
    assert factor.backend == backend and factor.n == k.shape[0] and factor.dtype == matrix.dtype
    assert factor.memory_bytes > matrix.data.nbytes / 2
    close(factor.solve(b), np.linalg.solve(matrix.toarray(), b))


def test_right_hand_sides_of_every_form(block, rng, backend):
    k, m = block()
    b = rng.standard_normal((k.shape[0], 4)) + 1j * rng.standard_normal((k.shape[0], 4))
    for matrix in (k, damped(k, m)):
        factor = factorize(matrix, backend=backend)
        together = factor.solve(b)
        assert together.dtype == np.complex128 and together.shape == b.shape
        close(together, np.linalg.solve(matrix.toarray(), b))
        close(np.stack([factor.solve(column) for column in b.T], axis=1), together, 1e-13)
        close(factor.solve(np.asfortranarray(b)), together, 1e-13)
        close(factor.solve(b[:, ::2]), together[:, ::2], 1e-13)
        close(factor.solve(b.real.tolist()), together.real if factor.dtype == float else factor.solve(b.real), 1e-13)
        assert factor.solve(b[:, :0]).shape == (k.shape[0], 0)


def test_right_hand_side_is_left_alone(block, backend):
    k, _ = block()
    b = np.asfortranarray(np.ones((k.shape[0], 2)))
    factorize(k, backend=backend).solve(b)
    np.testing.assert_array_equal(b, 1.0)


@needs_pardiso
def test_backends_agree(block, rng):
    k, m = block()
    b = rng.standard_normal(k.shape[0])
    for matrix in (k, damped(k, m)):
        close(factorize(matrix, backend="superlu").solve(b), factorize(matrix, backend="pardiso").solve(b))


def test_refactorized_equals_fresh(block, rng, backend):
    k, m = block()
    b = rng.standard_normal(k.shape[0])
    factor = factorize(damped(k, m), backend=backend)
    for frequency, loss_factor in ((0.0, 0.05), (120.0, 0.3), (30.0, 0.2)):
        matrix = damped(k, m, frequency, loss_factor)
        assert factor.refactorize(matrix) is factor
        close(factor.solve(b), factorize(matrix, backend=backend).solve(b))
    scaled = factorize(k, backend=backend).refactorize(k * 1e-9)  # far from the values that were scaled first
    close(scaled.solve(b), 1e9 * factorize(k, backend=backend).solve(b))


def test_refactorization_refuses_another_pattern_or_dtype(block, backend):
    k, m = block()
    factor = factorize(k, backend=backend)
    with pytest.raises(ValueError, match="another pattern"):
        factor.refactorize(k + sp.coo_array(([1.0, 1.0], ([0, 150], [150, 0])), shape=k.shape))
    with pytest.raises(ValueError, match="complex128"):
        factor.refactorize(damped(k, m))


def test_inertia_of_a_rod_is_its_analytic_mode_count(rod, backend):
    body = rod(40)
    middles = (body.eigenvalue[1:] + body.eigenvalue[:-1]) / 2
    factor = factorize(body.stiffness, backend=backend)
    assert factor.negative_eigenvalues == 0
    for below in (1, 2, 7, 20, 39):
        assert factor.refactorize(body.stiffness - middles[below - 1] * body.mass).negative_eigenvalues == below
    assert factor.refactorize(-body.stiffness).negative_eigenvalues == 40


@needs_pardiso
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 30), density=st.floats(0.1, 0.9))
def test_inertia_and_solution_of_random_indefinite_matrices(seed, n, density):
    """Signs of dense LAPACK's eigenvalues; with zeros on the diagonal PARDISO may refuse, but never be wrong."""
    rng = np.random.default_rng(seed)
    lower = np.where(rng.random((n, n)) < density, rng.uniform(-1, 1, (n, n)), 0.0)
    for diagonal in (rng.uniform(-1, 1, n), np.zeros(n)):
        matrix = sp.csr_array(np.tril(lower, -1) + np.tril(lower, -1).T + np.diag(diagonal))
        eigenvalue = np.linalg.eigvalsh(matrix.toarray())
        if np.min(np.abs(eigenvalue)) <= 1e-5 * np.max(np.abs(eigenvalue)):
            continue
        b = rng.standard_normal(n)
        try:
            factor = factorize(matrix, backend="pardiso")
            assert factor.negative_eigenvalues == np.count_nonzero(eigenvalue < 0)
            assert np.linalg.norm(matrix @ factor.solve(b) - b) <= 1e-7 * np.linalg.norm(b)
        except SolverError:
            assert not np.any(diagonal)


def test_complex_matrix_has_no_inertia(block, backend):
    with pytest.raises(ValueError, match="no inertia"):
        _ = factorize(damped(*block()), backend=backend).negative_eigenvalues


@pytest.mark.parametrize("factor", [1.0, 1 + 0.1j])
def test_free_body_is_singular(block, backend, factor):
    k, _ = block(held=False)
    with pytest.raises(SolverError, match="singular"):
        factorize(k * factor, backend=backend)
    later = factorize((k + 1e-3 * abs(k).max() * sp.eye_array(k.shape[0])) * factor, backend=backend)
    with pytest.raises(SolverError, match="singular"):
        later.refactorize((k + 0 * sp.eye_array(k.shape[0])) * factor)


def test_empty_row_is_singular(rod, backend):
    k = rod(20).stiffness.tolil()
    k[3, :] = 0
    k[:, 3] = 0
    with pytest.raises(SolverError):
        factorize(k.tocsr(), backend=backend)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda k: k.toarray(), "sparse"),
        (lambda k: k[:-1], "square"),
        (lambda k: k[:0, :0], "square"),
        (lambda k: k + sp.coo_array(([50.0], ([2], [3])), shape=k.shape), "not symmetric"),
        (lambda k: sp.triu(k), "not symmetric"),
        (lambda k: k + 1j * (sp.triu(k, 1) - sp.tril(k, -1)), "not symmetric"),  # Hermitian is another class
        (lambda k: k * np.nan, "NaN"),
        (lambda k: k + sp.coo_array(([np.inf], ([0], [0])), shape=k.shape), "NaN or infinite"),
    ],
)
def test_matrices_that_are_refused(rod, backend, change, words):
    with pytest.raises(ValueError, match=words):
        factorize(change(rod(12).stiffness), backend=backend)


def test_right_hand_sides_that_are_refused(rod, backend):
    factor = factorize(rod(12).stiffness, backend=backend)
    for b, words in ((np.ones(11), "shape"), (np.ones((12, 2, 2)), "shape"), (np.full(12, np.nan), "NaN")):
        with pytest.raises(ValueError, match=words):
            factor.solve(b)


def test_unknown_backend_is_refused(rod):
    with pytest.raises(ValueError, match="'cholmod'"):
        factorize(rod(12).stiffness, backend="cholmod")


def test_released_factor_refuses_to_solve(rod, backend):
    with factorize(rod(12).stiffness, backend=backend) as factor:
        factor.solve(np.ones(12))
    factor.release()  # twice does no harm
    with pytest.raises(SolverError, match="released"):
        factor.solve(np.ones(12))
    with pytest.raises(SolverError, match="released"):
        _ = factor.negative_eigenvalues


def test_factor_is_neither_copied_nor_pickled(rod, backend):
    factor = factorize(rod(12).stiffness, backend=backend)
    with pytest.raises(TypeError):
        pickle.dumps(factor)
    with pytest.raises(TypeError):
        copy.deepcopy(factor)


@needs_pardiso
def test_memory_is_freed_on_collection(rod, monkeypatch):
    released = []
    free = pardiso._release
    monkeypatch.setattr(pardiso, "_release", lambda *arguments: (free(*arguments), released.append(1)))
    factor = factorize(rod(12).stiffness, backend="pardiso")
    del factor
    gc.collect()
    assert released == [1]


@needs_pardiso
def test_threads_may_change_between_the_phases(block, rng):
    k, m = block()
    matrix, b = damped(k, m), rng.standard_normal(k.shape[0])
    before = get_threads()
    for first, second in ((1, 2), (2, 1)):
        with threads(first):
            assert get_threads() == first
            factor = factorize(matrix, backend="pardiso")
        with threads(second):
            close(factor.refactorize(matrix).solve(b), np.linalg.solve(matrix.toarray(), b))
    assert get_threads() == before
    with pytest.raises(ValueError, match="number of threads"), threads(0):
        pass


def test_fallback_is_announced_once(rod, monkeypatch, caplog):
    for module in (factorization, pardiso):
        monkeypatch.setattr(module, "load_library", lambda: None)
    factorization._announce_fallback.cache_clear()
    assert available_backends() == ("superlu",)
    with caplog.at_level(logging.WARNING):
        assert [factorize(rod(12).stiffness).backend for _ in range(3)] == ["superlu"] * 3
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert get_threads() == 1
    with threads(2):
        pardiso.set_threads(2)
    with pytest.raises(SolverError, match="not available"):
        factorize(rod(12).stiffness, backend="pardiso")
