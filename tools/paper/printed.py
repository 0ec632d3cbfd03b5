"""The numbers that the paper prints, from printed.toml."""

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from firmware_model import car_from_physical
from host.recordings.recording import Array

PHYSICAL = ("a1", "a2", "a3", "b1", "b2")


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimates:
    """One block of Tables 2-5: innovation length p, times (s), estimates (K, n), printed errors (K,) in %."""

    table: int
    p: int
    times: Array
    values: Array
    errors: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """The "real values" as difference-equation coefficients, as printed in Tables 2-6."""

    alpha: Array
    beta: Array
    physical: Array


@cache
def printed() -> dict[str, Any]:
    """printed.toml as it stands."""
    return tomllib.loads((Path(__file__).parent / "printed.toml").read_text(encoding="utf-8"))


def printed_estimates(channel: str) -> list[Estimates]:
    """The blocks of Tables 2 and 3 ("alpha") or 4 and 5 ("beta"), p = 1, 3, 5, 8."""
    tables = (2, 3) if channel == "alpha" else (4, 5)
    blocks = []
    for number in tables:
        table = printed()[f"table{number}"]
        for key in sorted(name for name in table if name.startswith("p")):
            blocks.append(
                Estimates(
                    table=number,
                    p=int(key[1:]),
                    times=np.array(table["times"], dtype=float),
                    values=np.array(table[key]["estimates"]),
                    errors=np.array(table[key]["errors"]),
                )
            )
    return blocks


def printed_truth() -> Truth:
    """The rows "real value"."""
    real = printed()["real"]
    return Truth(
        alpha=np.array(real["alpha"]), beta=np.array(real["beta"]), physical=np.array(real["physical"])
    )


def physical_truth() -> dict[str, float]:
    """a1 ... b2 from Table 1 by Eq. 2 (1/s, 1/s, 1/s^2, m/s^2/rad, 1/s^2)."""
    t = printed()["table1"]
    heave, pitch = t["m"] - t["Zwdot"], t["Iy"] - t["Mqdot"]
    return {
        "a1": t["Zw"] / heave,
        "a2": t["Mq"] / pitch,
        "a3": -t["Mtheta_times_u0_squared"] / t["u0"] ** 2 / pitch,
        "b1": t["Zdelta"] / heave,
        "b2": t["Mdelta"] / pitch,
    }


def correct_truth() -> Truth:
    """What the rows "real value" ought to say: computed from Table 1, signs as the paper prints them."""
    t, physical = printed()["table1"], physical_truth()
    alpha, beta = car_from_physical(**physical, u0=t["u0"], h=t["h"])
    return Truth(
        alpha=as_printed(np.array(alpha)),
        beta=as_printed(np.array(beta)),
        physical=np.array([physical[name] for name in PHYSICAL]),
    )


def as_printed(car: Array) -> Array:
    """CAR coefficients <-> coefficients of the difference equation: the output's have the other sign."""
    outputs = 2 if car.shape[-1] == 3 else 4
    return np.concatenate([-car[..., :outputs], car[..., outputs:]], axis=-1)


def relative_error(estimate: Array, real: Array) -> Array:
    """The paper's e = ||estimate - real||/||real||, in %, over the last axis."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(100.0 * np.linalg.norm(estimate - real, axis=-1) / np.linalg.norm(real))
