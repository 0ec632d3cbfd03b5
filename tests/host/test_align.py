"""Alignment: neutral on the grid, nothing invented off it, every refusal counted."""

from itertools import chain
from math import isnan, sin
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.measurement import Measurement, Quantity
from firmware_model.sample import Sample
from host.live.align import AlignConfig, Aligner

DEPTH, PITCH, RUDDER = Quantity.DEPTH, Quantity.PITCH, Quantity.RUDDER
STEP_US = 100_000


def at(quantity: Quantity, time_s: float, value: float, boot: int = 0) -> Measurement:
    return Measurement(quantity=quantity, value=value, t_us=round(time_s * 1e6), source="test", boot=boot)


def align(measurements: list[Measurement], config: AlignConfig | None = None) -> list[Sample]:
    aligner = Aligner(config or AlignConfig())
    samples = [sample for m in measurements for sample in aligner.push(m)]
    return samples + aligner.flush()


def on_grid(count: int, start_s: float = 12.3457, boot: int = 0) -> list[Measurement]:
    return [
        at(quantity, start_s + k * 0.1, sin(k * (i + 1) / 7.0), boot)
        for k in range(count)
        for i, quantity in enumerate(Quantity)
    ]


def test_measurements_on_the_grid_pass_bit_for_bit() -> None:
    measurements = on_grid(200)
    samples = align(measurements)
    assert len(samples) == 200
    for quantity in Quantity:
        sent = [m.value for m in measurements if m.quantity is quantity]
        assert [getattr(sample, quantity) for sample in samples] == sent
    assert [s.t_us for s in samples] == [12_345_700 + k * STEP_US for k in range(200)]


def test_a_sample_is_complete_as_soon_as_every_channel_has_passed_it() -> None:
    aligner = Aligner(AlignConfig())
    emitted = [len(aligner.push(m)) for m in on_grid(10)]
    # Until `latency` has passed no channel can be called absent; from then on only the rudder, the third one,
    # is waited for: it may still turn until the next instant.
    assert sum(emitted[:25]) == 0
    assert emitted[25:30] == [4, 0, 1, 0, 0]
    assert emitted[30:] == [0, 0, 1, 0, 0] * 4


def test_values_off_the_grid_are_on_the_line_between_their_neighbours() -> None:
    pitch = [at(PITCH, k * 0.1, float(k)) for k in range(5)]
    depth = [at(DEPTH, 0.05 + k * 0.1, 2.0 * k) for k in range(5)]
    samples = align(sorted(pitch + depth, key=lambda m: m.t_us))
    assert [s.pitch for s in samples] == [0, 1, 2, 3, 4]
    assert isnan(samples[0].depth)  # nothing before it: not extrapolated
    assert [s.depth for s in samples[1:]] == pytest.approx([1, 3, 5, 7])


def test_one_lost_measurement_is_bridged_and_two_are_a_gap() -> None:
    pitch = [at(PITCH, k * 0.1, float(k)) for k in range(12) if k not in (3, 7, 8)]
    depth = [at(DEPTH, k * 0.1, 0.0) for k in range(12)]
    values = [s.pitch for s in align(sorted(pitch + depth, key=lambda m: m.t_us))]
    assert values[3] == 3.0
    assert [k for k, value in enumerate(values) if isnan(value)] == [7, 8]


def test_the_rudder_is_held_and_then_unknown() -> None:
    pitch = [at(PITCH, k * 0.1, 0.0) for k in range(20)]
    rudder = [at(RUDDER, 0.25, 0.2)]
    values = [s.rudder for s in align(sorted(pitch + rudder, key=lambda m: m.t_us))]
    assert [k for k, value in enumerate(values) if value == 0.2] == list(range(3, 13))
    assert all(isnan(value) for k, value in enumerate(values) if not 3 <= k < 13)


