"""The linear model that the live alarm predicts with.

w' = a1 w + c_wq q + b1 delta + f0    q' = a2 q + a3 theta + b2 delta + c0
theta' = q                            zeta' = w - u theta
"""

import json
import math
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firmware_model.estimate import Estimate
from host.errors import ConfigError

Array = NDArray[np.float64]

W, Q, THETA, ZETA = range(4)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """Coefficients of the model, SI units as in `firmware_model.estimate.Estimate`."""

    a1: float
    a2: float
    a3: float
    b1: float
    b2: float
    u0: float
    c_wq: float = 0.0
    heave_offset: float = 0.0
    pitch_offset: float = 0.0

    @property
    def is_usable(self) -> bool:
        """Whether it is known, goes ahead, and does not run away."""
        values = [getattr(self, item.name) for item in fields(self)]
        is_stable = self.a1 <= 0.0 and self.a2 <= 0.0 and self.a3 <= 0.0
        return all(map(math.isfinite, values)) and self.u0 > 0.0 and is_stable

    def discrete(self, step: float) -> tuple[Array, Array]:
        """Transition (4, 4) over a step of s, and what is added by pushes held over it, (4, 3): exact.

        The pushes are a heave acceleration, a pitch acceleration and a vertical speed.
        """
        A = np.zeros((7, 7))
        A[W, [W, Q]] = self.a1, self.c_wq
        A[Q, [Q, THETA]] = self.a2, self.a3
        A[THETA, Q] = 1.0
        A[ZETA, [W, THETA]] = 1.0, -self.u0
        A[[W, Q, ZETA], [4, 5, 6]] = 1.0
        whole = _exponential(step * A)
        return whole[:4, :4], whole[:4, 4:]


def reference_of(estimate: Estimate) -> Reference:
    """What is believed now."""
    values = {item.name: getattr(estimate, item.name) for item in fields(Reference)}
    if math.isnan(estimate.c_wq):
        values["c_wq"] = 0.0
    return Reference(**values)


def read_reference(path: Path) -> Reference:
    """The coefficients of a model.json. Raises ConfigError in one line when it is none, or holds effects."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        values = {name: float(entry["value"]) for name, entry in document["parameters"].items()}
        effects = [str(effect["name"]) for effect in document.get("effects") or []]
        reference = Reference(**{f.name: values[f.name] for f in fields(Reference) if f.name in values})
    except OSError as error:
        raise ConfigError(f"mismatch.model {path} cannot be read ({error.strerror})") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ConfigError(f"mismatch.model {path} must be a model.json of this program ({error})") from error
    if effects:
        raise ConfigError(f"mismatch.model {path} must hold no effects (got {', '.join(effects)})")
    if not reference.is_usable:
        raise ConfigError(f"mismatch.model {path} must be a stable vehicle that goes ahead (got {reference})")
    return reference


def _exponential(A: Array) -> Array:
    """exp(A) by its Taylor series, scaled and squared."""
    halvings = max(0, math.ceil(math.log2(max(float(np.abs(A).sum(axis=1).max()), 1e-9) / 0.25)))
    A = A / 2.0**halvings
    term = total = np.eye(len(A))
    for k in range(1, 10):
        term = term @ A / k
        total = total + term
    return np.linalg.matrix_power(total, 2**halvings)
