"""Maximum likelihood among waves: water that carries the vehicle up and down, and turns it, as it swings.

    f'' = -2 d s f' - s^2 f + white noise,    g'' likewise
    zeta' = ... + e f,    q' = a2 (q - e (turn f' + g)) + ...,    e = exp(-s^2 (zeta - zeta_mean) / g)

with the frequency s at which waves are met, damping d, and what of the water's rotation keeps step with its
slope (turn) estimated, as are the densities that drive f and g (a shaping filter of second order: Fossen,
Handbook of Marine Craft Hydrodynamics and Motion Control, ch. 8; they decay with depth as in deep water, met
from the side: Faltinsen, Sea Loads on Ships and Offshore Structures, ch. 2). The velocity f is what pressure
shows of the water's. One wave does both to depth and pitch: taken for two that know nothing of one another, a
vehicle that hardly couples the two is likelier than the true one. A filter that takes waves for white forces
follows the measurements in the wrong band, and its parameters are biased. As the water turns the vehicle by
its pitch damping, rotation and not moment is estimated: a moment would have to grow with a2, a3 and b2 where
only their ratios are well known, and few steps would not get there.
"""

from dataclasses import replace
from itertools import product
from typing import Any

import casadi as ca
import numpy as np

from host.catalogue.environment import WAVE_PERIODS
from host.catalogue.gravity import GRAVITY
from host.dynamics.equations import Chain, Effect, Parameter, Structure
from host.dynamics.propagate import Inputs
from host.likelihood.ascent import SETTLED, ascend, place
from host.likelihood.filter_error import RandomForces, whitened_by
from host.likelihood.fit import Fit, finished, run_away
from host.likelihood.gauss_newton import Mask, Point
from host.likelihood.kalman import KalmanPass, kalman_pass
from host.likelihood.valleys import A2, with_usual_heave
from host.recordings.recording import Array

SLOWEST = 0.2  # rad/s; slower is current
BROADEST = 0.4  # of a sea: 0.26 fits the waves of a fully developed one, 0.1 those of a young one
MOST_TURN = (
    4.0  # s/m, of turning over the water's acceleration: deep water gives s / g, simulated seas came to 1.1
)
SHOWN = 0.3  # of the depth's noise, that a swing exceeds which shows within a hundred rows
FIRST_DAMPING = 0.1
DAMPINGS = (0.02, 0.05)  # to begin with where the innovations swing: weak waves show in a narrow band only
FREQUENCIES = np.geomspace(0.3, 4.0, 10)  # rad/s, to begin with; each is within the band of the next
IN_BAND = 10.0  # times the density of the white forces
SWINGS = np.array([[0.3, 0.3], [0.3, 0.01], [0.01, 0.3]])  # of depth and pitch, times the sensors' noise
NEAR = 100.0  # of a log-likelihood below the best, in the same waves, from where it is worth going on
MOST_STEPS = 25
FIRST_STEPS = 8  # from starts other than the first, of which most lead nowhere

SHAPE = (
    Parameter(name="wave_frequency", unit="rad/s", lower=SLOWEST, upper=100.0, meaning="of the waves met"),
    Parameter(name="wave_damping", unit="", lower=0.02, upper=BROADEST, meaning="width of their band"),
    Parameter(name="wave_turn", unit="s/m", lower=-1e3, upper=1e3, meaning="rotation that keeps step"),
    Parameter(name="wave_depth", unit="m", lower=-1e4, upper=1e5, meaning="where their motion is told"),
)
AT_DEPTH = len(SHAPE) - 1


def _swing(chain: Chain, name: str) -> None:
    s, d = chain.p["wave_frequency"], chain.p["wave_damping"]
    value, rate = chain.extra[name], chain.extra[f"{name}_rate"]
    chain.rates[name] = rate
    chain.rates[f"{name}_rate"] = -(s**2) * value - 2.0 * d * s * rate


def _reach(chain: Chain) -> ca.SX:
    return ca.exp(-(chain.p["wave_frequency"] ** 2) / GRAVITY * (chain.zeta - chain.p["wave_depth"]))


def _carry(chain: Chain) -> None:
    reach = _reach(chain)
    chain.climb += reach * chain.extra["wave"]
    chain.pitch -= reach * chain.p["a2"] * chain.p["wave_turn"] * chain.extra["wave_rate"]
    _swing(chain, "wave")


def _turn(chain: Chain) -> None:
    chain.pitch -= _reach(chain) * chain.p["a2"] * chain.extra["turning_wave"]
    _swing(chain, "turning_wave")


def _part(state: str, **terms: Any) -> Effect:
    described = {"sentence": "waves carry", "equation": "f'' = -2 d s f' - s^2 f", "manoeuvre": ""}
    own: dict[str, Any] = {"parameters": (), "probes": (), "initial": lambda _: ca.SX(0)}
    return Effect(name=state, slot="environment", state=state, **(described | own | terms))


WAVES = (
    _part("wave", parameters=SHAPE, force=_carry),
    _part("wave_rate"),
    _part("turning_wave", force=_turn),
    _part("turning_wave_rate"),
)


