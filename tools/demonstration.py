"""The main job from end to end, as tools/demo runs it.

A simulated vehicle sends MAVLink over the loopback; `mils run` receives, identifies and journals; `mils
identify` then learns from the journal on the bench and writes the report.
"""

import argparse
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

EXAMPLE = Path(__file__).parent / "examples" / "demo.toml"


def main() -> int:
    """Runs the demonstration; the exit code is that of the first step that failed, else 0."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/demo")
    parser.add_argument("--out", type=Path, default=Path("out/demo"), help="where everything goes")
    parser.add_argument("--scenario", default="default", help="scenario of the simulated vehicle")
    parser.add_argument("--speed", type=float, default=10.0, help="simulated seconds a second (default: 10)")
    args = parser.parse_args()
    folder = args.out / time.strftime("%Y%m%d-%H%M%S")
    folder.mkdir(parents=True, exist_ok=True)
    journal = folder / "dive.jsonl"

    port = _free_port()
    print(
        f"1. A simulated dive at {args.speed:g} times real time, MAVLink over UDP port {port}; live:",
        flush=True,
    )
    live = subprocess.Popen(
        _mils("run", EXAMPLE, "--no-state", link=f"udp:127.0.0.1:{port}", journal=journal),
    )
    try:
        _wait_until_bound(port, live)
        vehicle = subprocess.run(
            _mils(
                "sitl",
                "--quiet",
                scenario=args.scenario,
                speed=args.speed,
                link=f"udpout:127.0.0.1:{port}",
                truth=folder / "truth.csv",
            ),
            check=False,
        )
    finally:
        time.sleep(0.5)
        live.send_signal(signal.SIGTERM)
        live.wait()
    if vehicle.returncode or live.returncode:
        return vehicle.returncode or live.returncode

    print("\n2. The same dive on the bench, from the journal:", flush=True)
    bench = subprocess.run(_mils("identify", journal, vehicle=EXAMPLE, out=folder), check=False)
    print(f"\nOpen {os.path.abspath(folder / 'report.html')}")
    return bench.returncode


def _mils(*words: object, **options: object) -> list[str]:
    """The command line of `mils`."""
    named = [text for name, value in options.items() for text in (f"--{name}", str(value))]
    return [sys.executable, "-m", "tools.cli", *map(str, words), *named]


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _wait_until_bound(port: int, live: "subprocess.Popen[bytes]") -> None:
    """Returns once `mils run` listens: the port can then be bound by nobody else."""
    deadline = time.monotonic() + 30.0
    while live.poll() is None and time.monotonic() < deadline:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                return
        time.sleep(0.05)


if __name__ == "__main__":
    sys.exit(main())
