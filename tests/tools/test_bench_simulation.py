"""The simulation bench: its simulators lack what it says, and it counts what was said of them."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tools.bench_simulation import Case, Said, main, told
from tools.trial.deck import Card
from tools.trial.draw import draw
from tools.trial.run import Run


def test_a_simulator_flies_what_was_flown_less_what_it_lacks() -> None:
    drawn = draw(1, 1, Card("one", ("munk_moment",)))
    floor = drawn.answer.floor
    whole, lacking = drawn.flight.simulated(()), drawn.flight.simulated(("munk_moment",))
    np.testing.assert_allclose(whole["pitch_rad"], floor.pitch_rad, atol=1e-6)
    np.testing.assert_allclose(whole["depth_m"], floor.depth_m, atol=1e-5)
    np.testing.assert_array_equal(whole["rudder_rad"], lacking["rudder_rad"])
    assert np.abs(whole["pitch_rad"] - lacking["pitch_rad"]).max() > 3.0 * floor.pitch_noise_rad


def said(*missing: str, twins: tuple[str, ...] = (), too_much: tuple[str, ...] = ()) -> Said:
    return Said(
        missing={name: frozenset(twins) for name in missing}, too_much=too_much, different=(), seconds=20.0
    )


def test_what_was_said_is_counted() -> None:
    cases = [
        Case(name="a", hidden="net_buoyancy", lacking=frozenset({"net_buoyancy", "munk_moment"})),
        Case(name="b", hidden="rudder_stall", lacking=frozenset({"rudder_stall"})),
        Case(name="c", hidden="net_buoyancy", lacking=frozenset()),
        Case(name="d", hidden="net_buoyancy", lacking=frozenset({"net_buoyancy"})),
    ]
    lines = told(
        cases,
        {
            "a": said("vertical_current", "trim_moment", twins=("net_buoyancy",), too_much=("actuator_lag",)),
            "b": said("actuator_delay"),
            "c": said(),
            "d": None,
        },
    )
    assert lines[0].startswith(
        "a 20 s: lacks munk_moment, net_buoyancy; said: lacks vertical_current, trim_m"
    )
    assert lines[0].endswith(", too much actuator_lag")
    assert lines[2] == "c 20 s: lacks nothing; said: alike"
    assert lines[3] == "d: no answer"
    assert [line.rsplit(": ", 1)[1] for line in lines[4:]] == ["1 of 2", "2 of 3", "2 of 3", "1 of 1"]


def test_recordings_and_simulations_are_written_and_the_answers_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stub(
        folder: Path,
        paths: list[Path],
        _: int,
        on_done: Callable[[], None],
        also: Callable[[Path], tuple[str, ...]],
    ) -> dict[str, Run]:
        (path,) = paths
        option, simulation = also(path)
        assert option == "--simulation"
        with path.open() as recorded, Path(simulation).open() as simulated:
            for one, other in zip(csv.DictReader(recorded), csv.DictReader(simulated), strict=True):
                assert one["time_s"] == other["time_s"]
        out = folder / "diagnoses" / path.stem
        out.mkdir(parents=True)
        effect = {"name": "actuator_lag", "indistinguishable_from": ["actuator_delay"]}
        lag = {"name": "actuator_lag", "status": "missing"}
        base = [{"name": "a1", "is_different": True}, {"name": "a2", "is_different": False}]
        against = {"effects": [lag], "parameters": base}
        (out / "diagnosis.json").write_text(json.dumps({"effects": [effect], "simulation": against}))
        on_done()
        return {path.stem: Run(seconds=1.0, memory_mb=1.0, exit_code=0, said="")}

    monkeypatch.setattr("tools.bench_simulation.diagnose_all", stub)
    assert main(["--count", "1", "--seed", "3", "--out", str(tmp_path)]) == 0
    captured = capsys.readouterr()
    assert "said: lacks actuator_lag, differs in a1\n" in captured.out
    assert captured.err == "drawn 1 of 1\ndiagnosed 1 of 1\n"
    assert main(["--out", str(tmp_path)]) == 2  # would keep the answers to other recordings
    assert capsys.readouterr().err == f"{tmp_path} is not empty: give another --out\n"
    assert main(["--count", "0"]) == 2
