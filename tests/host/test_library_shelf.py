"""Where compiled libraries are kept, and where none are."""

import os
from pathlib import Path

import pytest

from host.compiled import library_shelf
from host.compiled.library_shelf import folder, keep, place_of


@pytest.fixture
def shelf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(library_shelf, "folder", lambda: tmp_path)
    return tmp_path


def test_the_folder_is_the_users_and_may_be_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MILS_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert folder.__wrapped__() == tmp_path / "auv-mils"
    assert (tmp_path / "auv-mils").stat().st_mode & 0o077 == 0
    monkeypatch.setenv("MILS_CACHE", str(tmp_path / "mine"))
    assert folder.__wrapped__() == tmp_path / "mine"


def test_nothing_is_kept_where_that_is_not_wanted_or_not_safe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MILS_CACHE", "")
    assert folder.__wrapped__() is None
    open_to_all = tmp_path / "open"
    open_to_all.mkdir()
    open_to_all.chmod(0o777)
    monkeypatch.setenv("MILS_CACHE", str(open_to_all))
    assert folder.__wrapped__() is None
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("MILS_CACHE", str(tmp_path / "file"))
    assert folder.__wrapped__() is None
    monkeypatch.setattr(library_shelf, "folder", lambda: None)
    assert place_of("/bin/sh", ("-O1",), "int a;") is None


def test_another_source_option_or_compiler_has_another_place(shelf: Path, tmp_path: Path) -> None:
    compiler = tmp_path / "cc"
    compiler.write_text("one")
    places = [
        place_of(str(compiler), ("-O1",), "int a;"),
        place_of(str(compiler), ("-O1",), "int b;"),
        place_of(str(compiler), ("-O3",), "int a;"),
        place_of("/bin/sh", ("-O1",), "int a;"),
    ]
    compiler.write_text("another")
    places.append(place_of(str(compiler), ("-O1",), "int a;"))
    assert len({*places}) == 5
    assert all(place is not None and place.parent == shelf for place in places)
    assert place_of(str(tmp_path / "gone"), (), "int a;") is None


def test_of_too_many_those_used_last_stay(shelf: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library_shelf, "MOST_KEPT", 5)
    monkeypatch.setattr(library_shelf, "FEWER", 3)
    library = shelf / "built"
    library.write_bytes(b"code")
    for k in range(6):
        keep(library, shelf / f"{k}.so")
        os.utime(shelf / f"{k}.so", (k, k))
    assert sorted(one.name for one in shelf.glob("*.so")) == ["3.so", "4.so", "5.so"]


def test_what_cannot_be_kept_is_no_error(shelf: Path) -> None:
    library = shelf / "built"
    library.write_bytes(b"code")
    keep(library, shelf / "gone" / "a.so")
    assert [one.name for one in shelf.iterdir()] == ["built"]