class InWaves(RandomForces):
    """Levels: variances of pitch, depth; frequency, damping, turn; densities that drive f and g."""

    signed = np.array([False] * 4 + [True] + [False] * 2)

    def __init__(self, inputs: list[Inputs]) -> None:
        super().__init__(inputs)
        step = float(np.median(np.concatenate([one.drive[3] for one in inputs])))
        lower, upper = np.array([[each.lower, each.upper] for each in SHAPE[:AT_DEPTH]]).T
        upper[0] = 0.7 * np.pi / step
        self.least = np.array([1e-12, 1e-10, *lower, 1e-16, 1e-16])
        self.most = np.array([1e3, 1e6, *upper, 1e3, 1e3])

    def passes(self, point: Point) -> list[KalmanPass]:
        """The Kalman filter over each recording, begun in the middle of a sea."""
        s, d = point.noise[2:4]
        states = point.structure.states
        spread = np.zeros(len(states))
        for name, density in zip(("wave", "turning_wave"), point.noise[5:], strict=True):
            spread[states.index(name)] = density / (4.0 * d * s**3)
            spread[states.index(f"{name}_rate")] = density / (4.0 * d * s)
        noise = point.noise[[0, 1, 5, 6]]
        return [
            kalman_pass(_shaped(point), x0, noise, one, spread)
            for x0, one in zip(point.initial, self.inputs, strict=True)
        ]

    def whitened(self, point: Point, passes: list[KalmanPass]) -> list[tuple[Array, Array]]:
        """Sensitivities at fixed gain."""
        return super().whitened(replace(point, parameters=_shaped(point)), passes)


def in_waves(start: Fit, inputs: list[Inputs], most_steps: int = MOST_STEPS) -> Fit:
    """Climbs from a fit with white forces to the likeliest parameters, noise and waves.

    Its `noise` keeps the densities of the white forces, which stand for the waves in a predictor.
    """
    fit = in_waves_from(_first(start, inputs), inputs, start.free, most_steps)
    return replace(fit, noise=np.array([*fit.noise[:2], *start.noise[2:]]))


def in_waves_from(
    point: Point,
    inputs: list[Inputs],
    free: Mask,
    most_steps: int = MOST_STEPS,
    holds_noise: bool = False,
    least: float = -np.inf,
    settled: float = SETTLED,
) -> Fit:
    """The same from any point with waves in its noise (7,); or the parameters alone, in these very waves.

    least    a log-likelihood: given up where it would not get there
    settled  of the log-likelihood: a step that gains less is the last

    A full climb goes from another heave damping, too: waves hide which valley is the vehicle's.
    """
    model, wider = _among(point, inputs)
    wider_free = np.concatenate([free, np.zeros(len(SHAPE), dtype=bool)])
    # Waves excuse much: how the gain moves with the parameters counts for little while sets are compared.
    best, used, converged = ascend(
        wider, model, wider_free, most_steps, holds_noise, holds_noise, least, settled
    )
    if most_steps > FIRST_STEPS and not holds_noise:
        starts = with_usual_heave(best.point)
        ends = [
            ascend(one, model, wider_free, FIRST_STEPS, holds_noise=True, holds_gain=True)[0]
            for one in starts
        ]
        other = max(ends, key=lambda end: end.likelihood)
        if other.likelihood > best.likelihood - NEAR:
            other, more, has_settled = ascend(other.point, model, wider_free, most_steps)
            if other.likelihood > best.likelihood:
                best, used, converged = other, used + more, has_settled
    here = Point(point.structure, best.point.parameters[: free.size], best.point.initial, best.point.noise)
    if not np.isfinite(best.likelihood):
        return run_away(here, inputs, free)
    white = _less_shape(model.whitened(best.point, best.passes), free.size)
    told = here.with_noise(here.noise[[0, 1, 5, 6]])
    fit = finished(told, white, inputs, free, best.likelihood, used, converged)
    return replace(fit, waves=here.noise[2:])


def is_sea(fit: Fit) -> bool:
    """Whether a fit's waves have a period of surface waves, in a band no broader than a sea's.

    And whether the water rises as much as it must to turn the vehicle so, where the depth would show that.
    A fit that ran away has none: its frequency is 0.
    """
    frequency, damping = fit.waves[:2]
    shortest, longest = WAVE_PERIODS
    if not (2.0 * np.pi / longest < frequency < 2.0 * np.pi / shortest and damping < BROADEST):
        return False
    rising, turning = np.sqrt(_variances(fit))
    must_rise = turning / (MOST_TURN * frequency)
    return bool(must_rise < max(rising, SHOWN * frequency * np.sqrt(fit.noise[1])))


def _variances(fit: Fit) -> Array:
    """Of the water's rising, (m/s)^2, and turning, (rad/s)^2, that a fit's waves are."""
    s, d, turn, *densities = fit.waves
    rising, turning = np.array(densities) / (4.0 * d * s**3)
    return np.array([rising, (turn * s) ** 2 * rising + turning])