def rudder_seen(rudder: list[Measurement], config: AlignConfig | None = None) -> list[float]:
    """The rudder of the samples at 0.0, 0.1, ... 6.0 s beside a pitch that is never late."""
    pitch = [at(PITCH, k * 0.1, 0.0) for k in range(61)]
    return [s.rudder for s in align(sorted(pitch + rudder, key=lambda m: m.t_us), config)]


def stepping(period: float, lost: tuple[int, ...] = ()) -> list[Measurement]:
    """A rudder that is sent every `period` s and is never twice the same."""
    count = round(6.0 / period) + 1
    return [at(RUDDER, k * period, float(k)) for k in range(count) if k not in lost]


def test_a_rudder_that_changed_while_messages_were_lost_is_unknown() -> None:
    values = rudder_seen(stepping(0.1, lost=(30, 40, 41)))
    assert [k for k, value in enumerate(values) if isnan(value)] == [30, 40, 41]
    assert values[29:32:2] == [29.0, 31.0]


def test_a_rudder_that_comes_back_the_same_was_held() -> None:
    measurements = [at(RUDDER, k * 0.1, 0.1 if k < 40 else 0.2) for k in range(61) if k not in (30, 31, 40)]
    values = rudder_seen(measurements)
    assert values[:40] == [0.1] * 40
    assert isnan(values[40])
    assert values[41:] == [0.2] * 20


@pytest.mark.parametrize("period", [0.02, 0.05, 0.1, 0.13, 0.25, 0.5, 0.8])
def test_a_rudder_of_any_rate_is_its_mean_over_each_step(period: float) -> None:
    values = rudder_seen(stepping(period))
    mean = [np.mean(np.floor((0.1 * k + np.arange(0.0005, 0.1, 0.001)) / period)) for k in range(50)]
    assert values[:50] == pytest.approx(mean, abs=0.011)


def test_a_rudder_that_lost_a_message_between_two_samples_holds_until_that_was_due() -> None:
    off_grid = [at(RUDDER, 0.05 + k * 0.1, float(k)) for k in range(60) if k != 30]
    values = rudder_seen(off_grid)
    # Known until 3.05 s, when the lost one was due, and again from 3.15 s on.
    assert [k for k, value in enumerate(values) if isnan(value)] == [0, 30, 31]
    assert (values[29], values[32]) == (28.5, 31.5)


def test_a_rudder_with_jitter_loses_nothing() -> None:
    random = Random(1)
    values = rudder_seen([at(RUDDER, k * 0.1 + random.uniform(-0.02, 0.02), float(k)) for k in range(1, 61)])
    assert not any(isnan(value) for value in values[2:])


def test_the_usual_interval_is_found_although_most_messages_are_lost() -> None:
    random = Random(2)
    lost = tuple(k for k in range(1, 121) if random.random() < 0.6)
    values = rudder_seen(stepping(0.05, lost))
    # Two messages fall into each step: it is known if both came.
    assert [k for k in range(20, 60) if not isnan(values[k])] == [
        k for k in range(20, 60) if not {2 * k, 2 * k + 1} & set(lost)
    ]


def test_a_rudder_sent_on_change_is_held_through_the_silence() -> None:
    turns = [at(RUDDER, time, time) for time in (0.0, 0.1, 0.2, 0.3, 0.4, 2.0, 2.1, 5.0)]
    held = rudder_seen(turns, AlignConfig(rudder_on_change=True, rudder_hold=10.0))
    assert held == [max(m.value for m in turns if m.t_us <= k * STEP_US) for k in range(61)]
    assert isnan(rudder_seen(turns)[10])


def test_a_silent_channel_delays_by_the_latency_and_no_more() -> None:
    aligner = Aligner(AlignConfig(latency=0.5))
    out: list[Sample] = []
    for k in range(100):
        out += aligner.push(at(PITCH, k * 0.1, 1.0))
        if k >= 5:
            assert out[-1].t_us == (k - 5) * STEP_US
    assert all(isnan(s.depth) and isnan(s.rudder) for s in out)


