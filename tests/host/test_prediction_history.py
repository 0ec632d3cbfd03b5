"""What is usual: windows count late, few of them with caution, and a livelier vehicle may miss more."""

import numpy as np
import pytest

from host.live.evidence import Evidence
from host.live.innovations import MARKS, NAMES
from host.live.prediction_history import CAUTION, HELD_BACK, SMALLEST, WHITE, Comparison, PredictionHistory

PLANE = NAMES.index("plane_force")


def window(ratio: float = 1.0, error: float = 1.0, activity: float = 10.0, lack: float = 0.0) -> Comparison:
    """Of one moment; `lack`: what it says of the plane's force that was lacking all along."""
    ratios, leverage = np.full((1, len(NAMES)), ratio), np.full((1, len(NAMES)), activity)
    gram = activity**2 * np.eye(len(MARKS))
    products = np.zeros(len(MARKS))
    products[PLANE] = lack * activity**2
    return Comparison(np.full(2, error), Evidence(ratios, leverage, np.ones(1), gram, products))


def filled(windows: list[Comparison]) -> PredictionHistory:
    history = PredictionHistory(1000, 1)
    for each in [*windows, *[window()] * HELD_BACK]:
        history.add(each)
    return history


def test_windows_count_late_and_few_of_them_not_at_all() -> None:
    history = filled([window()] * (SMALLEST - 1))
    assert history.size == SMALLEST - 1
    assert history.usual_for(window()) is None
    history.add(window())
    assert history.usual_for(window()) is not None


@pytest.mark.parametrize(("usual", "most"), [(0.5, WHITE), (5.0, 5.0)])
def test_strength_is_by_the_strongest_that_was_usual(usual: float, most: float) -> None:
    # Three windows far off are not yet usual.
    history = filled([window(-usual)] * 400 + [window(50.0)] * 3)
    past = history.usual_for(window())
    assert past is not None
    assert past.strength(window(8.0)) == pytest.approx(8.0 / most / (1.0 + CAUTION / 403.0))


def test_growth_is_by_twice_the_worst_that_was_usual() -> None:
    past = filled([window(error=2.0)] * 400).usual_for(window())
    assert past is not None
    assert past.growth(window(error=4.0)) == pytest.approx(1.0 / (1.0 + CAUTION / 400.0))
    assert past.usual_errors == pytest.approx(2.0)


def test_a_vehicle_livelier_than_ever_may_miss_by_the_square_of_it() -> None:
    history = filled([window(3.0)] * 400)
    usual, lively = history.usual_for(window()), history.usual_for(window(activity=30.0))
    assert usual is not None
    assert lively is not None
    assert lively.strength(window(8.0)) == pytest.approx(usual.strength(window(8.0)) / 9.0)
    assert lively.usual_errors == pytest.approx(9.0 * usual.usual_errors)


def test_what_was_lacking_all_along_is_learnt_and_forgotten_with_the_reference() -> None:
    history = filled([window(lack=0.3)] * 400)
    assert history.lacking.sizes[PLANE] == pytest.approx(0.3, rel=0.1)
    assert np.sqrt(history.lacking.covariance[PLANE, PLANE]) < 0.05
    history.begin_lacking()
    assert not history.lacking.sizes.any()
