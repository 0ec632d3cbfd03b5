"""TOML tables to frozen dataclasses and back: the dataclass is the schema, and nothing unknown passes."""

import dataclasses
import difflib
import functools
import json
import math
import tomllib
from collections.abc import Mapping
from enum import Enum, StrEnum
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from host.errors import ConfigError

T = TypeVar("T")

_SHARED = "shared"

_Fields = Mapping[str, "dataclasses.Field[Any]"]
_NAMES = {str: "a text", int: "a whole number", float: "a number", bool: "true or false", Path: "a path"}


def shared(**sources: str) -> dict[str, dict[str, str]]:
    """Metadata of a field that holds a dataclass: these keys of it are given by others of the same file.

    `field(metadata=shared(step="alignment.step"))` takes `step` from the dotted key beside the field.
    """
    return {_SHARED: sources}


MAY_BE_INFINITE: dict[str, bool] = {"infinite": True}
"""Metadata of a float field that takes inf. One of type `float | None` takes it anyway, as "no limit"."""


def read_toml(path: Path, kind: type[T]) -> T:
    """Builds `kind` from the file; paths in it are relative to the file's folder. Raises ConfigError."""
    try:
        table = tomllib.loads(path.read_bytes().decode())
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: is not a text file (byte {error.start} is not UTF-8)") from error
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigError(f"{path}: is not valid TOML ({str(error).splitlines()[0]})") from error
    return build(kind, table, file=path.name, folder=path.parent)


def build(kind: type[T], table: Mapping[str, Any], *, file: str, folder: Path) -> T:
    """Builds `kind` from a parsed table. `file` only names the origin in messages. Raises ConfigError."""
    try:
        built: T = _Builder(folder).dataclass(kind, table, "")
    except _Broken as broken:
        raise ConfigError(f"{file}: {broken}") from broken.__cause__
    return built


def to_table(config: object) -> dict[str, Any]:
    """The configuration with its defaults filled in, as `build` takes it; what is None is left out."""
    assert dataclasses.is_dataclass(config)
    table = {}
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if value is not None:
            table[field.name] = _plain(value)
        for key in field.metadata.get(_SHARED, ()):
            del table[field.name][key]
    return table


def to_toml(config: object) -> str:
    """The configuration with its defaults filled in, as TOML text that builds an equal one."""
    return "\n".join(_lines(to_table(config), "")) + "\n"


class _Broken(Exception):
    """A rule broken at a dotted key; the file's name is put before it by `build`."""


