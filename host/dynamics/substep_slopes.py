"""The derivatives of one Runge-Kutta sub-step, stage by stage, from the last to the first.

With k_i = f(y_i, plane_i) the slopes of its four stages, and L_i what the state after it gains by k_i,

    L_i f_y  goes to what y_i is made of: the state, the parameters and the k_j before,
    L_i f_plane  to what the plane's angle is made of,    L_i f_p  to the parameters.

Backwards, as what comes out is a few states, and what goes in is those and several times as many
parameters: CasADi, and stage by stage forwards, would carry each of these through all.
"""

from functools import lru_cache

import casadi as ca

from host.compiled.over_rows import KEPT
from host.dynamics.form import Form, slope_of


class _Stages:
    """Stands for the slope f of the state: gives a symbol for each k_i, and notes where it is taken."""

    def __init__(self, form: Form) -> None:
        self.form = form
        self.symbols: list[ca.SX] = []
        self.taken: list[tuple[ca.SX, ...]] = []

    def __call__(self, *taken: ca.SX) -> ca.SX:
        self.taken.append(taken)
        self.symbols.append(ca.SX.sym("k", self.form.nx))
        return self.symbols[-1]


def substep_slopes(form: Form, x: ca.SX, p: ca.SX, drive: ca.SX, number: ca.SX) -> list[ca.SX]:
    """F_x (nx, nx) and F_p (nx, parameters) of sub-step `number` of a row, counted from 0."""
    stages = _Stages(form)
    after = form.substep(x, p, drive, number, stages)
    by_all = ca.vertcat(x, p)
    slopes = ca.jacobian(after, by_all)
    gains = [ca.jacobian(after, k) for k in stages.symbols]
    for stage in range(len(stages.symbols) - 1, -1, -1):
        y, _, plane, *_ = taken = stages.taken[stage]
        f_y, f_plane, f_p = _slopes_of_slope(form)(*taken)
        slopes += ca.horzcat(ca.SX(form.nx, form.nx), gains[stage] @ f_p)
        for value, gain in ((y, gains[stage] @ f_y), (plane, gains[stage] @ f_plane)):
            slopes += gain @ ca.jacobian(value, by_all)
            for before in range(stage):
                gains[before] += gain @ ca.jacobian(value, stages.symbols[before])
    values = [slope_of(form)(*taken) for taken in stages.taken]
    _, (slopes,) = ca.substitute_inplace(stages.symbols, values, [slopes])
    return [slopes[:, : form.nx], slopes[:, form.nx :]]


@lru_cache(KEPT)
def _slopes_of_slope(form: Form) -> ca.Function:
    """f_y (nx, nx), f_plane (nx,) and f_p (nx, parameters) of the slope f of the state."""
    y, p, drive = form.symbols()
    time, plane = ca.SX.sym("time"), ca.SX.sym("plane")
    f = slope_of(form)(y, time, plane, p, drive)
    slopes = ca.cse([ca.jacobian(f, by) for by in (y, plane, p)])
    return ca.Function("slopes", [y, time, plane, p, drive], slopes)
