"""Writes dataflash records for tests, from the format's description alone."""

import struct

_CODES = {"Q": "Q", "f": "f", "B": "B", "H": "H", "I": "I", "c": "h", "n": "4s"}


class DataflashWriter:
    def __init__(self) -> None:
        self._formats: dict[str, tuple[int, str]] = {}

    def define(self, name: str, letters: str, columns: str) -> bytes:
        number = 1 + len(self._formats)
        body = "<" + "".join(_CODES[letter] for letter in letters)
        self._formats[name] = number, body
        length = 3 + struct.calcsize(body)
        fields = struct.pack("<BB4s16s64s", number, length, name.encode(), letters.encode(), columns.encode())
        return b"\xa3\x95\x80" + fields

    def record(self, name: str, *values: object) -> bytes:
        number, body = self._formats[name]
        return b"\xa3\x95" + bytes([number]) + struct.pack(body, *values)


ATT = ("ATT", "Qccc", "TimeUS,Roll,Pitch,Yaw")
BARO = ("BARO", "QBffIB", "TimeUS,I,Alt,Press,SMS,Health")
RCOU = ("RCOU", "QHHH", "TimeUS,C1,C2,C3")
CSRV = ("CSRV", "QBf", "TimeUS,Id,Pos")
