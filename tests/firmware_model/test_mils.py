"""The estimator against batch least squares, exact arithmetic and a second form; its guards."""

import gc
import json
import math
import sys
from fractions import Fraction

import numpy as np
import pytest
from car_data import ALPHA, car_signals, pitch_rows, random_rudder
from hypothesis import given, settings
from hypothesis import strategies as st
from ud_reference import UdReference

from firmware_model import Mils, Status


def random_rows(n, count, seed=0, noise=0.1):
    rng = np.random.default_rng(seed)
    truth = rng.normal(size=n)
    rows = rng.normal(size=(count, n))
    return rows, rows @ truth + noise * rng.normal(size=count), truth


def feed(mils, rows, outputs):
    return [mils.update(row, y) for row, y in zip(rows.tolist(), outputs.tolist(), strict=True)]


def batch(rows, outputs, weights, prior_weight, prior_theta):
    """Weighted least squares with the prior as n more observations."""
    information = rows.T @ (weights[:, None] * rows) + prior_weight * np.eye(rows.shape[1])
    right = rows.T @ (weights * outputs) + prior_weight * prior_theta
    return np.linalg.solve(information, right), np.linalg.inv(information)


@pytest.mark.parametrize("forgetting", [1.0, 0.97])
@pytest.mark.parametrize("p", [1, 4])
def test_mils_equals_batch_least_squares(p, forgetting):
    n, count, p0 = 4, 60, 1e3
    rows, outputs, _ = random_rows(n, count)
    mils = Mils(n, p, forgetting, p0, cap=math.inf)
    assert set(feed(mils, rows, outputs)) == {Status.UPDATED}
    weights = np.zeros(count)
    for step in range(count):
        weights *= forgetting
        weights[max(0, step - p + 1) : step + 1] += 1.0
    theta, covariance = batch(rows, outputs, weights, forgetting**count / p0, 1.0 / p0)
    np.testing.assert_allclose(mils.theta, theta, rtol=1e-9)
    # After its last step the recursion divides by the forgetting factor once more than the weights do.
    np.testing.assert_allclose(mils.covariance, covariance, rtol=1e-8)
    assert mils.reuse == pytest.approx((weights**2).sum() / weights.sum(), rel=1e-12)


def exact_inverse(matrix):
    n = len(matrix)
    work = [list(row) + [Fraction(int(i == j)) for j in range(n)] for i, row in enumerate(matrix)]
    for i in range(n):
        pivot = next(r for r in range(i, n) if work[r][i] != 0)
        work[i], work[pivot] = work[pivot], work[i]
        work[i] = [value / work[i][i] for value in work[i]]
        for r in range(n):
            if r != i:
                work[r] = [a - work[r][i] * b for a, b in zip(work[r], work[i], strict=True)]
    return np.array([row[n:] for row in work], dtype=object)


def test_square_root_step_equals_textbook_update_in_exact_arithmetic():
    n, p, p0 = 3, 3, 64.0  # powers of two, so that the prior is the same number in both
    forgetting = Fraction(7, 8)
    rows, outputs, _ = random_rows(n, 8)
    mils = Mils(n, p, float(forgetting), p0, cap=math.inf)
    theta = np.array([Fraction(1, 64)] * n, dtype=object)
    P = np.array([[Fraction(64 * int(i == j)) for j in range(n)] for i in range(n)], dtype=object)
    exact_rows = np.array([[Fraction(x) for x in row] for row in rows.tolist()], dtype=object)
    exact_outputs = np.array([Fraction(y) for y in outputs.tolist()], dtype=object)
    for k in range(len(rows)):
        window = list(range(k, max(-1, k - p), -1))
        Phi = exact_rows[window].T
        E = exact_outputs[window] - Phi.T @ theta
        S = Phi.T @ P @ Phi + np.array(
            [[forgetting * int(i == j) for j in range(len(window))] for i in range(len(window))], dtype=object
        )
        L = P @ Phi @ exact_inverse(S.tolist())
        theta = theta + L @ E
        P = (P - L @ (Phi.T @ P)) / forgetting
        mils.update(rows[k].tolist(), outputs[k])
        np.testing.assert_allclose(mils.theta, theta.astype(float), rtol=1e-12)
        np.testing.assert_allclose(mils.covariance, P.astype(float), rtol=1e-10, atol=1e-15)


