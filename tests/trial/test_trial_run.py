"""The seal, and the running of the command."""

import sys
from pathlib import Path

import pytest
from hand_made import answer

from tools.trial.answers import SEAL, SEALED, BrokenSeal, open_answers, published, seal
from tools.trial.run import diagnose_all, read_result

STUB = """
import pathlib, sys
recording, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[3])
with (out / "calls").open("a") as calls:
    calls.write("x")
if recording.stem == "bad":
    sys.exit(2)
if recording.stem == "broken":
    raise ValueError
(out / "diagnosis.json").write_text('{"verdict": "unexplained"}')
sys.exit(1)
"""


def test_answers_open_under_their_hash(tmp_path: Path) -> None:
    digest = seal(tmp_path, 42, [answer(), answer("none", (), number=2)])
    assert published(tmp_path) == digest
    assert open_answers(tmp_path, digest) == (42, [answer(), answer("none", (), number=2)])
    assert seal(tmp_path, 42, [answer(), answer("none", (), number=2)]) == digest


def test_nothing_is_published_before_the_seal(tmp_path: Path) -> None:
    assert published(tmp_path) is None


def test_changed_answers_break_the_seal(tmp_path: Path) -> None:
    digest = seal(tmp_path, 42, [answer()])
    seal(tmp_path, 42, [answer(hidden=("net_buoyancy",))])
    (tmp_path / SEAL).write_text(f"{digest}  {SEALED}\n")
    with pytest.raises(BrokenSeal, match="published was"):
        open_answers(tmp_path, published(tmp_path) or "")


@pytest.fixture
def stub(tmp_path: Path) -> tuple[str, ...]:
    path = tmp_path / "stub.py"
    path.write_text(STUB)
    return sys.executable, str(path)


def test_answers_are_kept_and_failures_are_tried_again(tmp_path: Path, stub: tuple[str, ...]) -> None:
    recordings = [tmp_path / f"{name}.csv" for name in ("good", "bad", "broken")]
    done = []
    for _ in range(2):
        runs = diagnose_all(tmp_path, recordings, 2, lambda: done.append(1), stub)
    assert len(done) == 6
    assert runs["good"].has_answered
    assert runs["good"].seconds > 0.0
    assert runs["good"].memory_mb > 1.0
    assert not runs["bad"].has_answered
    for failed in ("bad", "broken"):
        assert (tmp_path / "diagnoses" / failed / "calls").read_text() == "xx"
    assert (tmp_path / "diagnoses" / "good" / "calls").read_text() == "x"
    assert read_result(tmp_path, "good", "diagnosis.json") == {"verdict": "unexplained"}
    assert read_result(tmp_path, "bad", "diagnosis.json") is None