def test_a_late_measurement_is_counted_and_serves_the_next_instant() -> None:
    aligner = Aligner(AlignConfig(latency=0.3, max_gap=0.3))
    for k in range(10):
        aligner.push(at(PITCH, k * 0.1, 1.0))
    assert aligner.push(at(DEPTH, 0.55, 4.0)) == []
    assert aligner.counts["late"] == 1
    aligner.push(at(DEPTH, 0.75, 5.0))
    assert aligner.flush()[0].depth == pytest.approx(4.75)


def test_a_restart_splits_and_joins_nothing() -> None:
    aligner = Aligner(AlignConfig())
    first, second = on_grid(10, 100.0), on_grid(10, 3.0, boot=1)
    samples = [s for m in first for s in aligner.push(m)]
    assert aligner.segment == 0
    ended = aligner.push(second[0])
    assert aligner.segment == 1
    assert [s.t_us for s in samples + ended] == [100_000_000 + k * STEP_US for k in range(10)]
    assert aligner.push(at(PITCH, 101.0, 0.0, boot=0)) == []
    assert aligner.counts["refused.old_boot"] == 1
    rest = [s for m in second[1:] for s in aligner.push(m)] + aligner.flush()
    assert [s.t_us for s in rest] == [3_000_000 + k * STEP_US for k in range(10)]


def test_a_short_silence_keeps_the_grid_and_a_long_one_starts_it_anew() -> None:
    aligner = Aligner(AlignConfig(split_gap=5.0))
    out = [s for m in on_grid(10, 0.0) + on_grid(10, 4.93) for s in aligner.push(m)]
    assert aligner.segment == 0
    assert all(s.t_us % STEP_US == 0 for s in out)
    assert all(isnan(s.pitch) for s in out if 1_000_000 <= s.t_us < 4_900_000)
    out += [s for m in on_grid(10, 10.9) for s in aligner.push(m)]
    assert aligner.segment == 1
    assert out[-1].t_us == 11_700_000


def test_a_flush_ends_the_segment() -> None:
    aligner = Aligner(AlignConfig())
    for m in on_grid(3, 0.0):
        aligner.push(m)
    assert len(aligner.flush()) == 3
    assert aligner.flush() == []
    aligner.push(at(PITCH, 0.35, 0.0))
    assert aligner.segment == 1


def test_repeats_and_steps_back_are_refused_and_counted() -> None:
    aligner = Aligner(AlignConfig())
    for time in (0.0, 0.1, 0.1, 0.05, 0.2):
        aligner.push(at(PITCH, time, time))
    assert aligner.counts["refused.duplicate"] == 1
    assert aligner.counts["refused.backwards"] == 1
    assert [s.pitch for s in aligner.flush()] == [0.0, 0.1, 0.2]


def test_one_absurd_time_stamp_does_not_end_the_run() -> None:
    aligner = Aligner(AlignConfig())
    good = [at(PITCH, k * 0.1, 1.0) for k in range(100)]
    out = [s for m in [*good[:50], at(PITCH, 1e9, 1.0), *good[50:]] for s in aligner.push(m)]
    assert aligner.counts["clock_set_back"] == 1
    assert aligner.counts["refused.backwards"] == 20
    assert out[-1].t_us == round(9.9e6 - 0.5e6)


def test_memory_is_bounded() -> None:
    aligner = Aligner(AlignConfig())
    for k in range(20_000):
        for quantity in (PITCH, DEPTH):
            aligner.push(at(quantity, k * 0.001, 0.0))
    assert max(len(channel.times) for channel in aligner._channels.values()) < 1000


