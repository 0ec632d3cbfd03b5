"""Maximum likelihood under waves: random forces in heave and pitch that swing about a frequency.

    f'' = -2 d s f' - s^2 f + white noise,   added to w', and another such to q'

with frequency s and damping d common to both and estimated, as are the two densities (a shaping filter of
second order: Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, ch. 8). A filter that takes
waves for white forces follows the measurements in the wrong band, and its parameters are biased.
"""

from dataclasses import replace

import casadi as ca
import numpy as np

from host.ascent import ascend
from host.equations import Chain, Effect, Parameter, Structure
from host.filter_error import RandomForces
from host.fit import Fit, finished, run_away
from host.gauss_newton import Mask, Point
from host.kalman import KalmanPass, kalman_pass
from host.propagate import Inputs
from host.recording import Array

SLOWEST = 0.2  # rad/s; slower is current
BROADEST = 0.4  # of a sea: 0.26 fits the waves of a fully developed one, 0.1 those of a young one
QUICKEST = 4.0  # rad/s, where the search begins at most: in what white forces leave there may be no peak
FIRST_DAMPING = 0.2


def _swing(channel: str) -> tuple[Effect, Effect]:
    """A force and its rate, as states beside the vehicle's."""
    force, rate = f"{channel}_wave", f"{channel}_wave_rate"

    def push(chain: Chain) -> None:
        setattr(chain, channel, getattr(chain, channel) + chain.extra[force])
        chain.rates[force] = chain.extra[rate]
        s, d = chain.p["wave_frequency"], chain.p["wave_damping"]
        chain.rates[rate] = -(s**2) * chain.extra[force] - 2.0 * d * s * chain.extra[rate]

    def part(state: str) -> Effect:
        return Effect(
            name=state,
            slot="environment",
            parameters=SHAPE if state == "heave_wave" else (),
            sentence="waves push",
            equation="f'' = -2 d s f' - s^2 f",
            manoeuvre="",
            probes=(),
            force=push if state == force else None,
            state=state,
            initial=lambda _: ca.SX(0),
        )

    return part(force), part(rate)


SHAPE = (
    Parameter(name="wave_frequency", unit="rad/s", lower=SLOWEST, upper=100.0, meaning="of the waves met"),
    Parameter(name="wave_damping", unit="", lower=0.02, upper=BROADEST, meaning="width of their band"),
)
WAVES = (*_swing("heave"), *_swing("pitch"))


class WaveForces(RandomForces):
    """Levels: variances of pitch, depth; densities that drive heave's, pitch's waves; frequency, damping."""

    def __init__(self, inputs: list[Inputs]) -> None:
        super().__init__(inputs)
        step = float(np.median(np.concatenate([one.drive[3] for one in inputs])))
        self.least = np.array([1e-12, 1e-10, 1e-16, 1e-16, SLOWEST, SHAPE[1].lower])
        self.most = np.array([1e3, 1e6, 1e3, 1e3, 0.7 * np.pi / step, SHAPE[1].upper])

    def passes(self, point: Point) -> list[KalmanPass]:
        """The Kalman filter over each recording, begun in the middle of a sea."""
        s, d = point.noise[4:]
        at = [point.structure.names.index(parameter.name) for parameter in SHAPE]
        parameters = point.parameters.copy()
        parameters[at] = s, d
        states = point.structure.states
        spread = np.zeros(len(states))
        for channel, density in zip(("heave", "pitch"), point.noise[2:4], strict=True):
            spread[states.index(f"{channel}_wave")] = density / (4.0 * d * s**3)
            spread[states.index(f"{channel}_wave_rate")] = density / (4.0 * d * s)
        return [
            kalman_pass(parameters, x0, point.noise[:4], one, spread)
            for x0, one in zip(point.initial, self.inputs, strict=True)
        ]

    def whitened(self, point: Point, passes: list[KalmanPass]) -> list[tuple[Array, Array]]:
        """Sensitivities at fixed gain."""
        at = [point.structure.names.index(parameter.name) for parameter in SHAPE]
        parameters = point.parameters.copy()
        parameters[at] = point.noise[4:]
        return super().whitened(replace(point, parameters=parameters), passes)


def wave_forces(start: Fit, inputs: list[Inputs], most_steps: int = 25) -> Fit:
    """Climbs from a fit with white forces to the likeliest parameters, noise and waves."""
    s, d = _busiest(start, inputs), FIRST_DAMPING
    densities = start.noise[2:] * 4.0 * d**2 * s**4
    levels = np.array([*start.noise[:2], *densities, s, d])
    point = Point(start.structure, start.parameters, start.initial, levels)
    return wave_forces_from(point, inputs, start.free, most_steps)


def wave_forces_from(
    point: Point, inputs: list[Inputs], free: Mask, most_steps: int = 25, holds_noise: bool = False
) -> Fit:
    """The same from any point with waves in its noise (6,); or the parameters alone, in these very waves."""
    model, wider = _among(point, inputs)
    end, used, converged = ascend(
        wider, model, np.concatenate([free, [False, False]]), most_steps, holds_noise
    )
    if not np.isfinite(end.likelihood):
        return run_away(point, inputs, free)
    white = _less_shape(model.whitened(end.point, end.passes), free.size)
    noise = end.point.noise
    # What is told as the force's density is that of slow motion, where the vehicle answers.
    told = np.concatenate([noise[:2], noise[2:4] / noise[4] ** 4])
    here = Point(point.structure, end.point.parameters[: free.size], end.point.initial, told)
    return replace(finished(here, white, inputs, free, end.likelihood, used, converged), waves=noise[4:])


def whitened_among_waves(point: Point, inputs: list[Inputs]) -> list[tuple[Array, Array]]:
    """Innovations over their deviation (2, N) and their sensitivities, waves in the point's noise (6,)."""
    model, wider = _among(point, inputs)
    return _less_shape(model.whitened(wider, model.passes(wider)), point.parameters.size)


def _among(point: Point, inputs: list[Inputs]) -> tuple[WaveForces, Point]:
    structure = Structure((*point.structure.effects, *WAVES))
    model = WaveForces([replace(one, structure=structure) for one in inputs])
    levels = np.clip(point.noise, model.least, model.most)
    return model, Point(structure, np.concatenate([point.parameters, levels[4:]]), point.initial, levels)


def _less_shape(white: list[tuple[Array, Array]], count: int) -> list[tuple[Array, Array]]:
    """Without the sensitivities by the waves' own two parameters, which follow those of the vehicle."""
    return [(e, np.delete(S, [count, count + 1], axis=1)) for e, S in white]


def _busiest(start: Fit, inputs: list[Inputs]) -> float:
    """Frequency, rad/s, at which white forces leave most in the innovations of pitch."""
    longest = int(np.argmax([white.shape[1] for white in start.whitened]))
    innovations = np.nan_to_num(start.whitened[longest][0])
    power = np.abs(np.fft.rfft(innovations * np.hanning(innovations.size))) ** 2
    power = np.convolve(power, np.ones(9) / 9.0, mode="same")
    step = float(np.median(inputs[longest].drive[3]))
    frequencies = 2.0 * np.pi * np.fft.rfftfreq(innovations.size, step)
    in_band = (frequencies > 2.0 * SLOWEST) & (frequencies < QUICKEST)
    return float(frequencies[np.argmax(np.where(in_band, power, 0.0))])
