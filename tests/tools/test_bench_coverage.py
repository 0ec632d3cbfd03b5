"""The coverage bench: its dives are what they say, its bound agrees with the other, it prints its table."""

import numpy as np
import pytest

from tools.accuracy.bound import cramer_rao, joint_bound
from tools.accuracy.coverage import CAMPAIGNS, Campaign, dives_of
from tools.accuracy.dive import Case, fly
from tools.bench_coverage import main


def test_the_autopilot_reaches_the_depths_it_is_told():
    (dive,) = dives_of(CAMPAIGNS["closed loop, depth steps"], 1)
    settled = dive.depth.reshape(10, 300)[:, -50:]
    assert (settled.std(axis=1) < 0.15).all()
    assert np.ptp(settled.mean(axis=1)) > 2.0


def test_errors_wander_with_the_deviation_and_time_they_are_given():
    case = Case(duration=4000.0, pitch_noise=1e-9, depth_noise=1e-9)
    campaign = Campaign(case=case, coloured=((0.002, 1.0), (0.03, 2.0)))
    clean = fly(case, 3000)
    (dive,) = dives_of(campaign, 3)
    error = dive.depth - clean.depth
    assert error.std() == pytest.approx(0.03, rel=0.1)
    assert np.corrcoef(error[20:], error[:-20])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.08)


def test_the_joint_bound_is_that_of_one_dive_and_falls_with_more():
    dives = [fly(Case(duration=60.0), seed) for seed in range(4)]
    np.testing.assert_allclose(joint_bound(dives[:1]), cramer_rao(dives[0]), rtol=1e-6)
    assert (joint_bound(dives) < 0.6 * joint_bound(dives[:1])).all()
    wandering = joint_bound(dives[:1], ((1e-12, 1.0), (0.03, 2.0)))
    assert wandering[0] > 1.2 * cramer_rao(dives[0])[0]
    np.testing.assert_allclose(wandering[1:3], cramer_rao(dives[0])[1:3], rtol=0.2)


def test_the_table_is_printed(capsys):
    assert main(["--seeds", "2", "--only", "8 dives", "--workers", "1", "--quiet"]) == 0
    said = capsys.readouterr().out
    assert "8 dives of 20 s | 2 times, " in said
    assert "95 % intervals that hold" in said


@pytest.mark.parametrize("arguments", [["--seeds", "1"], ["--only", "no such campaign"]])
def test_bad_usage_ends_with_2(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert arguments[0] in capsys.readouterr().err
