"""The vehicle's timeline through wraps, restarts, jitter and absurd stamps."""

from hypothesis import example, given
from hypothesis import strategies as st

from bridge.vehicle_clock import VehicleClock

S = 1_000_000


def running(until_s: float, *, delay_s: float = 0.02, start_s: float = 0.0) -> VehicleClock:
    step_s = 0.1
    clock = VehicleClock()
    for k in range(round((until_s - start_s) / step_s) + 1):
        boot_us = round((start_s + k * step_s) * S)
        assert clock.from_boot(boot_us, boot_us + round(delay_s * S)) == boot_us
    return clock


def test_servo_stamp_is_unwrapped_every_71_minutes() -> None:
    for start_s in (0.0, 2**32 / S - 1.0, 2 * 2**32 / S - 1.0):
        clock = running(start_s + 2.0, start_s=start_s)
        boot_us = round((start_s + 2.0) * S) + 5
        assert clock.from_wrapped_us(boot_us % 2**32) == boot_us


def test_servo_stamp_before_any_other_is_refused() -> None:
    assert VehicleClock().from_wrapped_us(123) is None


def test_servo_stamp_far_from_the_clock_is_refused() -> None:
    assert running(5.0).from_wrapped_us(60 * S) is None


def test_boot_milliseconds_wrap_after_49_days() -> None:
    clock = VehicleClock()
    last = (2**32 - 1) * 1000
    assert clock.from_boot(last, 0) == last
    assert clock.from_boot(99_000, 100_000) == 2**32 * 1000 + 99_000
    assert clock.boot == 0


def test_restart_raises_boot_and_the_timeline_goes_on_by_receive_time() -> None:
    clock = running(100.0)
    receive = 108 * S
    assert clock.from_boot(2 * S, receive) is None  # one step back is not believed yet
    t_us = clock.from_boot(2 * S + 100_000, receive + 100_000)
    assert clock.boot == 1
    assert t_us == 100 * S + (receive + 100_000 - (100 * S + 20_000))
    later = clock.from_boot(3 * S, receive + S)
    assert later == t_us + 900_000
    assert clock.boot == 1


def test_restart_with_an_absurd_receive_clock_moves_at_most_an_hour() -> None:
    for receive in (-(10**15), 0, 10**18):
        clock = running(100.0)
        clock.from_boot(2 * S, receive)
        t_us = clock.from_boot(2 * S + 100_000, receive)
        assert t_us is not None
        assert 100 * S < t_us <= 100 * S + 3600 * S


def test_late_message_keeps_its_time_without_a_restart() -> None:
    clock = running(10.0)
    assert clock.from_boot(9_700_000, 10_100_000) == 9_700_000
    assert clock.boot == 0


@given(absurd=st.integers(0, 2**32 - 1))
@example(absurd=101_201)  # near enough to be believed, far enough to make what follows look like a restart
@example(absurd=109_000)
def test_single_absurd_stamp_makes_no_time_and_moves_nothing(absurd: int) -> None:
    clock = running(100.0)
    t_us = clock.from_boot(absurd * 1000, 100 * S)
    assert t_us is None or abs(t_us - 100 * S) <= 10 * S
    following = clock.from_boot(100 * S + 200_000, 100 * S + 220_000)
    assert following == 100 * S + 200_000
    assert clock.boot == 0


def test_leap_ahead_is_believed_once_confirmed_and_is_no_restart() -> None:
    clock = running(100.0)
    assert clock.from_boot(500 * S, 500 * S) is None
    assert clock.from_boot(500 * S + 100_000, 500 * S) == 500 * S + 100_000
    assert clock.boot == 0


def test_message_without_stamp_is_placed_by_the_smallest_delay() -> None:
    clock = running(10.0, delay_s=0.02)
    clock.from_boot(10_100_000, 10_500_000)  # this one was held up 0.4 s
    placed = clock.from_receive(10_320_000)
    assert placed is not None
    assert abs(placed - 10_300_000) < 1000


def test_smallest_delay_follows_a_drifting_clock() -> None:
    clock = VehicleClock()
    for k in range(36_000):  # an hour at 10 Hz, the vehicle 100 ppm slow
        boot_us = 100_000 * k
        clock.from_boot(boot_us, round(boot_us * 1.0001))
    placed = clock.from_receive(round(boot_us * 1.0001))
    assert placed is not None
    assert abs(placed - boot_us) < 100_000


def test_message_without_stamp_is_refused_while_the_clock_is_unknown_or_silent() -> None:
    assert VehicleClock().from_receive(5 * S) is None
    assert running(10.0).from_receive(60 * S) is None


@given(st.lists(st.tuples(st.integers(0, 2**40), st.integers(-(2**62), 2**62)), max_size=60))
def test_timeline_of_a_restart_lies_after_everything_before(stamps: list[tuple[int, int]]) -> None:
    clock = VehicleClock()
    newest, boot = -1, 0
    for boot_us, receive_us in stamps:
        t_us = clock.from_boot(boot_us, receive_us)
        if t_us is None:
            continue
        if clock.boot != boot:
            assert t_us > newest
            boot = clock.boot
        newest = max(newest, t_us)
