"""Moving water."""

import casadi as ca

from host.equations import Chain, Effect, Parameter

GRAVITY = 9.80665  # m/s^2


def _current(c: Chain) -> None:
    c.climb += c.p["current"]


def _oscillation(c: Chain, name: str) -> ca.SX:
    phase = 2 * ca.pi * c.time / c.p[f"{name}_period"]
    return c.p[f"{name}_sine"] * ca.sin(phase) + c.p[f"{name}_cosine"] * ca.cos(phase)


def _internal_wave(c: Chain) -> None:
    c.climb += _oscillation(c, "internal")


def _surface_waves(c: Chain) -> None:
    number = (2 * ca.pi / c.p["wave_period"]) ** 2 / GRAVITY  # deep water
    c.climb += _oscillation(c, "wave") * ca.exp(-number * c.zeta)


EFFECTS = (
    Effect(
        name="vertical_current",
        slot="environment",
        parameters=(
            Parameter(name="current", unit="m/s", lower=-3, upper=3, meaning="water, down positive"),
        ),
        sentence="The water itself moves up or down at a constant rate.",
        equation="zeta' = ... + current",
        manoeuvre="a change of speed: buoyancy answers to it, a current does not",
        probes=((0.0,),),
        force=_current,
    ),
    Effect(
        name="internal_wave",
        slot="environment",
        parameters=(
            Parameter(name="internal_sine", unit="m/s", lower=-3, upper=3, meaning="vertical water motion"),
            Parameter(name="internal_cosine", unit="m/s", lower=-3, upper=3, meaning="vertical water motion"),
            Parameter(name="internal_period", unit="s", lower=15, upper=20000, meaning="period"),
        ),
        sentence="The water heaves slowly up and down (an internal wave).",
        equation="zeta' = ... + internal_sine sin(2 pi t/T) + internal_cosine cos(2 pi t/T)",
        manoeuvre="a straight level run of several periods with the planes fixed",
        probes=((1e-3, 1e-3, 100.0),),
        periods=(15.0, 20000.0),
        force=_internal_wave,
    ),
    Effect(
        name="surface_waves",
        slot="environment",
        parameters=(
            Parameter(
                name="wave_sine", unit="m/s", lower=-20, upper=20, meaning="orbital speed at the surface"
            ),
            Parameter(
                name="wave_cosine", unit="m/s", lower=-20, upper=20, meaning="orbital speed at the surface"
            ),
            Parameter(name="wave_period", unit="s", lower=2, upper=20, meaning="period"),
        ),
        sentence="Surface waves carry the vehicle up and down, less so the deeper it is.",
        equation="zeta' = ... + exp(-k zeta) (wave_sine sin ot + wave_cosine cos ot), o = 2 pi/T, k = o^2/g",
        manoeuvre="level runs at two depths, the shallower one within a few metres of the surface",
        probes=((0.01, 0.01, 7.0),),
        periods=(2.0, 20.0),
        force=_surface_waves,
    ),
)
