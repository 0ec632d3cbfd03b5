"""The missing-data study and its methods."""

import numpy as np
import pytest

from tools.paper.missing import errors_of, lose, missing_table, record, study
from tools.paper.missing_methods import METHODS, Method


def test_car_methods_are_exact_on_their_own_data_however_much_is_lost_in_bursts():
    whole = record(0, 1)
    off, _, _ = errors_of(METHODS[0], lose(whole, 0.5, 1, 0), record(0, 2))
    assert off < 1e-6


def test_noise_biases_every_regression_and_neither_the_live_estimator_nor_maximum_likelihood():
    noisy = lose(record(2, 1), 0.3, 0, 0)
    off = [errors_of(method, noisy, record(2, 2))[0] for method in METHODS]
    assert min(off[:-2]) > 50.0
    assert off[-2] < 8.0
    assert off[-1] < 5.0


def test_table_has_a_row_for_each_data_method_and_pattern():
    found = study((0.0, 0.3), 1, methods=METHODS[:1])
    table = missing_table(found)
    assert len(table.rows) == 6
    assert table.columns[-2:] == ("0%", "30%")


@pytest.mark.parametrize("pattern", [0, 1])
def test_the_share_asked_for_is_lost(pattern):
    whole = record(0, 1)
    lost = np.mean([np.isnan(lose(whole, 0.4, pattern, seed).depth).mean() for seed in range(10)])
    assert lost == pytest.approx(0.4, abs=0.06)
    assert np.isfinite(lose(whole, 0.0, pattern, 0).pitch).all()


def test_a_method_without_an_answer_counts_as_failed():
    def fails(_):
        raise ValueError("too few rows")

    method = Method(name="none", colour="k", identify=fails)
    assert errors_of(method, record(0, 1), record(0, 2)) == (np.inf, np.inf, np.inf)
    assert errors_of(METHODS[0], lose(record(0, 1), 0.98, 0, 0), record(0, 2))[0] == np.inf
