"""Long runs on the fourth-order depth model, where the numerical form decides between life and death."""

import math

import numpy as np
import pytest
from car_data import car_signals, depth_rows, random_rudder
from ud_reference import UdReference

from firmware_model import Mils, Status

N = 7


def multisine_rows(count, seed=3):
    t = 0.1 * np.arange(count + 4)
    tones = ((0.02, 0), (0.05, 1), (0.11, 2), (0.23, 3), (0.41, 4), (0.7, 5), (1.1, 6))
    rudder = sum(0.06 * np.sin(2 * np.pi * f * t + phase) for f, phase in tones)
    rudder[:4] = 0.0
    depth = car_signals(rudder, np.random.default_rng(seed), depth_noise=1e-3)[1]
    return depth_rows(depth, rudder)


def smallest_singular_value(mils):
    """Of the root of P, in double precision: P is positive definite while it is above zero."""
    root = np.array(mils.state()["root"]).reshape(mils.n, mils.n)
    return np.linalg.svd(root, compute_uv=False)[-1]


def check_against_ud(p, forgetting, count):
    rows, outputs = multisine_rows(count)
    mils = Mils(N, p, forgetting, 1e6, cap=math.inf)
    reference = UdReference(N, p, forgetting, 1e6)
    for k, (row, y) in enumerate(zip(rows.tolist(), outputs.tolist(), strict=True)):
        assert mils.update(row, y) is Status.UPDATED
        reference.update(row, y)
        if k % 500 == 0 or k == count - 1:
            P, expected = mils.covariance, reference.covariance
            std = np.sqrt(np.diag(expected))
            assert smallest_singular_value(mils) > 1e-6
            np.testing.assert_allclose(P / np.outer(std, std), expected / np.outer(std, std), atol=1e-9)
            np.testing.assert_allclose(np.array(mils.theta) / std, reference.theta / std, atol=1e-9)


@pytest.mark.parametrize(("p", "forgetting", "count"), [(1, 0.97, 20_000), (8, 0.998, 4_000)])
def test_square_root_form_agrees_with_ud_form(p, forgetting, count):
    check_against_ud(p, forgetting, count)


@pytest.mark.long
@pytest.mark.parametrize(("p", "forgetting"), [(1, 0.97), (1, 1.0), (8, 0.97), (8, 0.998), (8, 1.0)])
def test_square_root_form_agrees_with_ud_form_over_100_000_steps(p, forgetting):
    check_against_ud(p, forgetting, 100_000)


def textbook_death(rows, p, forgetting, p0, dtype):
    """Step at which P <- (P - L Phi^T P)/forgetting stops being positive definite; None if it does not."""
    P = (p0 * np.eye(N)).astype(dtype)
    forgetting = dtype(forgetting)
    rows = rows.astype(dtype)
    for k in range(len(rows)):
        Phi = rows[max(0, k - p + 1) : k + 1][::-1].T
        S = Phi.T @ P @ Phi + forgetting * np.eye(Phi.shape[1], dtype=dtype)
        L = np.linalg.solve(S.T, (P @ Phi).T).T
        P = (P - L @ (Phi.T @ P)) / forgetting
        if np.linalg.eigvalsh((P + P.T).astype(float)).min() <= 0.0:
            return k
    return None


@pytest.mark.parametrize("p", [1, 8])
@pytest.mark.parametrize("forgetting", [0.97, 1.0])
def test_single_precision_survives_where_the_textbook_update_dies(p, forgetting):
    rows, outputs = multisine_rows(1000)
    death = textbook_death(rows, p, forgetting, 1e6, np.float32)
    assert death is not None
    assert death < 500
    single = Mils(N, p, forgetting, 1e6, real=np.float32)
    double = Mils(N, p, forgetting, 1e6)
    innovations = []
    for k, (row, y) in enumerate(zip(rows.tolist(), outputs.tolist(), strict=True)):
        assert single.update(row, y) in (Status.UPDATED, Status.CAPPED)
        double.update(row, y)
        innovations.append((single.innovation, double.innovation))
        if k % 50 == 0:
            assert smallest_singular_value(single) > 1e-5
    rms_single, rms_double = np.sqrt(np.mean(np.square(innovations[200:]), axis=0))
    assert rms_single == pytest.approx(rms_double, rel=0.01)


@pytest.mark.long
@pytest.mark.parametrize("forgetting", [0.97, 0.998, 1.0])
def test_single_precision_survives_100_000_steps(forgetting):
    rows, outputs = multisine_rows(100_000)
    mils = Mils(N, 1, forgetting, 1e6, real=np.float32)
    innovations = []
    for k, (row, y) in enumerate(zip(rows.tolist(), outputs.tolist(), strict=True)):
        assert mils.update(row, y) in (Status.UPDATED, Status.CAPPED)
        innovations.append(mils.innovation)
        if k % 1000 == 0:
            assert smallest_singular_value(mils) > 1e-7
    assert np.std(innovations[-10_000:]) < 1.2e-3  # the noise is 1.0e-3


def rest(mils, steps):
    """A vehicle lying at 5 m; the steps until the first fault."""
    phi = [-5.0, -5.0, -5.0, -5.0, 0.0, 0.0, 0.0]
    for k in range(steps):
        status = mils.update(phi, 5.0)
        if status is Status.FAULT_NUMERICAL:
            return k
        assert status in (Status.UPDATED, Status.CAPPED)
    return None


def check_after_rest(mils):
    assert mils.covariance.diagonal().max() <= 1e6 * (1 + 1e-6)
    assert smallest_singular_value(mils) > 1e-7
    assert mils.predict([-5.0, -5.0, -5.0, -5.0, 0.0, 0.0, 0.0]) == pytest.approx(5.0, abs=1e-4)
    # It still learns: the plane's coefficients are as open as at the start.
    rng = np.random.default_rng(0)
    rudder = random_rudder(rng, 900)
    rows, outputs = depth_rows(car_signals(rudder, rng, depth_noise=1e-4)[1], rudder)
    for row, y in zip(rows.tolist(), outputs.tolist(), strict=True):
        mils.update(row, y)
    assert abs(mils.innovation) < 1e-3


@pytest.mark.parametrize(("real", "death"), [(float, 22_849), (np.float32, 2_459)])
def test_without_a_cap_rest_winds_the_covariance_up_until_it_overflows(real, death):
    mils = Mils(N, 1, 0.97, 1e6, cap=math.inf, real=real)
    assert rest(mils, 30_000) == death  # 38 min and 4 min at 10 Hz
    assert np.isfinite(mils.theta).all()


@pytest.mark.parametrize(("real", "steps"), [(float, 72_000), (np.float32, 9_000)])
def test_cap_holds_the_covariance_at_rest(real, steps):
    mils = Mils(N, 1, 0.97, 1e6, real=real)
    assert rest(mils, steps) is None
    check_after_rest(mils)


@pytest.mark.long
@pytest.mark.parametrize("real", [float, np.float32])
def test_cap_holds_the_covariance_over_a_day_at_rest(real):
    mils = Mils(N, 1, 0.97, 1e6, real=real)
    assert rest(mils, 864_000) is None
    check_after_rest(mils)
