"""The errata, from the paper's own numbers."""

import numpy as np
import pytest

from tools.paper.errata import errata
from tools.paper.errata_values import constant_error, euler_car
from tools.paper.printed import (
    correct_truth,
    printed,
    printed_estimates,
    printed_truth,
    relative_error,
)


def test_every_erratum_is_confirmed_by_its_computation():
    found = errata()
    assert len(found) >= 15
    assert [erratum.where for erratum in found if not erratum.is_shown] == []


def test_correct_values_follow_from_table_1_by_state_space_alone():
    alpha, beta = euler_car()
    np.testing.assert_allclose(alpha, correct_truth().alpha, atol=1e-12)
    np.testing.assert_allclose(beta, correct_truth().beta, atol=1e-12)
    np.testing.assert_allclose(alpha, [1.6613, -0.7433, -0.0394], atol=5e-5)
    np.testing.assert_allclose(beta, [3.5982, -4.8980, 2.9962, -0.6964, 0.0041, 0.0030, -0.0062], atol=5e-5)
    np.testing.assert_allclose(
        correct_truth().physical, [-0.6308, -3.3870, -8.1986, 0.4139, -3.9412], atol=5e-5
    )


def test_constant_error_of_table_3_is_the_slipped_sign():
    exact, rounded = constant_error()
    assert exact == pytest.approx(9.3182, abs=5e-5)
    norm = np.linalg.norm(printed()["real"]["alpha"])
    assert rounded == pytest.approx(100.0 * abs(0.7433 - 0.5793) / norm, abs=1e-9)


def test_depth_polynomial_vanishes_at_one_for_the_correct_values_only():
    assert 1.0 - correct_truth().beta[:4].sum() == pytest.approx(0.0, abs=1e-12)
    assert 1.0 - printed_truth().beta[:4].sum() == pytest.approx(-0.2348, abs=1e-4)


@pytest.mark.parametrize("channel", ["alpha", "beta"])
def test_printed_errors_follow_from_printed_estimates_except_the_copied_rows(channel):
    real = getattr(printed_truth(), channel)
    for block in printed_estimates(channel):
        implied = relative_error(block.values, real)
        if (block.table, block.p) == (3, 8):
            assert np.max(np.abs(implied[:3] - block.errors[:3])) > 1.0
        else:
            np.testing.assert_allclose(implied, block.errors, atol=5e-3)
