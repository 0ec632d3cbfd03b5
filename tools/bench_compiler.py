"""`python -m tools.bench_compiler RECORDING`: how long a diagnosis takes with a C compiler, and without.

Whole commands, in pairs, one after the other; the command without one finds none on its PATH.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from host.compiled.machine_code import compiler


def main(arguments: list[str] | None = None) -> int:
    """Prints the seconds of each pair, their medians and the ratio."""
    parser = argparse.ArgumentParser(prog="python -m tools.bench_compiler", description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--jobs", type=int, default=1, help="cores")
    told = parser.parse_args(arguments)
    if told.pairs < 1:
        parser.error("--pairs must be 1 or more")
    if compiler() is None:
        print("bench_compiler: no C compiler (cc, gcc, clang) on the PATH", file=sys.stderr)
        return 2
    pairs = []
    for number in range(told.pairs):
        pairs.append([_seconds(told.recording, told.jobs, is_compiled) for is_compiled in (True, False)])
        print(f"pair {number + 1}: {pairs[-1][0]:.1f} s with a compiler, {pairs[-1][1]:.1f} s without")
    ratio = median(with_one / without for with_one, without in pairs)
    first, second = (median(seconds) for seconds in zip(*pairs, strict=True))
    print(f"medians: {first:.1f} s, {second:.1f} s; ratio {ratio:.2f}")
    return 0


def _seconds(recording: Path, jobs: int, is_compiled: bool) -> float:
    """Of one diagnosis; one that fails has said why and ends the bench."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    if not is_compiled:
        environment["PATH"] = ""
    with TemporaryDirectory() as out:
        command = [sys.executable, "-m", "tools.cli", "diagnose", str(recording), "--out", out]
        began = time.monotonic()
        done = subprocess.run(
            [*command, "--jobs", str(jobs), "--quiet"],
            env=environment,
            stdout=subprocess.DEVNULL,
            check=False,
        )
        if done.returncode not in (0, 1):
            raise SystemExit(done.returncode)
        return time.monotonic() - began


if __name__ == "__main__":
    sys.exit(main())
