"""The derivatives of one Runge-Kutta sub-step, stage by stage.

With k_i = f(y_i, plane_i) the slopes of its four stages, all derivatives follow from those of f there:

    dk_i = f_y dy_i + f_plane dplane_i + f_p,    dy_i and dplane_i by the slopes of the stages before.

CasADi would carry each direction through every operation of the sub-step, which are half as many more.
"""

from functools import lru_cache

import casadi as ca

from host.compiled.over_rows import KEPT
from host.dynamics.propagate import Form, slope_of


class _Stages:
    """Stands for the slope f of the state: gives a symbol for each k_i, and notes its value and slopes."""

    def __init__(self, form: Form, x: ca.SX, p: ca.SX) -> None:
        self.form, self.all = form, ca.vertcat(x, p)
        self.symbols: list[ca.SX] = []
        self.values: list[ca.SX] = []
        self.slopes: list[ca.SX] = []

    def __call__(self, y: ca.SX, time: ca.SX, plane: ca.SX, p: ca.SX, drive: ca.SX) -> ca.SX:
        f_y, f_plane, f_p = _slopes_of_slope(self.form)(y, time, plane, p, drive)
        own = ca.horzcat(ca.SX(self.form.nx, self.form.nx), f_p)
        self.slopes.append(f_y @ self.total(y) + f_plane @ self.total(plane) + own)
        self.values.append(slope_of(self.form)(y, time, plane, p, drive))
        self.symbols.append(ca.SX.sym("k", self.form.nx))
        return self.symbols[-1]

    def total(self, value: ca.SX) -> ca.SX:
        """How a value changes with the state and the parameters, also by way of the stages so far."""
        slopes = ca.jacobian(value, self.all)
        for k, by_all in zip(self.symbols, self.slopes, strict=True):
            slopes += ca.jacobian(value, k) @ by_all
        return slopes


def substep_slopes(form: Form, x: ca.SX, p: ca.SX, drive: ca.SX, number: ca.SX) -> list[ca.SX]:
    """F_x (nx, nx) and F_p (nx, parameters) of sub-step `number` of a row, counted from 0."""
    stages = _Stages(form, x, p)
    slopes = stages.total(form.substep(x, p, drive, number, stages))
    _, (slopes,) = ca.substitute_inplace(stages.symbols, stages.values, [slopes])
    return [slopes[:, : form.nx], slopes[:, form.nx :]]


@lru_cache(KEPT)
def _slopes_of_slope(form: Form) -> ca.Function:
    """f_y (nx, nx), f_plane (nx,) and f_p (nx, parameters) of the slope f of the state."""
    y, p, drive = form.symbols()
    time, plane = ca.SX.sym("time"), ca.SX.sym("plane")
    f = slope_of(form)(y, time, plane, p, drive)
    slopes = ca.cse([ca.jacobian(f, by) for by in (y, plane, p)])
    return ca.Function("slopes", [y, time, plane, p, drive], slopes)
