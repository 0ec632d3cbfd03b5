import shutil
from functools import partial
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from exact_dive import TABLE_1, Dive, fly

from host.catalogue import BY_NAME
from host.compiled import library_shelf, machine_code, over_rows
from host.compiled.row_loop import Loop, as_loop
from host.dynamics.equations import Structure
from host.dynamics.propagate import free_run, inputs_of
from host.likelihood.kalman import kalman_pass
from host.recordings.recording import Array

needs_compiler = pytest.mark.skipif(machine_code.compiler() is None, reason="no C compiler here")
NOISE = np.array([3e-6, 1e-4, 0.02, 0.05])


def with_a_compiler(found: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine_code, "compiler", lambda: found)


def passes() -> list[Array]:
    """What a filter and a free run with everything that bends make of 600 rows."""
    bent = [BY_NAME[name] for name in ("rudder_stall", "actuator_backlash", "large_angle_restoring")]
    own = [parameter for effect in bent for parameter in effect.parameters]
    recording, states = fly(Dive(duration=60.0, missing=0.2))
    inputs = inputs_of(recording, Structure(tuple(bent)))
    middle = [0.5 * (each.lower + each.upper) for each in own]
    parameters = np.array([*TABLE_1.values(), 0.0, 0.0, *middle])
    run = kalman_pass(parameters, np.append(states[:, 0], 0.0), NOISE, inputs)
    found = [
        run.error,
        run.variance,
        run.gains,
        free_run(parameters, np.append(states[:, 0], 0.0), inputs).states,
    ]
    assert all(np.isfinite(one).all() for one in found)
    return found


@pytest.fixture(autouse=True)
def shelf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty one."""
    found = tmp_path / "shelf"
    found.mkdir()
    monkeypatch.setattr(library_shelf, "folder", lambda: found)
    return found


@needs_compiler
def test_compiled_runs_have_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    over_rows._carried_on.cache_clear()
    monkeypatch.setattr(over_rows, "FEW_ROWS", np.inf)
    interpreted = passes()
    over_rows._carried_on.cache_clear()
    monkeypatch.setattr(over_rows, "FEW_ROWS", 0.0)
    monkeypatch.setattr(over_rows, "FEW_INSTRUCTIONS", 1.0)
    compiled: list[str] = []

    def watched(step: ca.Function, is_kept: bool = False) -> Loop | None:
        compiled.extend([step.name()] * (not is_kept))
        return as_loop(step, is_kept)

    monkeypatch.setattr(over_rows, "as_loop", watched)
    for _ in range(2):
        for expected, found in zip(interpreted, passes(), strict=True):
            np.testing.assert_array_equal(found, expected)
    assert sorted(compiled) == ["free_run", "kalman"]
    over_rows._carried_on.cache_clear()


def times(factor: float) -> ca.Function:
    """A step that grows by a factor and what drives it; gives what it was, with the parameters."""
    x, driven, p = ca.SX.sym("x"), ca.SX.sym("driven"), ca.SX.sym("p", 2)
    return ca.Function("times", [x, driven, p], [factor * x + driven, ca.vertcat(x, ca.sin(p[0]) * p[1])])


def runs_three_rows(loop: Loop | None, factor: float) -> None:
    assert loop is not None
    found = loop(np.array([1.0]), np.array([[0.0], [0.5], [0.0]]), np.array([1.0, 2.0]))
    second = np.sin(1.0) * 2.0
    expected = [[1.0, second], [factor, second], [factor**2 + 0.5, second]]
    np.testing.assert_array_equal(found, expected)


def test_without_a_compiler_there_is_no_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    with_a_compiler(None, monkeypatch)
    assert as_loop(times(2.0)) is None


@pytest.mark.parametrize("name", ["false", "gone"])
def test_a_compiler_that_does_not_work_is_none(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with_a_compiler(shutil.which(name) or str(Path("/") / name), monkeypatch)
    assert as_loop(times(2.0)) is None


@pytest.mark.parametrize(
    ("names", "is_there"), [({}, False), ({"cc": "false"}, False), ({"clang": "cc"}, True)]
)
def test_a_compiler_counts_only_if_it_works(
    names: dict[str, str], is_there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, program in names.items():
        if (found := shutil.which(program)) is None:
            pytest.skip(f"no {program} here")
        (tmp_path / name).symlink_to(found)
    expected = str(tmp_path / next(iter(names))) if is_there else None
    monkeypatch.setattr(shutil, "which", partial(shutil.which, path=str(tmp_path)))
    assert machine_code.compiler.__wrapped__() == expected


@needs_compiler
def test_a_compiled_loop_outlives_its_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library_shelf, "folder", lambda: None)
    runs_three_rows(as_loop(times(2.0)), 2.0)


@needs_compiler
def test_what_was_compiled_once_is_not_compiled_again(shelf: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert as_loop(times(2.0), is_kept=True) is None
    assert as_loop(times(2.0)) is not None
    assert len([*shelf.iterdir()]) == 1
    monkeypatch.setattr(machine_code, "_made_by", lambda *_: pytest.fail("compiled again"))
    runs_three_rows(as_loop(times(2.0), is_kept=True), 2.0)
    assert as_loop(times(2.5), is_kept=True) is None


@needs_compiler
def test_a_library_that_is_damaged_is_compiled_anew(shelf: Path) -> None:
    as_loop(times(2.0))
    (place,) = shelf.iterdir()
    place.unlink()  # not written over: this process has loaded it
    place.write_bytes(b"half of it")
    assert as_loop(times(2.0), is_kept=True) is None
    assert not place.exists()
    runs_three_rows(as_loop(times(2.0)), 2.0)
