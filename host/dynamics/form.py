"""The equations over one row, as CasADi's functions are built of them: sub-steps of classical Runge-Kutta.

What follows with a lag that may be shorter than any sub-step is carried on exactly.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca

from host.compiled.over_rows import KEPT
from host.dynamics.equations import Chain, Structure


@dataclass(frozen=True)
class Form:
    """What a CasADi function depends on: one is built for each form and kept."""

    structure: Structure
    substeps: int
    drives: int

    @property
    def nx(self) -> int:
        return len(self.structure.states)

    @property
    def np(self) -> int:
        return len(self.structure.parameters)

    def symbols(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        return ca.SX.sym("x", self.nx), ca.SX.sym("p", self.np), ca.SX.sym("drive", self.drives)

    def step(self, x: ca.SX, p: ca.SX, drive: ca.SX) -> list[ca.SX]:
        """The state after each sub-step; after the last it is that one row later."""
        after = []
        for k in range(self.substeps):
            x = self.substep(x, p, drive, k)
            after.append(x)
        return after

    def substep(
        self, x: ca.SX, p: ca.SX, drive: ca.SX, k: int | ca.SX, slope: Callable[..., ca.SX] | None = None
    ) -> ca.SX:
        """The state after sub-step k of a row, counted from 0; `slope` may stand for `slope_of`."""
        h = drive[3] / self.substeps
        states = self.structure.states
        slope = slope or slope_of(self)
        time = drive[4] + k * h
        at_start = self.structure.chain(x, p, drive, time)
        moved = self.structure.actuate(at_start, h)
        plane, half = at_start.plane, at_start.change / 2
        k1 = slope(x, time, plane - half, p, drive)
        k2 = slope(x + h / 2 * k1, time + h / 2, plane, p, drive)
        k3 = slope(x + h / 2 * k2, time + h / 2, plane, p, drive)
        k4 = slope(x + h * k3, time + h, plane + half, p, drive)
        before, x = x, x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        for name, value in moved.items():
            x[states.index(name)] = value
        for name, followed, lag in self.structure.followers:
            own, time_constant = states.index(name), p[self.structure.names.index(lag)]
            start, slope_then = _followed(self, followed)(before, k1, p, drive)
            end, slope_now = _followed(self, followed)(x, k4, p, drive)
            bend = (slope_now - slope_then) / (2 * h)
            x[own] = _behind(before[own], start, end, bend, time_constant, h)
        return x

    def outputs(self, x: ca.SX, p: ca.SX, drive: ca.SX) -> ca.SX:
        return self.structure.outputs(self.structure.chain(x, p, drive, drive[4]))


def _behind(y: ca.SX, start: ca.SX, end: ca.SX, bend: ca.SX, lag: ca.SX, h: ca.SX) -> ca.SX:
    """y after h where lag y' = u - y and u goes from start to end on a parabola with u'' / 2 = bend.

    Exact, as a lag may be shorter than any sub-step: Runge-Kutta would take it for a far longer one.
    """
    slope = (end - start) / h - bend * h  # at the start
    settled_then = start - lag * slope + 2 * lag**2 * bend
    settled_now = end - lag * (slope + 2 * bend * h) + 2 * lag**2 * bend
    return settled_now + (y - settled_then) * ca.exp(-h / lag)


@lru_cache(KEPT)
def slope_of(form: Form) -> ca.Function:
    """x' for a plane angle that is held; as a function of its own, as inlining it is quicker than tracing."""
    x, p, drive = form.symbols()
    time, plane = ca.SX.sym("time"), ca.SX.sym("plane")
    chain = form.structure.chain(x, p, drive, time)
    chain.plane = plane
    return ca.Function("slope", [x, time, plane, p, drive], [form.structure.derivative(chain)])


@lru_cache(KEPT)
def _followed(form: Form, of: Callable[[Chain], ca.SX]) -> ca.Function:
    """What a sensor follows with a lag, and its rate where the state moves so."""
    x, p, drive = form.symbols()
    rates, value = ca.SX.sym("rates", form.nx), of(form.structure.chain(x, p, drive, drive[4]))
    return ca.Function("followed", [x, rates, p, drive], [value, ca.jtimes(value, x, rates)])
