"""Smooth stand-ins for what happens at once, so that the time of it has a derivative."""

import casadi as ca

from host.dynamics.equations import Chain


def after(c: Chain, moment: ca.SX) -> ca.SX:
    """0 before the moment, 1 after it, risen within about a row; a plane is held for a sub-step."""
    middle = c.time + 0.5 * c.substep
    return 0.5 * (1 + ca.tanh(2.0 * (middle - moment) / c.interval))


def limited(value: ca.SX, bound: ca.SX) -> ca.SX:
    """The value kept within +-bound."""
    return ca.fmax(-bound, ca.fmin(bound, value))
