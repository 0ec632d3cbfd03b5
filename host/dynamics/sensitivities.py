"""Exact sensitivities of what the sensors would give, to the parameters and to the initial state.

A run x' = F(x + K e), e = y - h(x), has S = dx / d(parameters, initial state) with

    dh = h_x S + h_p,    S' = F_x (S - K dh) + F_p

at fixed gain K; without one it is the free run. The slopes F_x, F_p, h_x, h_p are those of the very
Runge-Kutta steps of the run; where the run has been, they are evaluated at many rows at once.
"""

from functools import lru_cache

import casadi as ca
import numpy as np

from host.compiled.all_rows import AllRows
from host.compiled.carried_slopes import CarriedSlopes, Passage
from host.compiled.over_rows import KEPT, over_rows
from host.dynamics.form import Form
from host.dynamics.propagate import Inputs, Run, form_of, free_run, start_of
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
    return error, sensitivities(parameters, inputs, run, gains)


def sensitivities(parameters: Array, inputs: Inputs, run: Run, gains: Array | None = None) -> Array:
    """Sensitivities (2, parameters + 5, N) of a run's outputs, 0 where nothing was measured."""
    form = form_of(inputs)
    with np.errstate(all="ignore"):  # a run that leaves the numbers is seen by its size
        values = inputs.widened(parameters)
        passage = Passage(run.states, run.within, values, inputs.drive, run.begun, inputs.present, gains)
        return _carried(form, inputs.own)(passage)


def steered_run(parameters: Array, initial: Array, inputs: Inputs, gains: Array) -> Run:
    """The run that follows the measurements with given gains."""
    form = form_of(inputs)
    start, begun = start_of(form, parameters, initial, inputs)
    per_step = np.vstack([inputs.drive, inputs.measured, gains])
    steered = over_rows(_steered_step, form, inputs.drive.shape[1])
    table = steered(start, per_step, inputs.widened(parameters))
    states, outputs, within = np.split(table, [form.nx, form.nx + 2])
    within = within.reshape((form.substeps, form.nx, -1))
    return Run(states=states, outputs=outputs, within=within, begun=begun)


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
def _carried(form: Form, own: tuple[int, ...]) -> CarriedSlopes:
    """By the parameters at these places."""
    return CarriedSlopes(
        _output_slopes(form).with_columns(1, own), _substep_slopes(form).with_columns(1, own)
    )


@lru_cache(KEPT)
def _substep_slopes(form: Form) -> AllRows:
    """F_x (nx, nx) and F_p (nx, parameters) of one sub-step."""
    (x, p, drive), number = form.symbols(), ca.SX.sym("number")
    slopes = substep_slopes(form, x, p, drive, number)
    return AllRows(ca.Function("substep", [x, p, drive, number], slopes))


@lru_cache(KEPT)
def _output_slopes(form: Form) -> AllRows:
    """h_x (2, nx) and h_p (2, parameters)."""
    x, p, drive = form.symbols()
    y = form.outputs(x, p, drive)
    return AllRows(ca.Function("output", [x, p, drive], [ca.jacobian(y, x), ca.jacobian(y, p)]))
