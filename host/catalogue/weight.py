"""The net weight, from all that adds to it: it pulls a hull down, and a pitched one along its axis, too."""

import casadi as ca

from host.catalogue.switching import after
from host.dynamics.equations import Chain


def constant(c: Chain) -> ca.SX:
    """Of a vehicle that is not neutral; m/s^2, that is per heave mass, as all of these."""
    return c.p["c_w0"]


def compressed(c: Chain) -> ca.SX:
    """Of a hull or water that gives way with depth."""
    return c.p["c_wz"] * (c.zeta - c.p["neutral_depth"])


def ballast(c: Chain) -> ca.SX:
    """Of a change at one moment."""
    return c.p["c_wb"] * after(c, c.p["ballast_time"])


def trimmed(c: Chain) -> ca.SX:
    """Of an imperfect trim whose cause is not known yet: of no other is it as often."""
    return c.p["trim_heave"]


_PARTS = {"c_w0": constant, "c_wz": compressed, "c_wb": ballast, "trim_heave": trimmed}


def net_weight(c: Chain) -> ca.SX:
    """The sum of those that are there."""
    return sum((part(c) for name, part in _PARTS.items() if name in c.p), ca.SX(0))
