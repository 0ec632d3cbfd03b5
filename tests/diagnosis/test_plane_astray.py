"""A plane that is steered at 20 Hz and recorded at 4."""

from dataclasses import replace
from functools import cache

import numpy as np
from hidden_dive import BASE
from scipy.linalg import expm

from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.plane_astray import astray_share, whole_astray
from host.diagnosis.plane_choice import Way, _astray
from host.dynamics.propagate import inputs_of
from host.recordings.plane_between_rows import with_moving_plane, with_plane_astray
from host.recordings.recording import Recording

FINE, ROWS, EACH = 0.05, 600, 5


@cache
def steered(is_restless: bool) -> Recording:
    """The paper's vehicle; its plane swings slowly, and in bursts jumps anew every 0.05 s, or does not."""
    rng, time = np.random.default_rng(1), FINE * np.arange(ROWS * EACH)
    plane = 0.12 * np.sin(0.9 * time) + 0.05 * np.sin(0.23 * time)
    if is_restless:
        bursts = np.repeat(rng.random(ROWS * EACH // 40) < 0.4, 40)
        plane += 0.15 * bursts * rng.standard_normal(time.size)
    rates = np.zeros((5, 5))
    rates[0, [0, 4]] = BASE["a1"], BASE["b1"]
    rates[1, [1, 2, 4]] = BASE["a2"], BASE["a3"], BASE["b2"]
    rates[2, 1] = 1.0
    rates[3, [0, 2]] = 1.0, -BASE["u0"]
    over = expm(rates * FINE)
    x, states = np.array([0.0, 0.0, 0.0, 20.0]), np.empty((4, time.size))
    for k, angle in enumerate(plane):
        states[:, k] = x
        x = over[:4, :4] @ x + over[:4, 4] * angle
    seen, nan = states[:, ::EACH], np.full(ROWS, np.nan)
    return Recording(
        name="steered.csv",
        sha256="0" * 64,
        time=time[::EACH],
        depth=seen[3] + 0.01 * rng.standard_normal(ROWS),
        pitch=seen[2] + np.deg2rad(0.1) * rng.standard_normal(ROWS),
        rudder=plane[::EACH],
        speed=nan,
        pitch_rate=nan,
        step=FINE * EACH,
    )


@cache
def fitted(is_restless: bool) -> Fitter:
    return Fitter([with_moving_plane(steered(is_restless))])


def test_a_restless_plane_is_off_by_a_share_of_what_it_moved_and_a_calm_one_by_nothing() -> None:
    assert astray_share(fitted(True)) > 0.1
    assert astray_share(fitted(False)) == 0.0


def test_the_way_says_so_and_begins_with_all_that_every_vehicle_has_beside_that() -> None:
    ways = [Way([steered(True)], Fitter([steered(True)])), Way(fitted(True).recordings, fitted(True))]
    (way,) = _astray(ways, ways[0].fitter.root, lambda _: None)
    assert way.is_astray
    assert way.recordings[0].plane_astray > 0.1
    assert any("more often than it was recorded" in note for note in way.recordings[0].notes)
    assert way.pushed is not None
    assert way.pushed.fit.has_process_noise
    assert way.pushed.leaves_white
    assert not _astray(ways[:1], ways[0].fitter.root, lambda _: None)  # it holds its angles


def test_a_part_of_the_recording_keeps_how_far_its_plane_moved() -> None:
    told = with_plane_astray(fitted(True).recordings[0], 0.2)
    part = told.between(10.0, 20.0)
    assert part.plane_moved is not None
    assert part.plane_moved.size == part.time.size
    assert np.allclose(inputs_of(part).astray, 0.2 * np.abs(part.plane_moved))
    assert inputs_of(replace(part, plane_astray=0.0)).astray.size == 0
    assert inputs_of(steered(True)).astray.size == 0


def test_it_is_begun_with_under_forces() -> None:
    told = Fitter([with_plane_astray(fitted(True).recordings[0], 0.2)])
    assert whole_astray(told).bic < whole_astray(fitted(True)).bic - 50.0
