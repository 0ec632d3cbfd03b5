"""Without the bench extra the live commands work and the others say what to install."""

import subprocess
import sys
from pathlib import Path

import pytest

from tools.bench import BENCH_MODULES

ROOT = Path(__file__).parents[2]


def mils(*words: object) -> subprocess.CompletedProcess[str]:
    """The command in an interpreter that cannot find the bench extra."""
    hide = f"import sys; sys.modules.update(dict.fromkeys({BENCH_MODULES!r}))"
    call = f"from tools.cli import main; sys.exit(main({[str(word) for word in words]!r}))"
    return subprocess.run(
        [sys.executable, "-c", f"{hide}; {call}"], cwd=ROOT, capture_output=True, text=True, timeout=60
    )


@pytest.mark.parametrize(
    "words",
    [
        ("identify", "dive.csv"),
        ("simulate", "model.json", "dive.csv", "--out", "sim.csv"),
        ("predict", "model.json", "dive.csv"),
    ],
)
def test_a_bench_command_says_what_to_install(words: tuple[str, ...]) -> None:
    done = mils(*words)
    assert done.returncode == 2
    assert done.stderr.startswith("mils: this command needs scipy, casadi")
    assert "pip install '.[bench]'" in done.stderr
    assert done.stderr.count("\n") == 1


def test_the_live_commands_need_nothing_of_it(tmp_path: Path) -> None:
    rows = tmp_path / "dive.csv"
    made = mils("sitl", "--link", "none", "--record", rows, "--duration", 20, "--quiet")
    assert (made.returncode, made.stderr) == (0, "")
    sent = mils("replay", rows, "--link", "udpout:127.0.0.1:9", "--speed", "inf", "--quiet")
    assert (sent.returncode, sent.stderr) == (0, "")
    vehicle = ROOT / "tools" / "examples" / "demo.toml"
    journal = tmp_path / "journal.jsonl"
    live = mils(
        "run", vehicle, "--link", "udp:127.0.0.1:0", "--duration", 0.2, "--journal", journal, "--no-state"
    )
    assert live.returncode == 1
    assert "nothing usable came" in live.stderr
    checked = mils("doctor")
    assert checked.returncode == 0
    assert "missing casadi" in checked.stdout
