"""What drifts is whitened as its covariance says, and found with its levels."""

from dataclasses import replace

import numpy as np
import pytest

from host.noise.drift import NOTHING, Drift, Whitening, log_likelihood
from host.noise.drift_levels import OF_DEPTH, OF_PITCH, SENSOR, WATER, likeliest_drift
from host.recordings.recording import Array

ROWS = 240
STEPS = np.random.default_rng(1).choice([0.1, 0.2, 1.0], ROWS)  # s
TIME = np.concatenate([[0.0], np.cumsum(STEPS)[:-1]])
WANDER, CURRENT, SPEED = (4.0, 3.0), (0.5, 2.0), (0.3, 0.9)
LEVER = 0.2 * np.sin(TIME)


def covariance(
    wander: tuple[float, float], current: tuple[float, float], speed: tuple[float, float]
) -> Array:
    """Of the residuals over the variance of the white noise: from the definition, all rows at once."""
    apart = np.abs(np.subtract.outer(TIME, TIME))
    total = np.eye(ROWS) + wander[0] * np.exp(-apart / wander[1])
    fine = np.linspace(0.0, TIME[-1], 4000)
    width = fine[1] - fine[0]
    seen = (
        np.clip((TIME[:, None] - fine + 0.5 * width) / width, 0.0, 1.0) * width
    )  # of each moment, by each row
    total += seen @ (current[0] * np.exp(-np.abs(np.subtract.outer(fine, fine)) / current[1])) @ seen.T
    rows = np.abs(np.subtract.outer(np.arange(ROWS), np.arange(ROWS)))
    lost = np.tril(np.tile(-LEVER, (ROWS, 1)), -1)
    return np.asarray(total + lost @ (speed[0] * speed[1] ** rows) @ lost.T)


@pytest.mark.parametrize(
    ("wander", "current", "speed"),
    [(WANDER, NOTHING, NOTHING), (NOTHING, CURRENT, NOTHING), (WANDER, CURRENT, SPEED)],
)
def test_it_whitens_as_the_whole_covariance_does(
    wander: tuple[float, float], current: tuple[float, float], speed: tuple[float, float]
) -> None:
    rng = np.random.default_rng(2)
    known = rng.random(ROWS) > 0.2
    drift = Drift(
        present=known.astype(float),
        interval=STEPS,
        wander=wander,
        current=current,
        leverage=LEVER,
        speed=speed,
    )
    values = rng.standard_normal((3, ROWS)) * known
    white = Whitening(drift).whitened(values)[:, known]
    whole = covariance(wander, current, speed)[np.ix_(known, known)]
    expected = values[:, known] @ np.linalg.solve(whole, values[:, known].T)
    np.testing.assert_allclose(white @ white.T, expected, rtol=2e-3)
    logarithm = np.linalg.slogdet(whole)[1]
    assert 2.0 * Whitening(drift).charge == pytest.approx(float(logarithm), rel=2e-3)
    square = float(expected[0, 0]) / known.sum()
    likelihood = -0.5 * (known.sum() * np.log(square) + logarithm)
    assert log_likelihood([drift], [values[0]]) == pytest.approx(float(likelihood), rel=2e-3)


def test_what_nobody_measured_is_doubted_more_from_row_to_row() -> None:
    present = np.ones(ROWS)
    present[100:200] = 0.0
    drift = Drift(present=present, interval=np.full(ROWS, 0.2), wander=WANDER)
    doubt = Whitening(drift).doubt
    assert (np.diff(doubt[101:200]) > 0.0).all()
    assert doubt[199] == pytest.approx(1.0 + WANDER[0], rel=1e-3)  # by then as unknown as at the start
    water = Whitening(replace(drift, wander=NOTHING, current=CURRENT)).doubt
    assert water[199] > 20.0  # a vehicle that was carried away is nowhere in particular


def simulated(wander: tuple[float, float], current: tuple[float, float], rng: np.random.Generator) -> Array:
    """A channel's residuals at 5 Hz, white noise of 1."""
    rows, h = 1500, 0.2

    def walk(variance: float, time: float) -> Array:
        a, values = np.exp(-h / time), np.sqrt(variance) * rng.standard_normal(rows)
        for k in range(1, rows):
            values[k] = a * values[k - 1] + np.sqrt(1.0 - a**2) * values[k]
        return values

    moved = np.concatenate([[0.0], np.cumsum(h * walk(*current))[:-1]])
    return np.asarray(rng.standard_normal(rows) + walk(*wander) + moved)


@pytest.mark.parametrize(
    ("wander", "current"),
    [(NOTHING, NOTHING), ((4.0, 2.0), NOTHING), (NOTHING, (9.0, 4.0)), ((9.0, 0.6), (4.0, 8.0))],
    ids=["white", "sensor", "water", "both"],
)
def test_levels_are_found(wander: tuple[float, float], current: tuple[float, float]) -> None:
    rng = np.random.default_rng(4)
    residuals = [simulated(wander, current, rng) for _ in range(2)]
    drifts = [Drift(present=np.ones(1500), interval=np.full(1500, 0.2)) for _ in residuals]
    found = likeliest_drift(drifts, residuals, OF_DEPTH)
    true = {SENSOR: wander, WATER: current}
    assert found.keys() == {kind for kind, (variance, _) in true.items() if variance > 0.0}
    for kind, (variance, time) in found.items():
        assert np.sqrt(variance) == pytest.approx(np.sqrt(true[kind][0]), rel=0.35)
        assert time == pytest.approx(true[kind][1], rel=0.6)
    assert WATER not in likeliest_drift(drifts, residuals, OF_PITCH)
