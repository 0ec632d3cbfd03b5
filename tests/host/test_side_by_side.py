"""Work shared among threads is done once, in order, by the main thread alone where it has no cores."""

import threading

import numpy as np
import pytest

from host.compiled.side_by_side import on_cores, side_by_side


@pytest.mark.parametrize("cores", [1, 2, 3])
def test_results_come_in_order_and_each_once(cores: int) -> None:
    asked: list[int] = []

    def square(number: int) -> int:
        asked.append(number)
        return number**2

    with on_cores(cores):
        assert side_by_side(square, range(50)) == [number**2 for number in range(50)]
    assert sorted(asked) == list(range(50))


def test_two_threads_work_at_once_within_and_one_outside() -> None:
    both = threading.Barrier(2, timeout=10.0)

    def wait(_: int) -> int:
        both.wait()
        return threading.get_ident()

    with on_cores(2):
        assert len(set(side_by_side(wait, [0, 1]))) == 2
    assert set(side_by_side(lambda _: threading.get_ident(), [0, 1])) == {threading.get_ident()}


def test_work_within_work_is_done_where_it_is() -> None:
    with on_cores(2):
        found = side_by_side(lambda k: side_by_side(lambda j: (k, j), [0, 1]), [0, 1, 2])
    assert found == [[(k, 0), (k, 1)] for k in range(3)]


def test_work_within_work_does_not_wait_for_a_helper_that_is_busy() -> None:
    main, done = threading.current_thread(), threading.Event()

    def outer(_: int) -> list[int]:
        if threading.current_thread() is main:
            found = side_by_side(lambda k: k, [0, 1, 2])
            done.set()
            return found
        assert done.wait(10.0)  # it goes on only once the main thread has what is within
        return []

    with on_cores(2):
        assert [0, 1, 2] in side_by_side(outer, [0, 1])


def test_an_error_reaches_the_caller_and_numpy_is_told_the_same() -> None:
    with on_cores(2), np.errstate(divide="raise"), pytest.raises(FloatingPointError):
        side_by_side(lambda zero: np.ones(1) / zero, [np.zeros(1)] * 8)
    with on_cores(2), np.errstate(divide="ignore"):
        assert np.isinf(side_by_side(lambda zero: np.ones(1) / zero, [np.zeros(1)] * 8)).all()
