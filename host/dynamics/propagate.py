"""Propagation of the equations over a recording.

Between rows the command is held (zero-order hold), as the actuator holds it, and the state advances by
classical fourth-order Runge-Kutta in sub-steps short enough that its error stays below the sensors'
resolution.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from host.compiled.over_rows import KEPT, over_rows
from host.dynamics.equations import BASE, START, Structure
from host.dynamics.form import Form
from host.noise.drift import NOT_WHITENED, Whitenings
from host.noise.speed import smoothed_speed
from host.noise.unseen_plane import UnseenPlane
from host.recordings.recording import Array, Recording

NX0 = len(START)
MOST_SUBSTEPS = 8  # slow records show no modes faster than their sampling: finer steps would resolve nothing
LONGEST_SUBSTEP = 0.05  # s; for a 10 rad/s mode the error of one sub-step is below 3e-4 of its change
LONGEST_OF_ALL = 0.5  # s; a quarter of the shortest period of a wave
FIRST_LAG = 6  # of the rows of `drive`: what stands before the earlier commands
LONGEST_DELAY = 1.0  # s; how far back commands are looked up
NONE = np.zeros(0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """What drives the equations over one recording, and what was measured. N rows.

    drive     (6 + lags, N) commanded rudder rad, mean speed to the next row m/s, 1 where the speed is known,
              interval to the next row s, time s, surge acceleration m/s^2; then, where the structure looks
              back, earlier commands, newest first
    measured  (2, N) pitch rad and depth m, 0 where missing
    present   (2, N) 1 where measured, else 0
    steps     (2,) of the rounding of pitch and depth where it rules, else 0
    whitening  of pitch and of depth, where more than white noise is in them
    unseen     the same of both, where the plane stepped unseen
    astray     rad (N,), deviation of the plane's mean angle in a row where it moved unseen; empty if nowhere
    shared     larger equations that are evaluated in place of the structure's own, if any; what these lack
               acts nowhere where its parameters are 0, and moves no state of its own
    """

    structure: Structure
    drive: Array
    measured: Array
    present: Array
    substeps: int
    steps: Array = field(default_factory=lambda: np.zeros(2))
    whitening: Whitenings = NOT_WHITENED
    unseen: UnseenPlane | None = None
    astray: Array = field(default_factory=lambda: NONE)
    shared: Structure | None = None
    before: Array = field(default_factory=lambda: np.zeros((FIRST_LAG, 0)))

    def of(self, structure: Structure, shared: Structure | None = None) -> "Inputs":
        """What drives other equations over the same recording, which look back as far."""
        return replace(self, structure=structure, shared=shared)

    def with_rudder(self, rudder: Array) -> "Inputs":
        """The same with other commands, rad (N,)."""
        rest = self.drive[1:FIRST_LAG]
        lags = self.drive.shape[0] - FIRST_LAG
        return replace(self, drive=np.vstack([rudder, rest, *_earlier(rudder, lags, self.before[0])]))

    @property
    def evaluated(self) -> Structure:
        """The equations whose functions are built."""
        return self.structure if self.shared is None else self.shared

    @property
    def own(self) -> tuple[int, ...]:
        """The places of the structure's parameters among those of `evaluated`."""
        return _places(self.structure.names, self.evaluated.names)

    def widened(self, parameters: Array) -> Array:
        """The structure's parameters among those of `evaluated`."""
        if self.shared is None:
            return parameters
        values = np.zeros(len(self.shared.names))
        values[list(self.own)] = parameters
        return values


