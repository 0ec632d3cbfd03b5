"""An identified vehicle as a file: model.json, and extended_model.json with the physics that was missing."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from host.equations import NAMES, PARAMETERS
from host.errors import RecordingError
from host.recording import Array

SCHEMA = 1
UNITS = {parameter.name: parameter.unit for parameter in PARAMETERS}


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleModel:
    """The equations' coefficients with what is known of their accuracy.

    values, std  by parameter name (host.equations), SI units; std 0 where a value was given, not estimated
    noise        standard deviations "pitch_rad", "depth_m" and, where unknown forces were found, densities
                 "heave_force_density", "pitch_moment_density"
    valid_range  smallest and largest "pitch_rad", "rudder_rad", "depth_m", "speed_mps" the data held
    provenance   recording names with sha256, program version, method
    """

    vehicle: str
    step: float
    values: dict[str, float]
    std: dict[str, float]
    noise: dict[str, float]
    valid_range: dict[str, tuple[float, float]]
    provenance: dict[str, Any]
    effects: list[dict[str, Any]] = field(default_factory=list)

    @property
    def units(self) -> dict[str, str]:
        """SI unit by parameter name."""
        return UNITS

    @property
    def parameters(self) -> Array:
        """Values in the order of host.equations.NAMES."""
        return np.array([self.values[name] for name in NAMES])


def write_model(model: VehicleModel, path: Path) -> None:
    """Writes model.json."""
    document = {
        "schema": SCHEMA,
        "vehicle": model.vehicle,
        "step_s": model.step,
        "parameters": {
            name: {"value": _json(model.values[name]), "std": _json(model.std[name]), "unit": UNITS[name]}
            for name in NAMES
        },
        "effects": model.effects,
        "noise": model.noise,
        "valid_range": {name: list(limits) for name, limits in model.valid_range.items()},
        "provenance": model.provenance,
    }
    path.write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _json(value: float) -> float | None:
    """JSON has no NaN: a value that could not be found is null."""
    return value if np.isfinite(value) else None


def read_model(path: Path) -> VehicleModel:
    """Reads model.json; a missing trim offset counts as zero.

    Raises RecordingError with one line when it is no JSON, of another schema, or lacks a coefficient.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise RecordingError(f"{path}: is not a model file (no JSON: {error.__class__.__name__})") from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        found = document.get("schema") if isinstance(document, dict) else None
        raise RecordingError(f"{path}: schema must be {SCHEMA} (got {found!r}); identify the vehicle again")
    if document.get("effects"):
        names = ", ".join(str(effect.get("name")) for effect in document["effects"])
        raise RecordingError(f"{path}: holds effects this version cannot simulate ({names})")
    values, std = {}, {}
    for name in NAMES:
        entry = document.get("parameters", {}).get(name)
        if entry is None and name.endswith("_offset"):
            entry = {"value": 0.0, "std": 0.0}
        try:
            values[name], std[name] = float(entry["value"]), float(entry.get("std", 0.0))
        except (TypeError, KeyError, ValueError, AttributeError) as error:
            raise RecordingError(
                f"{path}: parameters.{name}.value must be a number (got {entry!r})"
            ) from error
        if not np.isfinite(values[name]):
            raise RecordingError(f"{path}: parameters.{name}.value must be finite (got {values[name]})")
    try:
        return VehicleModel(
            vehicle=str(document.get("vehicle", path.stem)),
            step=float(document["step_s"]),
            values=values,
            std=std,
            noise={name: float(value) for name, value in document.get("noise", {}).items()},
            valid_range={
                name: (float(low), float(high))
                for name, (low, high) in document.get("valid_range", {}).items()
            },
            provenance=dict(document.get("provenance", {})),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise RecordingError(f"{path}: is not a complete model file ({error})") from error
