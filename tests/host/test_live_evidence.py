"""What a filter did not foresee: marks are the difference that a change makes, and what is made white is."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_model.sample import Sample
from host.live.evidence import Lacking, evidence_of
from host.live.innovations import MARKS, NAMES, SLOWING, SPEED_LAG, Innovations
from host.live.reference import Array, Reference
from host.live.whitening import LEAST, ORDER, Whitening, whitened

H = 0.1
VEHICLE = Reference(a1=-0.63, a2=-3.39, a3=-8.2, b1=0.41, b2=-3.94, u0=2.5, c_wq=0.3)
NOISE = np.array([0.003, 0.02])
NOTHING = Lacking(np.zeros(len(MARKS)), np.zeros((len(MARKS), len(MARKS))))


def dive(vehicle: Reference, seconds: float, *, heave: float = 0.0, datum: float = 0.0, at: float = 0.0,
         noise: float = 0.0, missing: bool = False, seed: int = 1) -> Iterator[Sample]:  # fmt: skip
    """The model itself under random steps of its plane, changed from `at` s on."""
    rng = np.random.default_rng(seed)
    move, push = vehicle.discrete(H)
    state, delta, until = np.array([0.0, 0.0, 0.0, 10.0]), 0.0, 0
    for k in range(round(seconds / H)):
        if k >= until:
            until, delta = k + int(rng.integers(10, 60)), float(rng.uniform(-0.2, 0.2))
        changed = k * H >= at
        seen = state[[2, 3]] + noise * NOISE * rng.normal(size=2) + (datum * changed, 0.0)
        is_gone = missing and k % 37 in (5, 6, 7, 20)
        yield Sample(t_us=k * 100_000, pitch=seen[0], depth=math.nan if is_gone else seen[1], rudder=delta)
        state = move @ state + push @ (vehicle.b1 * delta + heave * changed, vehicle.b2 * delta, 0.0)


def slowed(vehicle: Reference, seconds: float, by_plane: float, by_pitch: float) -> Iterator[Sample]:
    """The same dive at a speed that lags behind, as drag and weight have it."""
    state, slower = np.array([0.0, 0.0, 0.0, 10.0]), np.zeros(2)
    for sample in dive(vehicle, seconds):
        yield replace(sample, pitch=state[2], depth=state[3])
        ratio = 1.0 + slower @ (by_plane, by_pitch) / vehicle.u0
        now = {name: ratio * getattr(vehicle, name) for name in ("a1", "a2", "c_wq", "u0")}
        move, push = replace(vehicle, **now).discrete(H)
        by_flow = ratio**2 * sample.rudder
        drives = np.array([sample.rudder**2, state[2]])
        state = move @ state + push @ np.array([vehicle.b1 * by_flow, vehicle.b2 * by_flow, 0.0])
        slower = slower + H / SPEED_LAG * (drives - slower)


def followed(samples: Iterator[Sample], reference: Reference = VEHICLE) -> Innovations:
    innovations = Innovations(H, 5, 40, NOISE)
    innovations.follow(reference)
    for sample in samples:
        innovations.push(sample)
    return innovations


def series(innovations: Innovations) -> Array:
    return innovations.means[-20:]


@pytest.mark.parametrize("missing", [False, True])
@pytest.mark.parametrize(
    ("name", "size", "changed"),
    [
        ("heave_force", 0.05, {"heave": 0.05}),
        ("pitch_datum", 0.005, {"datum": 0.005}),
    ],
)
def test_a_mark_is_what_a_change_adds(
    name: str, size: float, changed: dict[str, float], missing: bool
) -> None:
    # 20 blocks of 5 samples are the last 10 s; the samples come one later than they are filtered.
    without = followed(dive(VEHICLE, 40.1, missing=missing))
    with_it = followed(dive(VEHICLE, 40.1, missing=missing, at=30.0, **changed))
    found = series(with_it) - series(without)
    foreseen = size * without.marks([20])[:, :, 0, NAMES.index(name)]
    assert np.abs(foreseen).max() > 0.05
    assert found == pytest.approx(foreseen, abs=0.02 * np.abs(foreseen).max())


@pytest.mark.parametrize(
    ("name", "coefficient"),
    [
        ("heave_damping", "a1"),
        ("pitch_damping", "a2"),
        ("pitch_restoring", "a3"),
        ("heave_by_turning", "c_wq"),
        ("forward_speed", "u0"),
    ],
)
def test_a_mark_is_what_another_coefficient_adds(name: str, coefficient: str) -> None:
    """To first order: the filter's own estimate stands for the motion."""
    small = 1e-3 * getattr(VEHICLE, coefficient)
    other = replace(VEHICLE, **{coefficient: getattr(VEHICLE, coefficient) + small})
    innovations = followed(dive(other, 40.1))
    found, foreseen = series(innovations), small * innovations.marks([40])[-20:, :, 0, MARKS.index(name)]
    assert np.linalg.norm(found - foreseen) < 0.15 * np.linalg.norm(found)


