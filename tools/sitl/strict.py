"""Tables of a TOML file to frozen dataclasses, without tolerance for slips."""

import types
import typing
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any, Literal, TypeVar

from tools.sitl.errors import ScenarioError

T = TypeVar("T")
_LARGEST = 1e300  # also of integers, which have no end in TOML


def require(holds: bool, name: str, rule: str, got: object) -> None:
    """Raises ScenarioError unless `holds`."""
    if not holds:
        raise ScenarioError(f"{name} must {rule} (got {got!r})")


def build(cls: type[T], table: object, where: str = "") -> T:
    """An instance of the dataclass `cls` from a TOML table; `where` is the dotted name of the table.

    Raises ScenarioError on an unknown key (listing the known ones), a missing key, a wrong type, a number
    that is not finite, and on whatever the dataclass itself refuses.
    """
    if not isinstance(table, dict):
        raise ScenarioError(f"{where} must be a table (got {table!r})")
    known: dict[str, Field[Any]] = {field.name: field for field in fields(cls)}  # type: ignore[arg-type]
    unknown = sorted(set(table) - set(known))
    if unknown:
        raise ScenarioError(f"{_dotted(where, unknown[0])} is not known; known: {', '.join(known)}")
    types_of = typing.get_type_hints(cls)
    values = {name: _value(types_of[name], value, _dotted(where, name)) for name, value in table.items()}
    for name, field in known.items():
        if name not in values and field.default is MISSING and field.default_factory is MISSING:
            raise ScenarioError(f"{_dotted(where, name)} is required")
    try:
        return cls(**values)
    except ScenarioError as error:
        raise ScenarioError(_dotted(where, str(error))) from error


def _dotted(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name


def _value(kind: Any, value: object, where: str) -> object:
    if is_dataclass(kind):
        return build(typing.cast(type, kind), value, where)
    if typing.get_origin(kind) is Literal:
        choices = typing.get_args(kind)
        require(value in choices, where, f"be one of {', '.join(map(str, choices))}", value)
        return value
    if isinstance(kind, types.UnionType):  # X | None: TOML has no null, so only X can be written
        kind = next(option for option in typing.get_args(kind) if option is not type(None))
        return _value(kind, value, where)
    if typing.get_origin(kind) is tuple:
        require(isinstance(value, list), where, "be a list", value)
        item = typing.get_args(kind)[0]
        return tuple(
            _value(item, entry, f"{where}[{i}]") for i, entry in enumerate(typing.cast(list[object], value))
        )
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        require(abs(value) <= _LARGEST, where, "be finite", value)
        return float(value)
    require(type(value) is kind, where, f"be of type {kind.__name__}", value)
    return value
