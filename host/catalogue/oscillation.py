"""What swings with a period of its own: a sine and a cosine, so that size and phase are linear."""

import casadi as ca

from host.dynamics.equations import Chain, Parameter


def oscillation(c: Chain, name: str) -> ca.SX:
    """name_sine sin(2 pi t/T) + name_cosine cos(2 pi t/T), T = name_period."""
    phase = 2 * ca.pi * c.time / c.p[f"{name}_period"]
    return c.p[f"{name}_sine"] * ca.sin(phase) + c.p[f"{name}_cosine"] * ca.cos(phase)


def oscillation_parameters(
    name: str, unit: str, largest: float, periods: tuple[float, float], meaning: str
) -> tuple[Parameter, ...]:
    """Its sine, cosine (within +-largest) and period (s, within `periods`)."""
    return (
        Parameter(name=f"{name}_sine", unit=unit, lower=-largest, upper=largest, meaning=meaning),
        Parameter(name=f"{name}_cosine", unit=unit, lower=-largest, upper=largest, meaning=meaning),
        Parameter(name=f"{name}_period", unit="s", lower=periods[0], upper=periods[1], meaning="period"),
    )
