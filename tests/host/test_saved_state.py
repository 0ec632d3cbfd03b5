"""A saved state comes back whole and to its own vehicle only."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from host.errors import HostError
from host.live.state import fingerprint, load_state, save_state

BODY = {"theta": [0.1, -2.5e-17, 3.0], "rows": 7, "pitch": {"P": [[1.0, 0.0]]}}


def load(path: Path, vehicle: str = "lauv", configuration: str = "abc"):  # type: ignore[no-untyped-def]
    return load_state(path, vehicle=vehicle, configuration=configuration)


def save(path: Path) -> None:
    save_state(path, BODY, vehicle="lauv", configuration="abc")


def test_a_state_comes_back_bit_for_bit(tmp_path: Path) -> None:
    path = tmp_path / "new" / "lauv.state.json"
    save(path)
    save(path)
    reading = load(path)
    assert reading.body == BODY
    assert "state restored" in reading.note
    assert [file.name for file in path.parent.iterdir()] == ["lauv.state.json"]


def test_no_state_yet_is_said(tmp_path: Path) -> None:
    reading = load(tmp_path / "none.json")
    assert reading.body is None
    assert "starting fresh" in reading.note


@pytest.mark.parametrize("key", ["vehicle", "configuration"])
def test_a_state_of_another_vehicle_or_configuration_is_set_aside(tmp_path: Path, key: str) -> None:
    path = tmp_path / "state.json"
    save(path)
    original = path.read_bytes()
    reading = load(path, **{key: "other"})
    assert reading.body is None
    assert f"another {key}" in reading.note
    assert (tmp_path / "state.refused1.json").read_bytes() == original
    save(path)
    load(path, **{key: "other"})
    assert (tmp_path / "state.refused2.json").exists()


def test_another_schema_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "state.json"
    save(path)
    path.write_text(path.read_text().replace('"schema": 1', '"schema": 0'))
    assert "another schema" in load(path).note


@given(data=st.data())
def test_a_changed_byte_never_comes_back_as_another_state(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("state") / "state.json"
    save(path)
    content = bytearray(path.read_bytes())
    content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(len(content) - 3, len(content)))])
    reading = load(path)
    assert reading.body in (None, BODY)
    assert path.exists() == (reading.body == BODY)


def test_an_unreadable_place_is_said_and_cannot_be_saved_to(tmp_path: Path) -> None:
    assert "cannot be read" in load(tmp_path).note
    (tmp_path / "file").write_text("")
    with pytest.raises(HostError, match="state cannot be saved"):
        save(tmp_path / "file" / "state.json")


def test_a_failed_save_leaves_the_old_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "state.json"
    save(path)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("host.live.state.os.fsync", full)
    with pytest.raises(HostError, match="No space left"):
        save_state(path, {"theta": [0.0]}, vehicle="lauv", configuration="abc")
    assert load(path).body == BODY


def test_the_fingerprint_ignores_order_and_sees_values() -> None:
    assert fingerprint({"a": 1.0, "b": {"c": 2, "d": 3}}) == fingerprint({"b": {"d": 3, "c": 2}, "a": 1.0})
    assert fingerprint({"a": 1.0}) != fingerprint({"a": 1.0000001})
