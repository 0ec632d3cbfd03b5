"""Workers end with the command that they work for."""

import subprocess
import sys

KILLED = """
import multiprocessing, os, signal
from host.diagnosis.workers import _leave_with_parent

if __name__ == "__main__":
    multiprocessing.get_context("spawn").Process(target=_leave_with_parent).start()
    print("started", flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_worker_leaves_when_its_parent_was_killed() -> None:
    # The output ends only once the worker, which has inherited it, is gone, too.
    done = subprocess.run([sys.executable, "-c", KILLED], capture_output=True, timeout=60.0, check=False)
    assert done.stdout == b"started\n"
    assert done.returncode < 0
