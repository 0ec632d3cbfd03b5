"""The bench of the compiler: it times both ways, and says what is wrong in one line."""

import re
from pathlib import Path

import pytest

from host.compiled import machine_code
from tools import bench_compiler
from tools.bench_compiler import main

needs_compiler = pytest.mark.skipif(machine_code.compiler() is None, reason="no C compiler here")


@needs_compiler
def test_both_ways_are_timed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    seconds = iter([2.0, 4.0, 3.0, 5.0, 1.0, 4.0])
    asked: list[bool] = []

    def timed(recording: Path, jobs: int, is_compiled: bool) -> float:
        assert (recording, jobs) == (tmp_path, 2)
        asked.append(is_compiled)
        return next(seconds)

    monkeypatch.setattr(bench_compiler, "_seconds", timed)
    assert main([str(tmp_path), "--jobs", "2"]) == 0
    assert asked == [True, False] * 3
    assert re.search(r"medians: 2\.0 s, 4\.0 s; ratio 0\.50", capsys.readouterr().out)


@needs_compiler
def test_a_diagnosis_that_fails_ends_the_bench(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main([str(tmp_path / "gone.csv")])
    assert "gone.csv" in capfd.readouterr().err


def test_no_pair_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["dive.csv", "--pairs", "0"])
    assert "--pairs must be 1 or more" in capsys.readouterr().err


def test_without_a_compiler_there_is_nothing_to_compare(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench_compiler, "compiler", lambda: None)
    assert main(["dive.csv"]) == 2
    assert "no C compiler" in capsys.readouterr().err
