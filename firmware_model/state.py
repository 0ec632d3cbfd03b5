"""Checks shared by constructors and by saved states: the message holds name, rule and value."""

import sys
from collections.abc import Mapping
from typing import Any


def require(condition: bool, rule: str, value: object) -> None:
    """Raises ValueError("<rule> (got <value>)") unless the condition holds."""
    if not condition:
        raise ValueError(f"{rule} (got {value})")


def count_of(state: Mapping[str, Any], key: str) -> int:
    """The count (an int, 0 or more) under `key`. Raises ValueError if it is not one."""
    value = state.get(key)
    if not isinstance(value, int) or value < 0:
        raise ValueError(f"state.{key} must be a count (got {value})")
    return value


def finite_numbers(state: Mapping[str, Any], key: str, size: int | None) -> list[float]:
    """The `size` finite numbers (None: any number) under `key`. Raises ValueError if they are not there."""
    values = state.get(key)
    if not isinstance(values, list):
        raise ValueError(f"state.{key} must be a list (got {values})")
    require(size is None or len(values) == size, f"state.{key} must hold {size} numbers", len(values))
    for value in values:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        require(
            is_number and abs(value) <= sys.float_info.max, f"state.{key} must hold finite numbers", value
        )
    return [float(value) for value in values]
