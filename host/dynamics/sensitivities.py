"""Exact sensitivities of what the sensors would give, to the parameters and to the initial state.

A run x' = F(x + K e), e = y - h(x), has S = dx / d(parameters, initial state) with

    dh = h_x S + h_p,    S' = F_x (S - K dh) + F_p

at fixed gain K; without one it is the free run. The slopes F_x, F_p, h_x, h_p are those of the very
Runge-Kutta steps of the run; where the run has been, they are evaluated at all rows at once.
"""

from functools import lru_cache

import casadi as ca
import numpy as np

from host.compiled.all_rows import AllRows
from host.compiled.linear_recursion import linear_recursion
from host.compiled.over_rows import KEPT, over_rows
from host.dynamics.propagate import Form, Inputs, Run, form_of, free_run, start_of
from host.dynamics.substep_slopes import substep_slopes
from host.recordings.recording import Array

SETS_KEPT = 256  # of those that share equations


def innovations(
    parameters: Array, initial: Array, inputs: Inputs, gains: Array | None = None
) -> tuple[Array, Array]:
    """Innovations e = y - yhat (2, N) and the predictions' sensitivities (2, parameters + 5, N).

    gains  (2 nx, N) Kalman gain of each row, column-major nx x 2; None for output error (free run).
           The derivative is taken at fixed gain.
    """
    if gains is None:
        run = free_run(parameters, initial, inputs)
    else:
        run = steered_run(parameters, initial, inputs, gains)
    with np.errstate(over="ignore", invalid="ignore"):
        error = inputs.present * (inputs.measured - run.outputs)
    return error, sensitivities(parameters, initial, inputs, run, gains)


def sensitivities(
    parameters: Array, initial: Array, inputs: Inputs, run: Run, gains: Array | None = None
) -> Array:
    """Sensitivities (2, parameters + 5, N) of a run's outputs, 0 where nothing was measured."""
    form, rows = form_of(inputs), inputs.drive.shape[1]
    _, start = start_of(form, parameters, initial, inputs)
    with np.errstate(all="ignore"):  # a run that leaves the numbers is seen by its size
        hx, hp = _output_slopes(form, inputs.own)(run.states, inputs.widened(parameters), inputs.drive)
        Fx, Fp = _slopes_of_substeps(form, run, parameters, inputs)
        if gains is not None:  # a measurement corrects the state before the first sub-step
            first = slice(0, None, form.substeps)
            FK = Fx[first] @ gains.T.reshape((rows, 2, form.nx)).transpose(0, 2, 1)
            Fx[first] -= FK @ hx
            Fp[first] -= FK @ hp
        seen = hx @ linear_recursion(Fx, Fp, start)[:: form.substeps]
        seen[:, :, : parameters.size] += hp
        return seen.transpose(1, 2, 0) * inputs.present[:, None, :]


def steered_run(parameters: Array, initial: Array, inputs: Inputs, gains: Array) -> Run:
    """The run that follows the measurements with given gains."""
    form = form_of(inputs)
    start, _ = start_of(form, parameters, initial, inputs)
    per_step = np.vstack([inputs.drive, inputs.measured, gains])
    steered = over_rows(_steered_step, form, inputs.drive.shape[1])
    table = steered(start, per_step, inputs.widened(parameters))
    states, outputs, within = np.split(table, [form.nx, form.nx + 2])
    return Run(states=states, outputs=outputs, within=within.reshape((form.substeps, form.nx, -1)))


def _slopes_of_substeps(form: Form, run: Run, parameters: Array, inputs: Inputs) -> tuple[Array, Array]:
    """F_x (N substeps, nx, nx) and F_p (N substeps, nx, parameters) of each sub-step of each row."""
    drive, substeps = inputs.drive, form.substeps
    rows = drive.shape[1]
    states = run.within.transpose(1, 2, 0).reshape((form.nx, -1))
    number = np.tile(np.arange(float(substeps)), rows)[None]
    values, driven = inputs.widened(parameters), np.repeat(drive, substeps, axis=1)
    Fx, Fp = _substep_slopes(form, inputs.own)(states, values, driven, number)
    return Fx, Fp


@lru_cache(KEPT)
def _steered_step(form: Form) -> ca.Function:
    """One step of the innovations form; gives x, h(x) and where the sub-steps begin."""
    x, p, drive = form.symbols()
    measured, gain = ca.SX.sym("measured", 2), ca.SX.sym("gain", form.nx * 2)
    y = form.outputs(x, p, drive)
    corrected = x + ca.reshape(gain, form.nx, 2) @ (measured - y)
    *within, after = form.step(corrected, p, drive)
    per_step, result = ca.vertcat(drive, measured, gain), ca.vertcat(x, y, corrected, *within)
    return ca.Function("steered_run", [x, per_step, p], [after, result])


@lru_cache(SETS_KEPT)
def _substep_slopes(form: Form, own: tuple[int, ...]) -> AllRows:
    """F_x (nx, nx) and F_p (nx, parameters) of one sub-step, by the parameters at these places."""
    return _all_substep_slopes(form).with_columns(1, own)


@lru_cache(KEPT)
def _all_substep_slopes(form: Form) -> AllRows:
    (x, p, drive), number = form.symbols(), ca.SX.sym("number")
    slopes = substep_slopes(form, x, p, drive, number)
    return AllRows(ca.Function("substep", [x, p, drive, number], slopes))


@lru_cache(SETS_KEPT)
def _output_slopes(form: Form, own: tuple[int, ...]) -> AllRows:
    """h_x (2, nx) and h_p (2, parameters), by the parameters at these places."""
    return _all_output_slopes(form).with_columns(1, own)


@lru_cache(KEPT)
def _all_output_slopes(form: Form) -> AllRows:
    x, p, drive = form.symbols()
    y = form.outputs(x, p, drive)
    return AllRows(ca.Function("output", [x, p, drive], [ca.jacobian(y, x), ca.jacobian(y, p)]))
