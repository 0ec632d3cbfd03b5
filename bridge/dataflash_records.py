"""Walks ArduPilot's self-describing dataflash format: records of 0xA3 0x95, a type byte and packed fields.

The FMT records (type 128) name the length, the field letters and the columns of each other type. There is no
checksum: a record is believed when another one, or the end, follows it. So a lost or overwritten block costs
itself and the record before it, where pymavlink's reader stops at the first unknown type.
"""

from collections import Counter
from collections.abc import Iterator, Set
from struct import Struct
from typing import Any, NamedTuple

HEAD = b"\xa3\x95"
_FMT = 0x80
_FMT_BODY = Struct("<BB4s16s64s")  # type, length with header, name, letters, columns

# Letter of FMT to the struct code and the scale of the value.
_LETTERS: dict[str, tuple[str, float | None]] = {
    "a": ("64s", None),
    "b": ("b", None),
    "B": ("B", None),
    "M": ("B", None),
    "h": ("h", None),
    "H": ("H", None),
    "c": ("h", 1e-2),
    "C": ("H", 1e-2),
    "i": ("i", None),
    "I": ("I", None),
    "e": ("i", 1e-2),
    "E": ("I", 1e-2),
    "L": ("i", 1e-7),
    "f": ("f", None),
    "d": ("d", None),
    "g": ("e", None),
    "q": ("q", None),
    "Q": ("Q", None),
    "n": ("4s", None),
    "N": ("16s", None),
    "Z": ("64s", None),
}


class _Format(NamedTuple):
    name: str
    length: int
    body: Struct
    columns: list[str]
    scales: list[float | None]

    def read(self, data: bytes, at: int) -> dict[str, Any]:
        values = self.body.unpack_from(data, at + 3)
        return {
            column: value if scale is None else value * scale
            for column, value, scale in zip(self.columns, values, self.scales, strict=True)
        }


def walk_dataflash(
    data: bytes, wanted: Set[str], counts: Counter[str]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """(name, fields) of the records whose name is wanted; all intact ones are counted by name."""
    formats = {_FMT: _Format("FMT", 3 + _FMT_BODY.size, _FMT_BODY, [], [])}
    at = 0
    while (head := data.find(HEAD, at)) >= 0:
        if head > at:
            counts["refused.bytes"] += head - at
        at = head
        known = formats.get(data[at + 2]) if at + 2 < len(data) else None
        end = at + known.length if known else at
        if known is None or end > len(data):
            counts["refused.unknown_id" if known is None else "refused.unfinished"] += 1
            counts["refused.bytes"] += 1
            at += 1
            continue
        if end < len(data) - 1 and data[end : end + 2] != HEAD:
            counts["refused.record"] += 1
            counts["refused.bytes"] += 1
            at += 1
            continue
        counts[known.name] += 1
        if known.name == "FMT":
            _define(data, at, formats, counts)
        elif known.name in wanted:
            yield known.name, known.read(data, at)
        at = end
    if at < len(data):
        counts["refused.bytes"] += len(data) - at


def _define(data: bytes, at: int, formats: dict[int, _Format], counts: Counter[str]) -> None:
    number, length, name, letters, columns = _FMT_BODY.unpack_from(data, at + 3)
    codes = [_LETTERS.get(letter) for letter in _text(letters)]
    names = _text(columns).split(",") if _text(columns) else []
    if number == _FMT or None in codes or len(codes) != len(names):
        if number != _FMT:
            counts["refused.format"] += 1
        return
    body = Struct("<" + "".join(code[0] for code in codes if code))
    if body.size + 3 != length:
        counts["refused.format"] += 1
        return
    formats[number] = _Format(_text(name), length, body, names, [code[1] for code in codes if code])


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("ascii", errors="replace")