@pytest.mark.parametrize(("name", "size"), [("speed_by_plane", -2.0), ("speed_by_pitch", -0.5)])
def test_a_mark_is_what_a_falling_speed_adds(name: str, size: float) -> None:
    by_plane, by_pitch = (size * (each == name) for each in SLOWING)
    innovations = followed(slowed(VEHICLE, 40.1, by_plane, by_pitch))
    found, foreseen = series(innovations), size * innovations.marks([40])[-20:, :, 0, MARKS.index(name)]
    assert np.linalg.norm(found - foreseen) < 0.15 * np.linalg.norm(found)


def test_a_later_change_leaves_the_end_of_the_mark_of_its_own() -> None:
    innovations = followed(dive(VEHICLE, 40.1, missing=True))
    both, later = innovations.marks([20, 8]), innovations.marks([8])
    assert both[12:, :, 1] == pytest.approx(later[:, :, 0])
    assert not both[:12, :, 1].any()


def test_another_reference_sees_the_same_past() -> None:
    other = replace(VEHICLE, b2=-3.0)
    turned = followed(dive(VEHICLE, 30.0), other)
    turned.follow(VEHICLE)
    # What is remembered begins at rest: only its first blocks differ.
    assert series(turned) == pytest.approx(series(followed(dive(VEHICLE, 30.0))), abs=1e-6)


def test_a_spike_and_a_value_far_off_are_not_taken() -> None:
    def spoilt() -> Iterator[Sample]:
        for k, sample in enumerate(dive(VEHICLE, 40.1, noise=1.0)):
            yield replace(sample, depth=sample.depth + 0.8) if k in (310, 350) else sample

    clean, hurt = followed(dive(VEHICLE, 40.1, noise=1.0)), followed(spoilt())
    assert np.abs(series(hurt) - series(clean)).max() < 1.5


def test_what_stays_far_off_is_believed_at_last() -> None:
    innovations = followed(dive(VEHICLE, 40.0, datum=0.5, at=35.0))
    assert np.abs(innovations.means[-8:, 0]).max() > 5.0
    assert np.abs(innovations.means[-1, 0]) < 3.0


def test_a_plane_that_is_not_heard_makes_the_filter_doubt() -> None:
    def unheard() -> Iterator[Sample]:
        for k, sample in enumerate(dive(VEHICLE, 40.1)):
            yield replace(sample, rudder=math.nan) if 310 <= k < 330 else sample

    assert np.abs(series(followed(unheard()))).max() < 4.0


def test_nothing_is_joined_across_a_gap() -> None:
    innovations = followed(dive(VEHICLE, 30.0))
    assert len(innovations.blocks) == 40
    innovations.push(Sample(t_us=90_000_000, depth=1.0, pitch=0.0, rudder=0.0))
    assert len(innovations.blocks) == 0


