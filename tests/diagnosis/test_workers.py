"""Workers do the same on one core as on several, and end with the command that they work for."""

import os
import subprocess
import sys

import pytest
from hidden_dive import hidden_dive

from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.sea_fits import with_sea
from host.diagnosis.fits.workers import FITTERS_KEPT, Workers, sharing

KILLED = """
import multiprocessing, os, signal
from concurrent.futures import ProcessPoolExecutor
from host.diagnosis.fits.workers import leave_with_parent

if __name__ == "__main__":
    pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), leave_with_parent)
    print("worker", pool.submit(len, "abc").result(), flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize("jobs", [1, 2])
def test_functions_of_a_fitter_are_called_in_order(jobs: int) -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    ended: list[int] = []
    with Workers(fitter, jobs) as workers:
        tasks = [(Fitter.reduced, (fitter.root, frozenset())), (with_sea, (fitter.base,))]
        calm, rough = workers.results(tasks, ended.append)
    assert not calm.names
    assert not calm.fit.has_process_noise
    assert rough.fit.has_process_noise
    assert rough.bic == pytest.approx(with_sea(fitter, fitter.base).bic, abs=1e-6)
    assert ended == [0, 1]


def _who(fitter: Fitter) -> tuple[int, int]:
    return os.getpid(), fitter.recordings[0].time.size


def _two_of(fitter: Fitter) -> list[tuple[int, int]]:
    with Workers(fitter, 2) as workers:
        found: list[tuple[int, int]] = workers.results([(_who, ())] * 8)
    return found


def test_workers_share_processes_which_keep_each_to_its_fitter() -> None:
    fitters = [Fitter([hidden_dive(duration=20.0 + 5.0 * k)]) for k in range(FITTERS_KEPT + 1)]
    with sharing(2):
        found = [_two_of(fitter) for fitter in (*fitters, fitters[0])]
    for fitter, answers in zip((*fitters, fitters[0]), found, strict=True):
        assert {rows for _, rows in answers} == {fitter.recordings[0].time.size}
    processes = {process for answers in found for process, _ in answers}
    assert len(processes) <= 2
    assert os.getpid() not in processes
    assert not {process for process, _ in _two_of(fitters[0])} & processes  # which have ended


def test_a_single_task_has_all_cores_here() -> None:
    with Workers(Fitter([hidden_dive(duration=20.0)]), 2) as workers:
        ((process, _),) = workers.results([(_who, ())])
    assert process == os.getpid()


def test_a_worker_leaves_when_its_parent_was_killed() -> None:
    # The output ends only once the worker, which has inherited it, is gone, too.
    done = subprocess.run([sys.executable, "-c", KILLED], capture_output=True, timeout=60.0, check=False)
    assert done.stdout == b"worker 3\n"
    assert done.returncode < 0
