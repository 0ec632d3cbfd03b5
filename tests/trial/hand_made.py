"""Answers and diagnoses made by hand."""

from typing import Any

import numpy as np

from tools.trial.answers import Answer, Floor

TRUTH = {"pitch_rad": [0.1, 0.2, 0.1, 0.0], "depth_m": [5.0, 5.1, 5.2, 5.1]}


def answer(case: str = "one", hidden: tuple[str, ...] = ("trim_moment",), **changed: Any) -> Answer:
    slots = {"trim_moment": "pitch", "net_buoyancy": "heave", "rotating_mass": "pitch"}
    values: dict[str, Any] = {
        "number": 1,
        "case": case,
        "hidden": list(hidden),
        "slots": [slots.get(name, "") for name in hidden],
        "sizes": dict.fromkeys(hidden, 1.0),
        "misfits": dict.fromkeys(hidden, 400.0),
        "base": {"a1": -0.5, "u0": 2.0},
        "coefficients": {"trim_moment": {"c_q0": 0.02}} if "trim_moment" in hidden else {},
        "outing": {"has_speed": False},
        "floor": Floor(pitch_noise_rad=0.01, depth_noise_m=0.1, step_s=0.5, **TRUTH),
    }
    return Answer(**(values | changed))


def recorded() -> dict[str, Any]:
    """The truth, off by 0.01 rad and 0.1 m."""
    signs = np.array([1, -1, 1, -1])
    return {
        "time_s": np.arange(4) * 0.5,
        "pitch_rad": np.array(TRUTH["pitch_rad"]) + 0.01 * signs,
        "depth_m": np.array(TRUTH["depth_m"]) + 0.1 * signs,
    }


def effect(name: str, *twins: str, **coefficients: tuple[float, float]) -> dict[str, Any]:
    return {
        "name": name,
        "indistinguishable_from": list(twins),
        "coefficients": {key: {"value": v, "std": s, "unit": "1"} for key, (v, s) in coefficients.items()},
    }


def diagnosis(*effects: dict[str, Any], verdict: str = "explained", slot: str = "pitch") -> dict[str, Any]:
    return {
        "schema": 1,
        "verdict": verdict,
        "base": {"heldout": {"depth_rmse_m": 0.5, "pitch_rmse_rad": 0.05}},
        "location": {"slots": {"heave": 0.2, "pitch": 0.2, slot: 0.8}},
        "effects": list(effects),
        "extended": {"heldout": {"depth_rmse_m": 0.102, "pitch_rmse_rad": 0.0101}},
    }