@pytest.mark.parametrize(
    ("keys", "rule"),
    [
        ({"step": 0.0}, "step must be"),
        ({"step": float("inf")}, "step must be"),
        ({"max_gap": 0.05}, "max_gap must be at least step"),
        ({"rudder_hold": 0.0}, "rudder_hold must be positive"),
        ({"latency": 0.1}, "latency must be at least max_gap"),
        ({"split_gap": 0.5}, "split_gap must be more than latency"),
    ],
)
def test_a_configuration_out_of_range_is_refused(keys: dict[str, float], rule: str) -> None:
    with pytest.raises(ValueError, match=rule):
        AlignConfig(**keys)


def test_every_default_follows_a_slow_step() -> None:
    config = AlignConfig(step=4.0)
    assert (config.max_gap_s, config.rudder_hold_s, config.latency_s, config.split_gap_s) == (10, 10, 10, 40)


@st.composite
def channel(draw: st.DrawFn, quantity: Quantity) -> list[Measurement]:
    """An irregular channel of about 2 s, from its first 0.1 s on, with gaps."""
    times = draw(st.lists(st.integers(0, 2_000_000), min_size=5, max_size=40, unique=True))
    values = draw(st.lists(st.floats(-10, 10), min_size=len(times) + 1, max_size=len(times) + 1))
    start = draw(st.integers(0, 100_000))
    # A first value within the start-up window makes the channel known.
    return [
        Measurement(quantity=quantity, value=value, t_us=t_us, source="test")
        for t_us, value in zip([start, *(start + 1 + t for t in sorted(times))], values, strict=True)
    ]


channels = st.tuples(channel(DEPTH), channel(PITCH), channel(RUDDER))


def same(a: list[Sample], b: list[Sample]) -> bool:
    return repr(a) == repr(b)  # NaN equals NaN here


@given(channels)
def test_nothing_is_invented_outside_the_neighbours(drawn: tuple[list[Measurement], ...]) -> None:
    config = AlignConfig()
    near_us = round(0.01 * config.step * 1e6)
    for sample in align(sorted(chain(*drawn), key=lambda m: m.t_us), config):
        for measurements in drawn[:2]:
            value = getattr(sample, measurements[0].quantity)
            before = [m for m in measurements if m.t_us <= sample.t_us]
            after = [m for m in measurements if m.t_us > sample.t_us]
            touching = [m.value for m in measurements if abs(m.t_us - sample.t_us) <= near_us]
            is_bridged = before and after and after[0].t_us - before[-1].t_us <= config.max_gap_s * 1e6
            assert isnan(value) == (not touching and not is_bridged)
            if touching:
                assert value in touching
            elif is_bridged:
                low, high = sorted([before[-1].value, after[0].value])
                assert low <= value <= high


@settings(max_examples=50)
@given(channels, st.randoms(use_true_random=False))
def test_the_interleaving_of_channels_does_not_matter(
    drawn: tuple[list[Measurement], ...], random: Random
) -> None:
    config = AlignConfig()
    in_order = sorted(chain(*drawn), key=lambda m: m.t_us)
    skew_us = (config.latency_s - config.max_gap_s) * 1e6 - 1
    # Each channel lags by an amount of its own: order within it is kept.
    lag = {quantity: random.uniform(0, skew_us) for quantity in Quantity}
    shuffled = sorted(in_order, key=lambda m: m.t_us + lag[m.quantity])
    assert same(align(shuffled, config), align(in_order, config))


@given(st.lists(st.tuples(st.sampled_from(Quantity), st.floats(0, 20), st.integers(0, 1))))
def test_any_order_of_measurements_gives_whole_steps_and_accounts_for_each(
    drawn: list[tuple[Quantity, float, int]],
) -> None:
    aligner = Aligner(AlignConfig())
    last: tuple[int, int] | None = None
    emitted = 0
    for quantity, time, boot in drawn:
        segment = aligner.segment
        for sample in aligner.push(at(quantity, time, time, boot)):
            if last is not None and last[0] == segment:
                assert sample.t_us == last[1] + STEP_US
            last = (segment, sample.t_us)
            emitted += 1
    emitted += len(aligner.flush())
    assert aligner.counts["samples"] == emitted
