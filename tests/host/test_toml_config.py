"""Strict TOML: every rule broken once, and what is written reads back equal."""

import tomllib
from dataclasses import dataclass, field
from enum import StrEnum
from math import inf
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from host.errors import ConfigError
from host.toml_config import MAY_BE_INFINITE, build, read_toml, to_table, to_toml


class Mode(StrEnum):
    SLOW = "slow"
    FAST = "fast"


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    number: int
    scale: float = 1.0
    speed: float = field(default=1.0, metadata=MAY_BE_INFINITE)

    def __post_init__(self) -> None:
        if not 1 <= self.number <= 16:
            raise ValueError(f"number must be 1 to 16 (got {self.number})")


@dataclass(frozen=True, slots=True, kw_only=True)
class Inner:
    forgetting_time: float | None = 60.0
    channels: tuple[Channel, ...] = ()
    pair: tuple[int, float] = (1, 2.0)
    first: Channel | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Outer:
    name: str
    inner: Inner = Inner()
    mode: Mode = Mode.SLOW
    sign: Literal[1, -1] = 1
    word: Literal["a", "b"] = "a"
    count: int = 3
    on: bool = True
    folder: Path | None = None
    either: float | str = 1.0


def read(tmp_path: Path, text: str) -> Outer:
    path = tmp_path / "vehicle.toml"
    path.write_text(text)
    return read_toml(path, Outer)


def test_every_kind_of_field_is_read(tmp_path: Path) -> None:
    outer = read(
        tmp_path,
        """
        name = "x"
        mode = "fast"
        sign = -1
        word = "b"
        on = false
        folder = "dives"
        either = "text"
        [inner]
        forgetting_time = inf
        pair = [4, 5]
        first = { number = 2 }
        [[inner.channels]]
        number = 7
        scale = 2
        [[inner.channels]]
        number = 8
        """,
    )
    inner = Inner(
        forgetting_time=inf,
        pair=(4, 5.0),
        first=Channel(number=2),
        channels=(Channel(number=7, scale=2.0), Channel(number=8)),
    )
    assert outer == Outer(
        name="x",
        mode=Mode.FAST,
        sign=-1,
        word="b",
        on=False,
        folder=tmp_path / "dives",
        either="text",
        inner=inner,
    )
    assert isinstance(outer.inner.channels[0].scale, float)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "vehicle.toml: name is missing"),
        ("name = 1", "vehicle.toml: name must be a text (got 1)"),
        (
            'name = "x"\n[inner]\nforgeting_time = 1',
            "vehicle.toml: inner.forgeting_time is not a known key "
            "(known: forgetting_time, channels, pair, first); did you mean forgetting_time?",
        ),
        ('name = "x"\nzzz = 1', "zzz is not a known key"),
        ('name = "x"\ninner = 3', "inner must be a table (got 3)"),
        ('name = "x"\nmode = "fist"', "mode must be one of slow, fast (got 'fist'); did you mean fast?"),
        ('name = "x"\nsign = 2', "sign must be one of 1, -1 (got 2)"),
        ('name = "x"\nsign = true', "sign must be one of 1, -1 (got True)"),
        ('name = "x"\ncount = true', "count must be a whole number (got True)"),
        ('name = "x"\ncount = 1.0', "count must be a whole number (got 1.0)"),
        ('name = "x"\non = 1', "on must be true or false (got 1)"),
        ('name = "x"\nfolder = 1', "folder must be a path (got 1)"),
        ('name = "x"\neither = [1]', "either must be a number or a text (got [1])"),
        ('name = "x"\n[inner]\nforgetting_time = nan', "inner.forgetting_time must be a number (got nan"),
        ('name = "x"\n[inner]\nforgetting_time = true', "inner.forgetting_time must be a number (got True)"),
        ('name = "x"\n[inner]\nforgetting_time = "1"', "inner.forgetting_time must be a number (got '1')"),
        (f'name = "x"\n[inner]\nforgetting_time = 1{"0" * 400}', "inner.forgetting_time must be a number"),
        ('name = "x"\n[inner]\nchannels = 1', "inner.channels must be an array (got 1)"),
        ('name = "x"\n[inner]\npair = [1]', "inner.pair must have 2 entries (got 1)"),
        ('name = "x"\n[inner]\nchannels = [{}]', "inner.channels[0].number is missing"),
        (
            'name = "x"\n[inner]\nchannels = [{ number = 1 }, { number = 17 }]',
            "vehicle.toml: inner.channels[1].number must be 1 to 16 (got 17)",
        ),
        (
            'name = "x"\n[inner]\nfirst = { number = 1, scale = inf }',
            "vehicle.toml: inner.first.scale must be finite (got inf)",
        ),
        ("name = ", "vehicle.toml: is not valid TOML"),
        ("a = " + "[" * 5000, "vehicle.toml: is not valid TOML"),
    ],
)
def test_a_broken_rule_is_one_line_with_key_value_and_rule(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ConfigError) as error:
        read(tmp_path, text)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_unreadable_files_are_one_line(tmp_path: Path) -> None:
    binary = tmp_path / "binary.toml"
    binary.write_bytes(bytes(range(128, 256)))
    for path, cause in [
        (tmp_path / "none.toml", "No such file"),
        (tmp_path, "Is a directory"),
        (binary, "is not a text file"),
    ]:
        with pytest.raises(ConfigError, match=cause) as error:
            read_toml(path, Outer)
        assert "\n" not in str(error.value)


@given(
    name=st.text(st.characters(exclude_categories=["Cs"])),
    count=st.integers(-(2**60), 2**60),
    time=st.floats(allow_nan=False),
    numbers=st.lists(st.integers(1, 16)),
    first=st.none()
    | st.builds(
        Channel,
        number=st.integers(1, 16),
        scale=st.floats(allow_nan=False, allow_infinity=False),
        speed=st.just(inf),
    ),
)
def test_written_toml_reads_back_equal(
    name: str, count: int, time: float, numbers: list[int], first: Channel | None
) -> None:
    channels = tuple(Channel(number=number) for number in numbers)
    outer = Outer(name=name, count=count, inner=Inner(forgetting_time=time, channels=channels, first=first))
    table = tomllib.loads(to_toml(outer))
    assert build(Outer, table, file="x", folder=Path()) == outer
    assert build(Outer, to_table(outer), file="x", folder=Path()) == outer
