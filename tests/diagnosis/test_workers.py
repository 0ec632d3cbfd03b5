"""Workers end with the command that they work for."""

import subprocess
import sys

KILLED = """
import multiprocessing, os, signal
from concurrent.futures import ProcessPoolExecutor
from host.diagnosis.workers import leave_with_parent

if __name__ == "__main__":
    pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), leave_with_parent)
    print("worker", pool.submit(len, "abc").result(), flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_worker_leaves_when_its_parent_was_killed() -> None:
    # The output ends only once the worker, which has inherited it, is gone, too.
    done = subprocess.run([sys.executable, "-c", KILLED], capture_output=True, timeout=60.0, check=False)
    assert done.stdout == b"worker 3\n"
    assert done.returncode < 0
