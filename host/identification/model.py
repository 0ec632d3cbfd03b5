"""An identified vehicle as a file: model.json, and extended_model.json with the physics that was missing."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from host.catalogue import BY_NAME, UNKNOWN, named, structure_of
from host.catalogue.nuisance import SPEED_CORRECTION
from host.dynamics.equations import NAMES, PARAMETERS, Structure
from host.errors import RecordingError
from host.likelihood.fit import NO_WANDER
from host.recordings.recording import Array, Recording
from host.version import program_version

SCHEMA = 1
UNITS = {parameter.name: parameter.unit for parameter in PARAMETERS}


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleModel:
    """The equations' coefficients with what is known of their accuracy.

    values, std  by parameter name (host.dynamics.equations), SI units; std 0 of what was given, not estimated
    noise        standard deviations "pitch_rad", "depth_m" and, where unknown forces were found, densities
                 "heave_force_density", "pitch_moment_density"; where a sensor's error wanders, deviation and
                 correlation time of that part, "depth_wander_m", "depth_wander_s"
    valid_range  smallest and largest "pitch_rad", "rudder_rad", "depth_m", "speed_mps" the data held
    provenance   recording names with sha256, program version, method
    has_moving_plane  whether the plane is taken to move on evenly between the rows of a recording
    """

    vehicle: str
    step: float
    values: dict[str, float]
    std: dict[str, float]
    noise: dict[str, float]
    valid_range: dict[str, tuple[float, float]]
    provenance: dict[str, Any]
    effects: list[dict[str, Any]] = field(default_factory=list)
    has_moving_plane: bool = False

    @property
    def units(self) -> dict[str, str]:
        """SI unit by parameter name."""
        return UNITS

    @property
    def structure(self) -> Structure:
        """The base equations with this model's effects."""
        return structure_of(tuple(str(effect["name"]) for effect in self.effects))

    @property
    def parameters(self) -> Array:
        """Values of base and effects, in the order of the structure's parameters."""
        known = dict(self.values)
        for effect in self.effects:
            known |= {name: entry["value"] for name, entry in effect["parameters"].items()}
        return np.array([known[name] for name in self.structure.names])


def model_of(
    recordings: list[Recording],
    vehicle: str,
    method: str,
    values: dict[str, float],
    std: dict[str, float],
    noise: Array | None = None,
    effects: list[dict[str, Any]] | None = None,
    wander: Array | None = None,
) -> VehicleModel:
    """A model learnt from these recordings; `noise` and `wander` as in host.likelihood.fit.Fit."""
    named: dict[str, float] = {}
    if noise is not None:
        named = {"pitch_rad": float(np.sqrt(noise[0])), "depth_m": float(np.sqrt(noise[1]))}
        if noise[2:].any():
            named |= {"heave_force_density": float(noise[2]), "pitch_moment_density": float(noise[3])}
    wandering = (("pitch", "rad"), ("depth", "m"), ("current", "mps"))
    for (what, unit), (variance, time) in zip(
        wandering, NO_WANDER if wander is None else wander, strict=True
    ):
        if variance > 0.0:
            named |= {f"{what}_wander_{unit}": float(np.sqrt(variance)), f"{what}_wander_s": float(time)}
    valid_range = {}
    channels = dict(pitch_rad="pitch", rudder_rad="rudder", depth_m="depth", speed_mps="speed")
    for key, name in channels.items():
        seen = np.concatenate([getattr(recording, name) for recording in recordings])
        if np.isfinite(seen).any():
            valid_range[key] = (float(np.nanmin(seen)), float(np.nanmax(seen)))
    files = {recording.name: recording.sha256 for recording in recordings}
    return VehicleModel(
        vehicle=vehicle,
        step=recordings[0].step,
        values=values,
        std=std,
        noise=named,
        valid_range=valid_range,
        provenance={
            "method": method,
            "version": program_version(),
            "recordings": [{"name": name, "sha256": digest} for name, digest in files.items()],
        },
        effects=effects if effects is not None else [],
        has_moving_plane=any(recording.has_moving_plane for recording in recordings),
    )


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
        "plane_between_rows": "moving" if model.has_moving_plane else "held",
        "noise": model.noise,
        "valid_range": {name: list(limits) for name, limits in model.valid_range.items()},
        "provenance": model.provenance,
    }
    path.write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _check_effect(effect: Any, path: Path) -> None:
    name = effect.get("name") if isinstance(effect, dict) else effect
    if name not in {*BY_NAME, *UNKNOWN, SPEED_CORRECTION.name}:
        raise RecordingError(f"{path}: holds an effect this version does not know ({name})")
    for parameter in named(name).parameters:
        entry = effect.get("parameters", {}).get(parameter.name)
        value = entry.get("value") if isinstance(entry, dict) else None
        if not isinstance(value, int | float) or not np.isfinite(value):
            raise RecordingError(
                f"{path}: effects.{name}.{parameter.name}.value must be a finite number (got {value!r})"
            )


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
    effects = document.get("effects") or []
    for effect in effects:
        _check_effect(effect, path)
    plane = document.get("plane_between_rows", "held")
    if plane not in ("held", "moving"):
        raise RecordingError(f"{path}: plane_between_rows must be 'held' or 'moving' (got {plane!r})")
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
            effects=effects,
            has_moving_plane=plane == "moving",
        )
    except (KeyError, TypeError, ValueError) as error:
        raise RecordingError(f"{path}: is not a complete model file ({error})") from error