@lru_cache
def _places(own: tuple[str, ...], among: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(map(among.index, own))


def inputs_of(
    recording: Recording,
    structure: Structure = BASE,
    longest_substep: float = LONGEST_SUBSTEP,
    steps: Array | None = None,
    whitening: Whitenings = NOT_WHITENED,
) -> Inputs:
    """Inputs of one recording. Longer sub-steps (s) suit vehicles whose modes are known to be slow."""
    intervals = recording.intervals
    steps = np.zeros(2) if steps is None else steps
    known = np.full(intervals.size, float(recording.has_speed))
    speed = smoothed_speed(recording.speed).speed if recording.has_speed else np.zeros(intervals.size)
    surge = np.append(np.diff(speed) / intervals[:-1], 0.0)
    speed = np.append((speed[:-1] + speed[1:]) / 2.0, speed[-1:])  # from row to row it changes evenly
    lags = int(np.ceil(LONGEST_DELAY / recording.step)) + 1 if structure.needs_lags else 0
    measured = np.vstack([recording.pitch, recording.depth])
    present = np.isfinite(measured)
    return Inputs(
        structure=structure,
        drive=np.vstack(
            [
                recording.rudder,
                speed,
                known,
                intervals,
                recording.time,
                surge,
                *_earlier(recording.rudder, lags, recording.before[1]),
            ]
        ),
        measured=np.where(present, measured, 0.0),
        present=present.astype(float),
        substeps=int(np.ceil(recording.step / max(longest_substep, recording.step / MOST_SUBSTEPS) - 1e-6)),
        steps=steps,
        whitening=whitening,
        astray=astray(recording),
        before=_before(recording, lags),
    )


def astray(recording: Recording, share: float | None = None) -> Array:
    """The `Inputs.astray` of a recording, or with another share of what its plane moved."""
    share = recording.plane_astray if share is None else share
    return NONE if recording.plane_moved is None or not share else share * np.abs(recording.plane_moved)


def _before(recording: Recording, lags: int) -> Array:
    """The rows of `Inputs.before`."""
    time, rudder = recording.before
    intervals = np.diff(time, append=recording.time[:1])
    unknown = np.zeros_like(time)
    return np.vstack([rudder, unknown, unknown, intervals, time, unknown, *_earlier(rudder, lags)])


def _earlier(rudder: Array, lags: int, before: Array = NONE) -> list[Array]:
    """Commands one row ago, two, and so on; the first that is known stood before it."""
    known = np.append(before, rudder)
    first, count = before.size, rudder.size
    if not known.size:
        return [known] * lags
    padded = np.append(np.full(lags, known[0]), known)
    return [padded[lags + first - lag :][:count] for lag in range(1, lags + 1)]


def longest_substep(parameters: Array, step: float) -> float:
    """Sub-step, s, that resolves the modes of a vehicle with these base parameters: a fifth of 1 / rate.

    Twice the rate is allowed for, as effects to come may quicken it. What the plane does within a sub-step
    counts by its mean and its moment, however quick; waves are the quickest that acts, and half of a row
    between samples `step` s apart, or LONGEST_OF_ALL, is enough for those that can be seen.
    """
    a1, a2, a3 = parameters[:3]
    fastest = max(abs(a1), abs(a2), abs(a3) ** 0.5)
    longest = max(LONGEST_OF_ALL, step / 2.0)
    return float(np.clip(0.4 / fastest, LONGEST_SUBSTEP, longest))


@lru_cache(KEPT)
def _initial(form: Form) -> Callable[[Array, Array, Array], Array]:
    """All states at the first row, and their derivatives by the parameters and what a run begins with.

    Side by side, (nx, 1 + parameters + 5), from what it begins with, the parameters and the first row.
    """
    x0, (_, p, drive) = ca.SX.sym("x0", NX0), form.symbols()
    x = form.structure.initial(x0, p, drive)
    table = ca.densify(ca.horzcat(x, ca.jacobian(x, p), ca.jacobian(x, x0)))
    function = ca.Function("initial", [x0, p, drive], [table])

    def run(*given: Array) -> Array:
        # In place, as in host.compiled.over_rows: CasADi's own matrices would take longer than all else.
        columns = np.empty(table.shape[::-1])
        buffer: Any
        buffer, evaluate = function.buffer()
        kept = [np.ascontiguousarray(one, dtype=float) for one in given]
        for place, one in enumerate(kept):
            buffer.set_arg(place, one.data)
        buffer.set_res(0, columns.data)
        evaluate()
        return columns.T

    return run


@lru_cache(KEPT)
def _free_run(form: Form) -> ca.Function:
    x, p, drive = form.symbols()
    *within, after = form.step(x, p, drive)
    return ca.Function("free_run", [x, drive, p], [after, ca.vertcat(x, *within, form.outputs(x, p, drive))])


def form_of(inputs: Inputs) -> Form:
    """Of the functions that propagate this recording."""
    return Form(inputs.evaluated, inputs.substeps, inputs.drive.shape[0])


def begun_at(pitch: float, depth: float) -> Array:
    """What a run begins with at this pitch, rad, and depth, m, in steady flight (5,)."""
    return np.array([0.0, 0.0, pitch, depth, 0.0])


def start_of(form: Form, parameters: Array, initial: Array, inputs: Inputs) -> tuple[Array, Array]:
    """All states at the first row (nx,), and their derivatives by the parameters and by `initial` (5,)."""
    values, structure = inputs.widened(parameters), form.structure
    table = _initial(form)(initial, values, inputs.drive[:, 0])
    if inputs.before.size and (servos := structure.servos):
        of_the_drive = _places(structure.drive.names, structure.names)
        led = led_in(replace(form, structure=structure.drive), values[list(of_the_drive)], inputs.before)
        table[np.ix_(servos, [0, *(1 + k for k in of_the_drive)])] = led
    own = [*inputs.own, *range(form.np, form.np + NX0)]
    return table[:, 0].copy(), table[:, 1:][:, own]


def led_in(form: Form, values: Array, before: Array) -> Array:
    """Where the rows before the first lead the plane's actuators, settled at the first of these, and slopes.

    Side by side, (actuators, 1 + parameters).
    """
    servos = list(form.structure.servos)
    settled = _initial(form)(np.zeros(NX0), values, before[:, 0])[servos, : 1 + form.np]
    led = over_rows(_led, form, before.shape[1])(settled.T.ravel(), before, values)[:, -1]
    return led.reshape((-1, len(servos))).T


@lru_cache(KEPT)
def _led(form: Form) -> ca.Function:
    """The actuators over one row, and their slopes by the parameters, S' = F_x S + F_p."""
    _, p, drive = form.symbols()
    states, servos = form.structure.states, list(form.structure.servos)
    held, S = ca.SX.sym("held", len(servos)), ca.SX.sym("S", len(servos), form.np)
    after, h = held, drive[3] / form.substeps
    for k in range(form.substeps):
        x = ca.SX(form.nx, 1)
        x[servos] = after
        moved = form.structure.actuate(form.structure.chain(x, p, drive, drive[4] + k * h), h)
        after = ca.vertcat(*(moved[states[place]] for place in servos))
    slopes = ca.jacobian(after, held) @ S + ca.jacobian(after, p)
    carried, on = ca.vertcat(held, ca.vec(S)), ca.densify(ca.vertcat(after, ca.vec(slopes)))
    return ca.Function("led", [carried, drive, p], [on, on])


@dataclass(frozen=True, slots=True)
class Run:
    """What a vehicle did over N rows.

    states   (nx, N)
    outputs  (2, N) pitch and depth
    within   (substeps, nx, N) states from which the sub-steps begin
    begun    (nx, parameters + 5) slopes of the first state by the parameters and by what the run began with
    """

    states: Array
    outputs: Array
    within: Array
    begun: Array


def free_run(parameters: Array, initial: Array, inputs: Inputs) -> Run:
    """Simulates from [w, q, theta, zeta, u / u0 - 1] (5,) at the first row, blind to the measurements."""
    form = form_of(inputs)
    start, begun = start_of(form, parameters, initial, inputs)
    table = over_rows(_free_run, form, inputs.drive.shape[1])(start, inputs.drive, inputs.widened(parameters))
    within = table[:-2].reshape((form.substeps, form.nx, -1))
    return Run(states=within[0], outputs=table[-2:], within=within, begun=begun)