def coloured(blocks: int, seed: int = 2) -> Array:
    """Innovations that swing as waves do, in both channels."""
    rng = np.random.default_rng(seed)
    out = np.zeros((blocks, 2))
    for k in range(2, blocks):
        out[k] = 1.6 * out[k - 1] - 0.9 * out[k - 2] + rng.normal(size=2) @ [[1.0, 0.5], [0.0, 0.4]]
    return out


def taught(rows: Array) -> Whitening:
    whitening = Whitening(0, 100_000)
    for k in range(len(rows)):
        whitening.take(rows[: k + 1])
    return whitening


def test_waves_are_made_white() -> None:
    rows = coloured(3000)
    fresh = coloured(3000, seed=3)
    assert abs(np.corrcoef(fresh[1:, 0], fresh[:-1, 0])[0, 1]) > 0.8
    white = whitened(fresh, *taught(rows).filter())[ORDER:]
    assert np.cov(white.T) == pytest.approx(np.eye(2), abs=0.1)
    for lag in range(1, 6):
        assert np.abs(white[lag:].T @ white[:-lag] / len(white)).max() < 0.12


def test_it_learns_late_and_not_from_what_is_far_off() -> None:
    rows = coloured(LEAST + ORDER + 50)
    late = Whitening(50, 1000)
    for k in range(len(rows) - 1):
        late.take(rows[: k + 1])
    assert late.has_begun
    assert not late.is_known
    late.take(rows)
    assert late.is_known
    before = late.filter()[0]
    wild = np.concatenate([rows, np.full((60, 2), 1e3)])
    for k in range(len(rows), len(wild)):
        late.take(wild[: k + 1])
    assert np.abs(late.filter()[0]).max() < 3.0 * np.abs(before).max()


def test_a_channel_that_is_never_measured_does_no_harm() -> None:
    rows = coloured(400) * (1.0, 0.0)
    assert np.isfinite(whitened(rows, *taught(rows).filter())).all()


@settings(max_examples=15, deadline=None)
@given(size=st.floats(-0.02, 0.02), seed=st.integers(0, 1000))
def test_a_ratio_is_the_size_of_the_change_times_its_leverage(size: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    whitening = taught(0.3 * rng.normal(size=(400, 2)))
    innovations = followed(dive(VEHICLE, 40.1, at=32.5, heave=size, seed=seed))
    found = evidence_of(innovations, whitening, [20, 15], NOTHING)
    k = NAMES.index("heave_force")
    assert found.ratios[1, k] / found.leverage[1, k] == pytest.approx(size, abs=2e-5, rel=0.02)


def test_what_the_reference_lacked_all_along_is_no_evidence() -> None:
    whitening = taught(0.3 * np.random.default_rng(5).normal(size=(400, 2)))
    innovations = followed(dive(VEHICLE, 40.1, heave=0.01))
    sizes = np.zeros(len(MARKS))
    bare = evidence_of(innovations, whitening, [20], NOTHING)
    k = NAMES.index("heave_force")
    sizes[k] = bare.products[k] / bare.gram[k, k]
    known = evidence_of(innovations, whitening, [20], Lacking(sizes, NOTHING.covariance))
    assert abs(known.ratios[0, k]) < 1e-6 * abs(bare.ratios[0, k])
    unsure = evidence_of(innovations, whitening, [20], Lacking(NOTHING.sizes, np.eye(len(MARKS))))
    assert abs(unsure.ratios[0, k]) < 0.2 * abs(bare.ratios[0, k])


def test_noise_is_not_taken_for_spikes() -> None:
    """A sensor ten times as noisy as was thought: once a reference is followed its noise is known."""
    innovations = Innovations(H, 5, 40, NOISE)
    for k, sample in enumerate(dive(VEHICLE, 60.1, noise=10.0)):
        innovations.push(sample)
        if k == 300:
            innovations.follow(VEHICLE)
    assert (innovations.means[-20:] != 0.0).all()
    assert np.abs(innovations.means[-20:]).max() < 3.0
