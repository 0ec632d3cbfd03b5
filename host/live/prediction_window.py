"""A free run over the last seconds against what arrived, and which simple change would explain the error.

The reference model runs on the plane movement alone, from the initial state that meets the window best:

    w' = a1 w + c_wq q + b1 delta + f0    q' = a2 q + a3 theta + b2 delta + c0
    theta' = q                            zeta' = w - u theta

What no initial state can explain is the prediction error. A small change of the vehicle moves the free run
along a known direction, its sensitivity; the projection of the error on that direction is the evidence for it
(the local approach: A. Benveniste, M. Basseville, G. Moustakides, IEEE Trans. Automatic Control 32(7), 1987).
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firmware_model.estimate import Estimate
from firmware_model.sample import Sample
from host.errors import ConfigError

Array = NDArray[np.float64]

W, Q, THETA, ZETA = range(4)

CHANGES = {
    "heave_force": "heave",
    "heave_damping": "heave",
    "pitch_moment": "pitch",
    "pitch_damping": "pitch",
    "pitch_restoring": "pitch",
    "plane_force": "actuator",
    "plane_delay": "actuator",
    "forward_speed": "surge",
    "pitch_datum": "sensor",
}
"""The simple changes, and the slot of the chain that each belongs to."""
NAMES = tuple(CHANGES)

LEAST_PRESENT = 0.5  # share of a window's values that must have been measured
OUTLIER = 5.0  # standard deviations of a window's error, beyond which a value counts as not measured
MOST_OUTLIERS = 0.1  # share of a window; more of them are no outliers


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """Coefficients of the free run, SI units as in `firmware_model.estimate.Estimate`."""

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
        """Whether it is known, and does not run away."""
        values = [getattr(self, item.name) for item in fields(self)]
        return all(map(math.isfinite, values)) and self.a1 <= 0.0 and self.a2 <= 0.0 and self.a3 <= 0.0


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
        raise ConfigError(f"mismatch.model {path} must be a stable vehicle (got {reference})")
    return reference


class Comparison(NamedTuple):
    """One window, in units of the channels' levels.

    errors     rms prediction error of pitch and depth, (2,)
    evidence   projection of the error on the direction of each change, by `NAMES`
    leverage   length of that direction: a change of size c gives an evidence of c times its leverage
    squares    sum of the squared errors
    activity   rms of the motion that the plane makes
    """

    errors: Array
    squares: float
    evidence: Array
    leverage: Array
    activity: float


class PredictionWindow:
    """The last `samples` samples on the time grid of `step` s."""

    def __init__(self, samples: int, step: float) -> None:
        self._step = step
        self._rows = np.full((samples, 4), math.nan)  # pitch, depth, rudder, speed
        self._filled = 0
        self._unheard = 0  # samples in a row without a plane
        self._t_us: int | None = None

    def clear(self) -> None:
        """Joins nothing across this moment."""
        self._filled = self._unheard = 0
        self._t_us = None

    def push(self, sample: Sample) -> None:
        """Takes the next sample; one that is not the next on the grid begins anew."""
        if self._t_us is not None and abs(sample.t_us - self._t_us - 1e6 * self._step) > 1e5 * self._step:
            self.clear()
        self._t_us = sample.t_us
        last = self._rows[-1] if self._filled else np.full(4, math.nan)
        # A plane that is not heard is held until it is heard again, and so is a speed.
        is_heard = not math.isnan(sample.rudder)
        rudder = sample.rudder if is_heard else last[2]
        speed = last[3] if math.isnan(sample.speed) else sample.speed
        self._rows[:-1] = self._rows[1:]
        self._rows[-1] = sample.pitch, sample.depth, rudder, speed
        self._filled = min(self._filled + 1, len(self._rows))
        if is_heard and self._unheard:
            # It turned on the way, nobody knows when.
            way = min(self._unheard + 2, len(self._rows))
            self._rows[-way:, 2] = np.linspace(self._rows[-way, 2], rudder, way)
        self._unheard = 0 if is_heard else self._unheard + 1

    @property
    def is_full(self) -> bool:
        """Whether there is enough of everything in it."""
        if self._filled < len(self._rows) or not np.isfinite(self._rows[:, 2]).all():
            return False
        return bool((np.isfinite(self._rows[:, :2]).mean(axis=0) >= LEAST_PRESENT).all())

    def moves(self, least: Array) -> bool:
        """Whether the standard deviation of pitch or depth, (2,), is above the least."""
        return bool((np.nanstd(self._rows[:, :2], axis=0) > least).any())

    def compare(self, reference: Reference, levels: Array) -> Comparison:
        """Runs the reference over the window. `levels`: pitch rad and depth m that count as one."""
        run = _Run(reference, self._step, self._rows[:, 3])
        rows, rudder = len(self._rows), self._rows[:, 2]
        forces = np.array([[reference.heave_offset, reference.pitch_offset, 0.0]])
        plane = np.array([reference.b1, reference.b2, 0.0])
        turning = np.diff(rudder, prepend=rudder[0]) / self._step
        pushes = np.zeros((rows, 3, 5))
        pushes[:, :, 0] = forces + rudder[:, None] * plane
        pushes[:, 0, 1] = 1.0
        pushes[:, 1, 2] = 1.0
        pushes[:, :, 3] = rudder[:, None] * plane
        pushes[:, :, 4] = turning[:, None] * plane
        known = run.outputs(
            [*np.zeros((5, 4)), *np.eye(4)], np.concatenate([pushes, np.zeros((rows, 3, 4))], axis=2)
        )
        base, heave, pitch, gain, delay = (known[:, :, k] for k in range(5))
        error, free = self._rows[:, :2] - base[:, 2:], known[:, 2:, 5:]
        start, weight = _best_start(error, free, levels)
        motion = base + known[:, :, 5:] @ start
        pushes = np.zeros((rows, 3, 4))
        pushes[:, 0, 0] = motion[:, W]
        pushes[:, 1, 1] = motion[:, Q]
        pushes[:, 1, 2] = motion[:, THETA]
        pushes[:, 2, 3] = -motion[:, THETA]
        damping, turn, restoring, speed = np.moveaxis(run.outputs(np.zeros((4, 4)), pushes), 2, 0)
        datum = np.zeros((rows, 4))
        datum[:, THETA] = 1.0
        changes = (heave, damping, pitch, turn, restoring, gain, delay, speed, datum)
        return _projected(error, free, weight, [change[:, 2:] for change in changes], gain[:, 2:])


class _Run:
    """The equations over one window, exact for pushes held over a step.

    A measured speed enters as the motion of the depth that its difference from u0 makes.
    """

    def __init__(self, reference: Reference, step: float, speed: Array) -> None:
        A = np.zeros((7, 7))
        A[W, [W, Q]] = reference.a1, reference.c_wq
        A[Q, [Q, THETA]] = reference.a2, reference.a3
        A[THETA, Q] = 1.0
        A[ZETA, [W, THETA]] = 1.0, -reference.u0
        A[[W, Q, ZETA], [4, 5, 6]] = 1.0
        whole = _exponential(step * A)
        self._move, self._push = whole[:4, :4], whole[:4, 4:]
        self._drift = np.where(np.isnan(speed), 0.0, speed - reference.u0) * step

    def outputs(self, starts: Sequence[Array] | Array, pushes: Array) -> Array:
        """States (rows, 4, columns) from the starts (columns, 4) under pushes (rows, 3, columns)."""
        states = np.empty((len(pushes), 4, pushes.shape[2]))
        state = np.array(starts).T
        pushed = self._push @ pushes
        for k, drift in enumerate(self._drift.tolist()):
            states[k] = state
            after = self._move @ state + pushed[k]
            if drift:
                after[ZETA] -= drift * state[THETA]
            state = after
        return states


def _exponential(A: Array) -> Array:
    """exp(A) by its Taylor series, scaled and squared."""
    halvings = max(0, math.ceil(math.log2(max(float(np.abs(A).sum(axis=1).max()), 1e-9) / 0.25)))
    A = A / 2.0**halvings
    term = total = np.eye(len(A))
    for k in range(1, 10):
        term = term @ A / k
        total = total + term
    return np.linalg.matrix_power(total, 2**halvings)


def _best_start(error: Array, free: Array, levels: Array) -> tuple[Array, Array]:
    """Initial state by weighted least squares, and the weights (rows, 2), 0 for outliers and gaps."""
    weight = np.where(np.isfinite(error), 1.0 / levels, 0.0)
    for _ in range(3):
        start, left = _fit(error, free, weight)
        size = np.abs(left)
        limit = (
            OUTLIER
            * 1.4826
            * np.array([np.median(s[w > 0.0]) for s, w in zip(size.T, weight.T, strict=True)])
        )
        wrong = (weight > 0.0) & (size > np.maximum(limit, 1e-9))
        if not wrong.any() or wrong.sum() > MOST_OUTLIERS * (weight > 0.0).sum():
            break
        weight = np.where(wrong, 0.0, weight)
        start, _ = _fit(error, free, weight)
    return start, weight


def _fit(error: Array, free: Array, weight: Array) -> tuple[Array, Array]:
    columns = (free * weight[:, :, None]).reshape(-1, 4)
    target = (np.where(weight > 0.0, error, 0.0) * weight).reshape(-1)
    start: Array = np.asarray(np.linalg.lstsq(columns, target, rcond=1e-9)[0], dtype=np.float64)
    left: Array = (target - columns @ start).reshape(error.shape)
    return start, left


def _projected(error: Array, free: Array, weight: Array, changes: list[Array], plane: Array) -> Comparison:
    """The comparison, with everything that the initial state can do taken out."""
    start = np.linalg.qr((free * weight[:, :, None]).reshape(-1, 4))[0]

    def beyond(columns: Array) -> Array:
        return columns - start @ (start.T @ columns)

    left = beyond((np.where(weight > 0.0, error, 0.0) * weight).reshape(-1))
    directions = beyond((np.stack(changes, axis=2) * weight[:, :, None]).reshape(-1, len(changes)))
    leverage = np.sqrt((directions**2).sum(axis=0)) + 1e-9
    counts = np.maximum((weight > 0.0).sum(axis=0), 1)
    return Comparison(
        errors=np.sqrt((left.reshape(error.shape) ** 2).sum(axis=0) / counts),
        squares=float(left @ left),
        evidence=directions.T @ left / leverage,
        leverage=leverage,
        activity=float(np.sqrt(np.mean((plane * weight) ** 2))),
    )
