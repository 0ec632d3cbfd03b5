"""Smooth stand-ins for what happens at once, so that the time of it has a derivative."""

import casadi as ca

RISE = 0.4  # s, of a change that in truth takes no time; shorter than any response of the vehicle


def after(time: ca.SX, moment: ca.SX) -> ca.SX:
    """0 before the moment, 1 after it."""
    return 0.5 * (1 + ca.tanh((time - moment) / RISE))


def limited(value: ca.SX, bound: ca.SX) -> ca.SX:
    """The value kept within +-bound."""
    return ca.fmax(-bound, ca.fmin(bound, value))
