"""A rough start for any set of effects: regression of smoothed accelerations on smoothed motion.

It is biased by the noise it smooths away only in part, so nothing is concluded from it; but it lands in the
right valley where the base model, bent to absorb the physics that is missing, would not.

    w = zeta' + u theta,   w' on [w, delta, ...],   q' on [q, theta, delta, ...]
"""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from host.noise.speed import smoothed_speed
from host.recordings.recording import Array, Recording

SMOOTHING = 0.35  # s, width of the Gaussian; shorter than the motion, long against a sample

Columns = dict[str, Array]


def first_guess(recordings: list[Recording], speed: float, effects: frozenset[str]) -> dict[str, float]:
    """Values by parameter name for the base and for those effects that are linear in the motion."""
    parts = [_smoothed(recording, speed) for recording in recordings]
    s = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    one = np.ones_like(s["w"])
    heave: Columns = {"a1": s["w"], "b1": s["delta"]}
    heave |= {"c_wq": s["q"]} if "heave_pitch_rate_coupling" in effects else {}
    heave |= {"c_ww": s["w"] * np.abs(s["w"])} if "heave_quadratic_drag" in effects else {}
    pitch: Columns = {"a2": s["q"], "a3": s["theta"], "b2": s["delta"]}
    pitch |= {"c_qw": s["w"]} if "munk_moment" in effects else {}
    pitch |= {"c_qq": s["q"] * np.abs(s["q"])} if "pitch_quadratic_damping" in effects else {}
    guess = _regressed(s["dw"], heave | {"c_w0": one}) | _regressed(s["dq"], pitch | {"c_q0": one})
    guess["a1"] = float(np.clip(guess["a1"], -10.0, -0.05))
    guess["a2"] = float(np.clip(guess["a2"], -20.0, -0.05))
    guess["a3"] = float(np.clip(guess["a3"], -200.0, -0.02))
    guess["u0"] = speed
    return guess


def accelerations(recordings: list[Recording]) -> tuple[float, float]:
    """Rms of w' (m/s^2) and q' (rad/s^2) from smoothed measurements; at 1 m/s where no speed is known."""
    parts = [_smoothed(recording, 1.0) for recording in recordings]
    heave, pitch = (np.concatenate([part[name] for part in parts]) for name in ("dw", "dq"))
    return float(np.sqrt(np.mean(heave**2))), float(np.sqrt(np.mean(pitch**2)))


def _regressed(target: Array, columns: Columns) -> dict[str, float]:
    solution = np.linalg.lstsq(np.column_stack(list(columns.values())), target, rcond=None)[0]
    return dict(zip(columns, solution.tolist(), strict=True))


def _smoothed(recording: Recording, speed: float) -> Columns:
    """The smoothed motion without the ends and long gaps, where smoothing lacks one side."""
    motion = smoothed_motion(recording, speed)
    margin = int(4 * max(1.0, SMOOTHING / recording.step))
    rows = np.arange(recording.time.size)
    inside = (rows >= margin) & (rows < rows.size - margin)
    for values in (recording.pitch, recording.depth):
        known = np.flatnonzero(np.isfinite(values))
        after = np.searchsorted(known, rows).clip(1, known.size - 1)
        inside &= known[after] - known[after - 1] <= margin
    if not inside.any():
        inside[:] = True
    return {name: values[inside] for name, values in motion.items()}


def smoothed_motion(recording: Recording, speed: float) -> Columns:
    """w, w', theta, q, q', zeta and delta at every row, SI, from the measurements alone."""
    width = max(1.0, SMOOTHING / recording.step)
    h = recording.step

    def filled(values: Array) -> Array:
        known = np.isfinite(values)
        return np.interp(recording.time, recording.time[known], values[known])

    def derived(values: Array, order: int) -> Array:
        return np.asarray(gaussian_filter1d(values, width, order=order, mode="nearest")) / h**order

    theta, depth = filled(recording.pitch), filled(recording.depth)
    datum = depth.mean()  # the kernel of a derivative sums to zero only nearly
    depth = depth - datum
    u = smoothed_speed(recording.speed).speed if recording.has_speed else np.full(theta.size, speed)
    return {
        "w": derived(depth, 1) + u * np.sin(derived(theta, 0)),
        "dw": derived(depth, 2) + u * derived(theta, 1),
        "theta": derived(theta, 0),
        "q": derived(theta, 1),
        "dq": derived(theta, 2),
        "zeta": derived(depth, 0) + datum,
        "delta": derived(recording.rudder, 0),
    }
