"""Other packages beside ours: the same data, the same free run, the same score."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from host.errors import RecordingError
from tools.accuracy.dive import Case, fly
from tools.accuracy.methods import recording_of
from tools.compare import methods
from tools.compare.__main__ import main
from tools.compare.free_run import best_of
from tools.compare.held_out import FAILED, HeldOut, compare, divide, judge, median_of, table_of
from tools.compare.series import series_of


@pytest.fixture(scope="module")
def dive():
    return recording_of(fly(Case(duration=120.0), 1))


def test_series_bridges_gaps_and_holds_the_plane(dive):
    kept = np.r_[0:300, 320:1200]
    channels = ("time", "depth", "pitch", "rudder", "speed", "pitch_rate")
    gappy = replace(dive, **{name: getattr(dive, name)[kept] for name in channels})
    gappy.pitch[5] = np.nan
    series = series_of(gappy)
    assert series.time.size == 1200
    np.testing.assert_array_equal(series.plane[300:320], dive.rudder[299])
    assert series.outputs[0, 5] == pytest.approx(0.5 * (dive.pitch[4] + dive.pitch[6]))
    np.testing.assert_array_equal(series.outputs[1, 320:], dive.depth[320:])


def test_slower_series_average_the_plane_over_the_step_that_follows(dive):
    slow = series_of(dive, 4)
    assert slow.step == pytest.approx(0.4)
    assert slow.plane[7] == pytest.approx(dive.rudder[28:32].mean())
    assert slow.outputs[1, 7] == dive.depth[28]


def test_70_percent_teach_and_the_rest_judge(dive):
    teaching, judging = divide([dive])
    assert teaching[0].time[-1] < judging[0].time[0]
    assert teaching[0].duration == pytest.approx(0.7 * dive.duration, abs=0.2)
    with pytest.raises(RecordingError, match="too short"):
        divide([dive.between(0.0, 30.0)])


def test_judge_scores_known_errors(dive):
    floor = np.array([0.01**2, 0.1**2])
    off = judge("off", lambda r: np.array([r.pitch + 0.02, r.depth - 0.3]), [dive, dive], floor, 0.0)
    np.testing.assert_allclose(off.chi2, [4.0, 9.0])
    np.testing.assert_allclose(off.rmse, [0.02, 0.3])
    spread = np.std(dive.pitch[50:])
    assert off.fit[0] == pytest.approx(100.0 * (1.0 - 0.02 / spread))


def test_judge_ignores_the_opening_and_counts_a_runaway(dive):
    late = judge("late", lambda r: np.where(r.time < 5.0, 1e9, [r.pitch, r.depth]), [dive], np.ones(2), 0.0)
    np.testing.assert_array_equal(late.rmse, 0.0)
    away = judge("away", lambda r: np.full((2, r.time.size), np.nan), [dive], np.ones(2), 0.0)
    assert np.isinf(away.rmse).all()
    assert "diverged" in table_of([away])
    np.testing.assert_array_equal(median_of([late, late, away]).rmse, 0.0)


@dataclass
class Straight:
    """Depth on a straight line of a given slope, m a row."""

    slope: float

    def guess(self, series):
        return np.array([0.0, series.outputs[1, 0] + 1.0])

    def run(self, start, plane):
        return np.array([np.full(plane.size, start[0]), start[1] + self.slope * np.arange(plane.size)])


def refused(_):
    raise ValueError("does not suit")


def test_the_best_of_the_grid_is_chosen_by_free_run_and_started_from_the_opening(dive):
    level = np.zeros(dive.time.size)
    sinking = replace(dive, pitch=level + 0.1, depth=3.0 + 0.05 * np.arange(level.size))
    run = best_of([(1, refused), (1, lambda _: Straight(0.0)), (1, lambda _: Straight(0.05))], [sinking])
    np.testing.assert_allclose(run(sinking), [sinking.pitch, sinking.depth], atol=1e-6)
    with pytest.raises(ValueError, match="no setting"):
        best_of([(1, refused)], [sinking])


def test_the_linear_model_leaves_nothing_where_it_is_true(dive):
    (line,) = compare([dive], methods={"linear": methods.linear_model})
    assert (line.chi2 < 1.5).all()
    assert (line.fit > 90.0).all()


def test_a_method_without_a_model_is_said_so(dive):
    (line,) = compare([dive], methods={"none": refused})
    assert "no model" in table_of([line])


def test_the_missing_are_named_with_the_way_to_get_them(monkeypatch):
    monkeypatch.setattr(methods, "find_spec", lambda name: None if name == "pysindy" else object())
    assert methods.missing() == (
        "not compared, for they are not installed: PySINDy (pip install '.[compare]')"
    )
    assert "PySINDy" not in methods.installed()
    monkeypatch.setattr(methods, "find_spec", str)
    assert methods.missing() == ""


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["nothing.csv"], "nothing.csv"), (["nothing.csv", "--only", "nobody"], "--only must be part of")],
)
def test_bad_usage_ends_with_2(arguments, message, capsys):
    assert main([*arguments, "--quiet"]) == 2
    assert message in capsys.readouterr().err


def test_a_method_without_a_model_is_worse_than_any():
    nothing = HeldOut(method="m", fit=FAILED, chi2=FAILED, rmse=FAILED, seconds=1.0)
    good = HeldOut(method="m", fit=np.array([90.0, 80.0]), chi2=np.ones(2), rmse=np.ones(2), seconds=3.0)
    median = median_of([good, nothing, good])
    np.testing.assert_array_equal(median.fit, good.fit)
    assert np.isneginf(median_of([nothing, nothing, good]).fit).all()
    assert np.isposinf(median_of([nothing, nothing, good]).chi2).all()


@pytest.mark.long
@pytest.mark.parametrize("name", list(methods.PACKAGES))
def test_an_installed_package_learns_the_linear_vehicle(name, dive):
    package = methods.PACKAGES[name]
    pytest.importorskip(package.module)
    (line,) = compare([dive], methods={name: package.teach})
    assert line.fit[0] > 80.0