@pytest.mark.parametrize(("n", "p", "forgetting"), [(3, 1, 1.0), (3, 8, 0.97), (7, 5, 0.99), (7, 8, 0.97)])
def test_block_step_equals_scalar_updates_then_one_division(n, p, forgetting):
    rows, outputs, _ = random_rows(n, 300)
    mils = Mils(n, p, forgetting, 1e6, cap=math.inf)
    reference = UdReference(n, p, forgetting, 1e6)
    for row, y in zip(rows.tolist(), outputs.tolist(), strict=True):
        mils.update(row, y)
        reference.update(row, y)
    np.testing.assert_allclose(mils.theta, reference.theta, rtol=1e-11)
    np.testing.assert_allclose(mils.covariance, reference.covariance, rtol=1e-9, atol=1e-14)


def test_one_row_a_step_is_recursive_least_squares():
    n, forgetting, p0 = 3, 0.97, 1e6
    rows, outputs, _ = random_rows(n, 50)
    mils = Mils(n, 1, forgetting, p0, cap=math.inf)
    theta, P = np.full(n, 1.0 / p0), p0 * np.eye(n)
    for phi, y in zip(rows, outputs, strict=True):
        mils.update(phi.tolist(), y)
        gain = P @ phi / (forgetting + phi @ P @ phi)
        theta = theta + gain * (y - phi @ theta)
        P = (P - np.outer(gain, phi @ P)) / forgetting
        P = (P + P.T) / 2
    np.testing.assert_allclose(mils.theta, theta, rtol=1e-9)
    np.testing.assert_allclose(mils.covariance, P, rtol=1e-7)


def test_overlapping_windows_without_forgetting_are_rls_with_a_weaker_prior():
    n, p, count, p0 = 3, 5, 400, 10.0
    rows, outputs, _ = random_rows(n, count)
    # Rows of zeros before and after give every real row all its p turns.
    zeros = np.zeros((p - 1, n))
    padded = np.vstack([zeros, rows, zeros])
    mils = Mils(n, p, 1.0, p0)
    feed(mils, padded, np.concatenate([np.zeros(p - 1), outputs, np.zeros(p - 1)]))
    rls = Mils(n, 1, 1.0, p0 * p)
    rls._step.theta[:] = [1.0 / p0] * n
    feed(rls, rows, outputs)
    np.testing.assert_allclose(mils.theta, rls.theta, rtol=1e-11)
    np.testing.assert_allclose(p * mils.covariance, rls.covariance, rtol=1e-11)


def test_noise_free_pitch_data_give_the_true_coefficients():
    rng = np.random.default_rng(1)
    rudder = random_rudder(rng, 600)
    rows, outputs = pitch_rows(car_signals(rudder)[0], rudder)
    mils = Mils(3, 5, 1.0, 1e9)
    feed(mils, rows, outputs)
    np.testing.assert_allclose(mils.theta, ALPHA, atol=2e-7)


@pytest.mark.parametrize(("p", "forgetting"), [(1, 1.0), (5, 1.0), (1, 0.97), (5, 0.97)])
def test_std_is_the_scatter_of_the_estimates(p, forgetting):
    scores, noises = [], []
    for seed in range(40):
        rows, outputs, truth = random_rows(3, 400, seed=seed, noise=0.2)
        mils = Mils(3, p, forgetting, 1e6)
        feed(mils, rows, outputs)
        scores.append((np.array(mils.theta) - truth) / np.array(mils.std))
        noises.append(mils.noise_variance)
    assert 0.85 < np.sqrt(np.mean(np.square(scores))) < 1.2  # uncorrected, p = 5 would give 2.2
    assert np.sqrt(np.mean(noises)) == pytest.approx(0.2, rel=0.06)


