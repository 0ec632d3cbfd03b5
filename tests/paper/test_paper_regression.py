"""Three ways to the same least squares, and what the innovation length is worth."""

import numpy as np
import pytest

from tools.paper.equivalence import comparison, effective_memory, equality, forgetting_for
from tools.paper.printed import correct_truth
from tools.paper.regression import rank, respond, rows_of, square_root, textbook, weighted_fit
from tools.paper.rudder import multistep, sine
from tools.paper.search import distance, from_rest


def multistep_rows(channel, seed=0, duration=20.0):
    rudder = multistep(np.random.default_rng(seed), duration)
    return rows_of(channel, respond(getattr(correct_truth(), channel), rudder), rudder)


def test_mils_is_rls_with_a_p_times_weaker_prior():
    found = equality()
    assert found.window_closed < 1e-12
    assert found.confidence == pytest.approx(found.p, rel=0.02)
    settled = found.time > 20.0
    np.testing.assert_allclose(found.mils[settled], found.rls_weaker_prior[settled], rtol=0.2)
    assert (found.rls[settled] > 2.0 * found.mils[settled]).all()


@pytest.mark.parametrize("forgetting", [1.0, 0.97])
@pytest.mark.parametrize("p", [1, 5])
def test_recursions_agree_with_the_solution_without_recursion(p, forgetting):
    rows = multistep_rows("alpha")
    exact = weighted_fit(rows, p, forgetting)
    np.testing.assert_allclose(textbook(rows, p, forgetting).history[-1], exact, atol=1e-5)
    if forgetting == 1.0:
        np.testing.assert_allclose(square_root(rows, p)[-1], exact, atol=1e-9)


def test_unguarded_update_loses_definiteness_where_forgetting_winds_up():
    rudder = sine(50.0, 50.0)
    rows = rows_of("beta", respond(correct_truth().beta, rudder), rudder)
    assert textbook(rows, 5, 0.97).lost_at is not None
    assert np.isfinite(square_root(rows, 5, 0.97)).all()


def test_one_settled_sine_excites_two_directions_of_pitch():
    rudder = sine(0.2, 400.0)
    pitch = respond(correct_truth().alpha, rudder)
    assert rank(rows_of("alpha", pitch[2000:], rudder[2000:]).phi) == 2
    assert rank(multistep_rows("alpha").phi) == 3


def test_rows_with_a_missing_entry_are_left_out():
    output = np.arange(10.0)
    output[5] = np.nan
    rows = rows_of("alpha", output, np.ones(10))
    assert rows.k.tolist() == [2, 3, 4, 8, 9]


def test_forgetting_for_gives_the_memory_asked_for():
    memory = effective_memory(1, 0.97)
    assert effective_memory(8, forgetting_for(8, memory)) == pytest.approx(memory, rel=1e-6)


def test_fair_comparison_leaves_nothing_of_the_faster_convergence():
    table = comparison(10)
    early = dict(zip(table.column("estimator")[:7], table.column("no noise, 60 s: e, %")[:7], strict=True))
    assert early["MILS p = 8, as published"] < 0.3 * early["RLS, as published"]
    assert early["MILS p = 8, fair"] == pytest.approx(early["RLS, as published"], rel=0.1)
    noisy = table.column("noise, 60 s: e rms, %")[:7]
    assert max(noisy) < 1.05 * min(noisy)
    claimed = dict(
        zip(table.column("estimator")[:7], table.column("real error / claimed by P")[:7], strict=True)
    )
    assert claimed["MILS p = 8, fair"] / claimed["RLS, as published"] == pytest.approx(8.0**0.5, rel=0.1)


def test_tables_4_and_5_are_nearest_to_a_sine_of_about_fifty():
    near, plausible = (distance("beta", next(from_rest("beta", a))) for a in (50.0, 0.227))
    assert near < 4.0
    assert plausible > 50.0