class _Builder:
    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def dataclass(self, kind: type, table: object, where: str) -> Any:
        if not isinstance(table, Mapping):
            raise _wrong_type(where, "a table", table)
        fields = {field.name: field for field in dataclasses.fields(kind) if field.init}
        for key in table:
            if key not in fields:
                raise _Broken(_unknown(_join(where, key), key, list(fields)))
        hints = get_type_hints(kind)
        values: dict[str, Any] = {}
        for name, field in sorted(fields.items(), key=lambda item: _SHARED in item[1].metadata):
            at = _join(where, name)
            if _SHARED in field.metadata:
                sources = field.metadata[_SHARED]
                given = self.shared(sources, table.get(name, {}), fields, values, at)
                try:
                    values[name] = self.value(hints[name], given, at)
                except _Broken as broken:
                    raise _Broken(_named_by_source(str(broken), at, where, sources)) from broken.__cause__
            elif name in table:
                takes_infinity = field.metadata.get("infinite", False)
                values[name] = self.value(hints[name], table[name], at, takes_infinity)
            elif _default(field) is dataclasses.MISSING:
                raise _Broken(f"{at} is missing")
        try:
            return kind(**values)
        except ValueError as error:
            # The message begins with the field's own name.
            raise _Broken(_join(where, str(error))) from error

    def shared(
        self, sources: Mapping[str, str], table: object, fields: _Fields, built: Mapping[str, Any], where: str
    ) -> dict[str, Any]:
        """The table of a field with the keys that others give."""
        if not isinstance(table, Mapping):
            raise _wrong_type(where, "a table", table)
        given = dict(table)
        for key, source in sources.items():
            if key in table:
                raise _Broken(f"{_join(where, key)} is given by {source}; leave it out here")
            first, *rest = source.split(".")
            given[key] = functools.reduce(getattr, rest, built.get(first, _default(fields[first])))
        return given

    def value(self, kind: Any, value: object, where: str, takes_infinity: bool = False) -> Any:
        origin, arguments = get_origin(kind), get_args(kind)
        if dataclasses.is_dataclass(kind):
            return self.dataclass(kind if isinstance(kind, type) else type(kind), value, where)
        if origin in (Union, UnionType):
            return self.union(arguments, value, where)
        if origin is Literal:
            return _choice(arguments, value, where)
        if isinstance(kind, type) and issubclass(kind, StrEnum):
            return kind(_choice(tuple(member.value for member in kind), value, where))
        if origin is tuple:
            return self.array(arguments, value, where)
        return self.scalar(kind, value, where, takes_infinity)

    def union(self, kinds: tuple[Any, ...], value: object, where: str) -> Any:
        """The first member that takes the value; with one member beside None, its own message."""
        kinds = tuple(kind for kind in kinds if kind is not NoneType)
        if len(kinds) == 1:
            return self.value(kinds[0], value, where, takes_infinity=True)
        for kind in kinds:
            try:
                return self.value(kind, value, where)
            except _Broken:
                continue
        raise _wrong_type(where, " or ".join(_NAMES.get(kind, str(kind)) for kind in kinds), value)

    def array(self, kinds: tuple[Any, ...], value: object, where: str) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple):
            raise _wrong_type(where, "an array", value)
        if len(kinds) == 2 and kinds[1] is Ellipsis:
            kinds = (kinds[0],) * len(value)
        if len(kinds) != len(value):
            raise _Broken(f"{where} must have {len(kinds)} entries (got {len(value)})")
        pairs = zip(kinds, value, strict=True)
        return tuple(self.value(kind, item, f"{where}[{i}]") for i, (kind, item) in enumerate(pairs))

    def scalar(self, kind: Any, value: object, where: str, takes_infinity: bool) -> Any:
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value) if abs(value) < 2**53 else math.nan
        if kind is float and value in ("inf", "-inf"):
            value = float(str(value))  # as `to_table` writes it, since JSON has no infinity
        if kind is Path and isinstance(value, str):
            return self.folder / value
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise _wrong_type(where, _NAMES[kind], value)
        if isinstance(value, float) and math.isnan(value):
            raise _Broken(f"{where} must be a number (got nan, or a whole number beyond 2^53)")
        if isinstance(value, float) and math.isinf(value) and not takes_infinity:
            raise _Broken(f"{where} must be finite (got {value})")
        return value


def _default(field: "dataclasses.Field[Any]") -> Any:
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


def _named_by_source(message: str, at: str, where: str, sources: Mapping[str, str]) -> str:
    """A rule broken by a shared key is the fault of the key that the user wrote."""
    for key, source in sources.items():
        if message.startswith(f"{_join(at, key)} "):
            return _join(where, source) + message.removeprefix(_join(at, key))
    return message


def _join(where: str, key: str) -> str:
    return f"{where}.{key}" if where else key


def _unknown(where: str, key: str, known: list[str]) -> str:
    near = difflib.get_close_matches(key, known, n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    return f"{where} is not a known key (known: {', '.join(known)}){hint}"


def _wrong_type(where: str, expected: str, value: object) -> _Broken:
    shown = repr(value) if len(repr(value)) <= 60 else f"{repr(value)[:57]}..."
    return _Broken(f"{where or 'the file'} must be {expected} (got {shown})")


def _choice(allowed: tuple[Any, ...], value: object, where: str) -> Any:
    # `True == 1` in Python: compare the types too.
    if not any(type(value) is type(choice) and value == choice for choice in allowed):
        near = difflib.get_close_matches(str(value), [str(choice) for choice in allowed], n=1)
        hint = f"; did you mean {near[0]}?" if near else ""
        choices = ", ".join(str(choice) for choice in allowed)
        raise _Broken(f"{where} must be one of {choices} (got {value!r}){hint}")
    return value


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        return to_table(value)
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and math.isinf(value):
        return str(value)
    return value


def _lines(table: dict[str, Any], where: str) -> list[str]:
    own = [f"{key} = {_inline(value)}" for key, value in table.items() if not isinstance(value, dict)]
    for key, value in table.items():
        if isinstance(value, dict):
            own += ["", f"[{_join(where, key)}]", *_lines(value, _join(where, key))]
    return own


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_inline(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_inline(item) for item in value) + "]"
    if isinstance(value, str):
        # JSON's escapes are TOML's; TOML also wants DEL escaped.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return json.dumps(value)