def test_innovation_is_a_priori_and_its_scale_is_right():
    rows, outputs, _ = random_rows(3, 3000, noise=0.2)
    mils = Mils(3, 4, 1.0, 1e6)
    scores = []
    for row, y in zip(rows.tolist(), outputs.tolist(), strict=True):
        expected = y - mils.predict(row)
        scale = mils.innovation_std(row)
        mils.update(row, y)
        assert mils.innovation == pytest.approx(expected, abs=1e-12)
        scores.append(mils.innovation / scale)
    assert np.std(scores[100:]) == pytest.approx(1.0, rel=0.05)


@given(
    st.lists(
        st.lists(st.floats(-1e3, 1e3, allow_subnormal=False), min_size=4, max_size=4),
        min_size=1,
        max_size=25,
    ),
    st.integers(1, 6),
    st.sampled_from([1.0, 0.99, 0.9]),
)
@settings(max_examples=60, deadline=None)
def test_any_rows_leave_finite_estimates_and_a_bounded_covariance(rows, p, forgetting):
    mils = Mils(3, p, forgetting, 1e6)
    for row in rows:
        assert mils.update(row[:3], row[3]) in (Status.UPDATED, Status.CAPPED)
    assert np.isfinite(mils.theta).all()
    assert np.diag(mils.covariance).max() <= 1e6 * (1 + 1e-9)
    assert np.linalg.eigvalsh(mils.covariance).min() > -1e-9


@pytest.mark.parametrize(
    ("phi", "y"),
    [
        ([math.nan, 0.0, 0.0], 0.0),
        ([0.0, 0.0, math.inf], 0.0),
        ([0.0, 0.0, 0.0], math.nan),
        ([0.0, 0.0, 0.0], -math.inf),
        ([1.0, 2.0], 0.0),
    ],
)
@pytest.mark.parametrize("real", [float, np.float32])
def test_non_finite_row_is_refused_and_changes_nothing(phi, y, real):
    rows, outputs, _ = random_rows(3, 20)
    mils, untouched = Mils(3, 4, 0.97, real=real), Mils(3, 4, 0.97, real=real)
    for k in range(20):
        assert mils.update(phi, y) is Status.REFUSED_NON_FINITE
        for each in (mils, untouched):
            each.update(rows[k].tolist(), outputs[k])
    assert mils.state() == untouched.state()


@pytest.mark.parametrize(
    ("phi", "y"), [([1e200, 0.0, 0.0], 0.0), ([1.0, 0.0, 0.0], 1.7e308), ([1e-300, 1e180, 0], 1.0)]
)
def test_overflow_is_a_fault_and_changes_nothing(phi, y):
    rows, outputs, _ = random_rows(3, 20)
    mils = Mils(3, 4, 0.97)
    feed(mils, rows, outputs)
    before = mils.state()
    assert mils.update(phi, y) is Status.FAULT_NUMERICAL
    assert mils.state() == before
    assert mils.update(rows[0].tolist(), outputs[0]) is Status.UPDATED


def test_single_precision_overflow_is_a_fault_without_a_warning():
    mils = Mils(3, 4, 0.97, real=np.float32)
    assert mils.update([1e30, 0.0, 0.0], 0.0) is Status.FAULT_NUMERICAL
    assert mils.update([1e300, 0.0, 0.0], 0.0) is Status.REFUSED_NON_FINITE
    assert mils.update([1.0, 0.0, 0.0], 1.0) in (Status.UPDATED, Status.CAPPED)


def test_step_that_could_pass_the_cap_forgets_nothing():
    mils = Mils(2, 1, 0.9, 100.0)
    assert mils.update([1.0, 0.0], 1.0) is Status.CAPPED
    np.testing.assert_allclose(mils.covariance, [[100.0 / 101.0, 0.0], [0.0, 100.0]])
    assert mils.update([0.0, 1.0], 1.0) is Status.CAPPED
    assert mils.update([1.0, 0.0], 1.0) is Status.UPDATED
    uncapped = Mils(2, 1, 0.9, 100.0, cap=math.inf)
    assert uncapped.update([1.0, 0.0], 1.0) is Status.UPDATED
    assert uncapped.covariance[1, 1] == pytest.approx(100.0 / 0.9)


