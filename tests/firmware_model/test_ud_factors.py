"""The factors against dense algebra."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_model.propagation import COUNT, PATTERN, W
from firmware_model.ud_factors import UdFactors

seeds = st.integers(0, 2**32 - 1)


def random_factors(rng, exact=()):
    """Factors with random numbers; entries in `exact` have no variance."""
    ud = UdFactors(COUNT, PATTERN, driven=(0, 1))
    ud.x[:] = rng.normal(size=COUNT).tolist()
    for j in range(COUNT):
        ud.D[j] = 0.0 if j in exact else float(np.exp(rng.normal()))
        ud.L[j][j + 1 :] = rng.normal(size=COUNT - j - 1).tolist()
    return ud


def dense(ud):
    L = np.array(ud.L).T
    np.testing.assert_array_equal(L, np.tril(L))
    np.testing.assert_array_equal(np.diag(L), 1.0)
    assert min(ud.D) >= 0.0
    return L @ np.diag(ud.D) @ L.T


@given(seeds)
def test_covariance_and_spread_are_those_of_the_dense_matrix(seed):
    rng = np.random.default_rng(seed)
    ud = random_factors(rng)
    P = dense(ud)
    h = rng.normal(size=COUNT)
    np.testing.assert_allclose(
        [[ud.covariance(i, j) for j in range(COUNT)] for i in range(COUNT)], P, atol=1e-12
    )
    assert ud.spread(h.tolist()) == pytest.approx(h @ P @ h, rel=1e-9)


@given(seeds, st.floats(1e-6, 1e3), st.sets(st.integers(0, COUNT - 1), max_size=3))
def test_observe_is_the_kalman_update(seed, variance, exact):
    rng = np.random.default_rng(seed)
    ud = random_factors(rng, exact)
    P, x = dense(ud), np.array(ud.x)
    h = rng.normal(size=COUNT) * (rng.random(COUNT) < 0.6)
    error = float(rng.normal())
    K = P @ h / (h @ P @ h + variance)
    ud.observe(h.tolist(), error, variance)
    scale = 1.0 + np.abs(P).max()
    np.testing.assert_allclose(ud.x, x + K * error, atol=1e-9 * scale)
    np.testing.assert_allclose(dense(ud), P - np.outer(K, h @ P), atol=1e-9 * scale)


@given(seeds, st.integers(0, COUNT - 1))
def test_observe_entry_is_observe_with_a_unit_row(seed, entry):
    one, other = random_factors(np.random.default_rng(seed)), random_factors(np.random.default_rng(seed))
    one.observe_entry(entry, 0.7, 0.3)
    other.observe([float(i == entry) for i in range(COUNT)], 0.7, 0.3)
    np.testing.assert_allclose(one.x, other.x, atol=1e-12)
    np.testing.assert_allclose(dense(one), dense(other), atol=1e-10)


@given(seeds, st.floats(0.0, 10.0))
def test_add_is_a_rank_one_addition(seed, variance):
    rng = np.random.default_rng(seed)
    ud = random_factors(rng)
    P = dense(ud)
    w = rng.normal(size=COUNT) * (rng.random(COUNT) < 0.5)
    ud.add(w.tolist(), variance)
    np.testing.assert_allclose(dense(ud), P + variance * np.outer(w, w), atol=1e-9 * (1.0 + np.abs(P).max()))


@given(seeds)
def test_move_is_the_time_update_and_leaves_the_parameters_alone(seed):
    rng = np.random.default_rng(seed)
    ud = random_factors(rng)
    P = dense(ud)
    F = np.zeros((COUNT - W, COUNT))
    for row, columns in zip(F, PATTERN, strict=True):
        row[list(columns)] = rng.normal(size=len(columns))
    noise = np.exp(rng.normal(size=2))
    whole = np.vstack([np.eye(COUNT)[:W], F])
    expected = whole @ P @ whole.T
    expected[W, W] += noise[0]
    expected[W + 1, W + 1] += noise[1]
    ud.move(F.tolist(), noise.tolist())
    np.testing.assert_allclose(dense(ud), expected, atol=1e-9 * (1.0 + np.abs(expected).max()))


def test_forget_makes_moving_entries_independent():
    ud = random_factors(np.random.default_rng(1))
    before = dense(ud)
    for entry in range(W, COUNT):
        ud.forget(entry, 0.5, 4.0)
    after = dense(ud)
    np.testing.assert_allclose(after[:W, :W], before[:W, :W])
    np.testing.assert_array_equal(after[W:, :W], 0.0)
    np.testing.assert_array_equal(after[W:, W:], 4.0 * np.eye(COUNT - W))
    assert ud.x[W:] == [0.5] * (COUNT - W)


def test_rollback_is_what_was_saved():
    ud = random_factors(np.random.default_rng(2))
    saved, x = dense(ud), list(ud.x)
    ud.save()
    ud.observe_entry(3, 1.0, 0.1)
    ud.add([1.0] * COUNT, 2.0)
    ud.rollback()
    np.testing.assert_array_equal(dense(ud), saved)
    assert ud.x == x


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_is_finite_sees_every_entry(bad):
    for place in ("x", "D", "L"):
        for j in range(COUNT - 1):
            ud = random_factors(np.random.default_rng(3))
            assert ud.is_finite
            target = ud.L[j] if place == "L" else getattr(ud, place)
            target[j + 1 if place == "L" else j] = bad
            assert not ud.is_finite


@settings(max_examples=5, deadline=None)
@given(seeds)
def test_a_thousand_precise_observations_keep_p_positive(seed):
    rng = np.random.default_rng(seed)
    ud = random_factors(rng)
    for _ in range(1000):
        ud.observe(rng.normal(size=COUNT).tolist(), 0.0, 1e-12)
    assert min(ud.D) >= 0.0
    assert np.linalg.eigvalsh(dense(ud)).min() > -1e-15