def mean_moment(fit: Fit) -> float:
    """The most that waves turn a vehicle which swings with them on the mean, rad/s^2: |a2| r^2 / s.

    With r the deviation of the water's turning. In waves of number k the water that sinks by z turns by
    k s z, and where it is deeper it turns less by k: on the mean by k r z = r^2 / s, nose down in seas from
    ahead and up in such from astern (second order, as the drift forces of Faltinsen, Sea Loads, ch. 5).
    """
    return float(abs(fit.parameters[A2]) * _variances(fit)[1] / fit.waves[0])


def passes_in_waves(point: Point, inputs: list[Inputs]) -> list[KalmanPass]:
    """The filter over each recording, waves in the point's noise (7,)."""
    model, wider = _among(point, inputs)
    return model.passes(wider)


def whitened_in_waves(
    point: Point, inputs: list[Inputs], steering: list[KalmanPass] | None = None, states: tuple[str, ...] = ()
) -> list[tuple[Array, Array]]:
    """Innovations over their deviation (2, N) and their sensitivities, waves in the point's noise (7,).

    steering  another filter in these waves, whose gains do; `states` are its vehicle's own
    """
    model, wider = _among(point, inputs)
    if steering is None:
        white = model.whitened(wider, model.passes(wider))
    else:
        shaped = replace(wider, parameters=_shaped(wider))
        white = whitened_by(shaped, model.inputs, steering, (*states, *(wave.name for wave in WAVES)))
    return _less_shape(white, point.parameters.size)


def _among(point: Point, inputs: list[Inputs]) -> tuple[InWaves, Point]:
    """The noise model, and the point with the states and the shape of the waves beside the vehicle's own."""
    structure = Structure((*point.structure.effects, *WAVES))
    shared = [None if one.shared is None else Structure((*one.shared.effects, *WAVES)) for one in inputs]
    model = InWaves([one.of(structure, wider) for one, wider in zip(inputs, shared, strict=True)])
    shape = np.zeros(len(SHAPE))
    shape[AT_DEPTH] = np.mean([np.mean(one.measured[1][one.present[1] > 0.0]) for one in inputs])
    levels = np.clip(point.noise, model.least, model.most)
    return model, Point(structure, np.concatenate([point.parameters, shape]), point.initial, levels)


def _shaped(point: Point) -> Array:
    """The parameters with the shape of the waves that the noise levels tell."""
    parameters = point.parameters.copy()
    parameters[-len(SHAPE) : -1] = point.noise[2:5]
    return parameters


def _less_shape(white: list[tuple[Array, Array]], count: int) -> list[tuple[Array, Array]]:
    """Without the sensitivities by the waves' own shape, which follow those of the vehicle."""
    return [(e, np.delete(S, range(count, count + len(SHAPE)), axis=1)) for e, S in white]


def _first(start: Fit, inputs: list[Inputs]) -> Point:
    """The likeliest of waves as strong as the white forces in their band, or of such as swing a sensor.

    Of weak waves white forces tell nothing: most of what those do is a slow drift, which is not there.
    """
    a2, points = start.parameters[A2], []
    bands = [(FIRST_DAMPING, s) for s in FREQUENCIES] + list(product(DAMPINGS, _swinging(start, inputs)))
    for d, s in bands:
        # In their band they push harder than white forces, which push everywhere; climb swings with w' / s.
        as_forces = IN_BAND * start.noise[2:] * 4.0 * d**2 * s**4 / np.array([s**2, a2**2])
        # Depth swings by f / s and pitch by a2 g / s, whose variances are density / (4 d s^3).
        as_noise = 4.0 * d * s**5 * start.noise[1::-1] / np.array([1.0, a2**2])
        for driving in (as_forces, *(swings**2 * as_noise for swings in SWINGS)):
            levels = np.array([*start.noise[:2], s, d, 0.0, *driving])
            points.append(Point(start.structure, start.parameters, start.initial, levels))
    return max(points, key=lambda point: likelihood_in_waves(point, inputs))


def _swinging(start: Fit, inputs: list[Inputs]) -> list[float]:
    """Where pitch and depth swing most of all frequencies of waves, rad/s, by the longest innovations."""
    white, one = max(zip(start.whitened, inputs, strict=True), key=lambda pair: pair[0].shape[1])
    step = one.drive[4, 1] - one.drive[4, 0]
    frequency = 2.0 * np.pi * np.fft.rfftfreq(white.shape[1], step)
    shortest, longest = WAVE_PERIODS
    in_band = (2.0 * np.pi / longest < frequency) & (frequency < 2.0 * np.pi / shortest)
    if not in_band.any():
        return []
    width = 2 * int(DAMPINGS[0] / frequency[1]) + 1  # a band as wide as the damping makes it at 1 rad/s
    power = np.abs(np.fft.rfft(np.nan_to_num(white), axis=1)) ** 2
    smooth = np.array([np.convolve(channel, np.ones(width), mode="same") for channel in power])
    return [float(s) for s in frequency[in_band][np.argmax(smooth[:, in_band], axis=1)]]


def likelihood_in_waves(point: Point, inputs: list[Inputs]) -> float:
    """The log-likelihood at a point with waves in its noise (7,); -inf where it leaves the numbers."""
    model, wider = _among(point, inputs)
    return place(wider, model).likelihood