def test_state_goes_through_json_and_goes_on_with_the_same_bits():
    rows, outputs, _ = random_rows(3, 60)
    for cut in (0, 2, 5, 30):
        mils, other = Mils(3, 4, 0.97), Mils(3, 4, 0.97)
        feed(mils, rows[:cut], outputs[:cut])
        feed(other, rows[7:20], outputs[7:20])
        other.restore(json.loads(json.dumps(mils.state())))
        assert other.state() == mils.state()
        assert feed(mils, rows[cut:], outputs[cut:]) == feed(other, rows[cut:], outputs[cut:])
        assert other.state() == mils.state()
        assert (other.covariance == mils.covariance).all()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("schema", 2),
        ("n", 7),
        ("p", 5),
        ("theta", [0.0, 0.0]),
        ("theta", [0.0, 0.0, math.nan]),
        ("theta", [0.0, 0.0, "0"]),
        ("theta", [0, 0, 10**400]),
        ("root", [0.0] * 9),
        ("root", None),
        ("rows", [0.0]),
        ("outputs", [0.0] * 5),
        ("weights", []),
        ("sums", [-1.0, 0.0, 0.0, 0.0, 0.0]),
        ("updates", -1),
        ("updates", "many"),
    ],
)
def test_state_that_does_not_fit_is_refused_and_changes_nothing(key, value):
    rows, outputs, _ = random_rows(3, 10)
    mils = Mils(3, 4)
    feed(mils, rows, outputs)
    before = mils.state()
    with pytest.raises(ValueError, match=rf"state\.{key} must"):
        mils.restore({**before, key: value})
    assert mils.state() == before


def test_reset_is_as_constructed():
    rows, outputs, _ = random_rows(3, 30)
    mils = Mils(3, 4, 0.97)
    feed(mils, rows, outputs)
    mils.reset()
    assert mils.state() == Mils(3, 4, 0.97).state()
    assert mils.std == (math.inf,) * 3
    assert mils.noise_variance == math.inf


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n": 0}, r"n must be at least 1 \(got 0\)"),
        ({"p": 0}, r"p must be at least 1 \(got 0\)"),
        ({"forgetting": 1.5}, r"forgetting must be in \(0, 1\] \(got 1.5\)"),
        ({"forgetting": 0.0}, r"forgetting must be in \(0, 1\] \(got 0.0\)"),
        ({"forgetting": math.nan}, r"forgetting must be in \(0, 1\] \(got nan\)"),
        ({"p0": 0.0}, r"p0 must be positive and finite \(got 0.0\)"),
        ({"p0": math.inf}, r"p0 must be positive and finite \(got inf\)"),
        ({"cap": -1.0}, r"cap must be positive \(got -1.0\)"),
    ],
)
def test_nonsense_is_refused_by_the_constructor(arguments, message):
    with pytest.raises(ValueError, match=message):
        Mils(**{"n": 3, **arguments})


def buffers(mils):
    owners = (mils, mils._step)
    return {
        (i, name): (id(value), len(value))
        for i, owner in enumerate(owners)
        for name, value in vars(owner).items()
        if isinstance(value, list)
    }


def test_updates_keep_their_buffers_and_allocate_nothing_lasting():
    rows, outputs, _ = random_rows(3, 500)
    rows, outputs = rows.tolist(), outputs.tolist()
    mils = Mils(3, 5, 0.97)
    steps = range(10_000)

    def run():
        for k in steps:
            mils.update(rows[k % 500], outputs[k % 500])

    run()
    before = buffers(mils)
    assert len(before) == 13
    gc.collect()
    blocks = sys.getallocatedblocks()
    run()
    gc.collect()
    assert abs(sys.getallocatedblocks() - blocks) < 100  # one block a step would be 10,000
    assert buffers(mils) == before
