"""Which manoeuvre tells an effect from its twin, by predicted information, confirmed in simulation.

On a manoeuvre the named model flies and its twin re-adjusts as far as the recording leaves it free; what it
still misses, over the sensors' noise, is the chi2 that the manoeuvre would bring between the two:

    min over d of |e - S d|^2 + d' M d,   e, S  whitened difference and sensitivities on the manoeuvre,
                                          M     information of the recording that exists already
"""

from dataclasses import dataclass, replace

import numpy as np

from host.catalogue import BY_NAME
from host.catalogue.kin import both_come
from host.diagnosis.diagnose import Diagnosis
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import TWIN_MARGIN
from host.diagnosis.manoeuvres import Manoeuvre, library
from host.diagnosis.search.search import Progress
from host.dynamics.equations import NAMES, Effect, Slot
from host.dynamics.propagate import LONGEST_SUBSTEP, Inputs, begun_at, free_run, inputs_of
from host.likelihood.filter_error import whitened_innovations
from host.likelihood.gauss_newton import GaussNewton, Point
from host.likelihood.output_error import residuals_at
from host.recordings.recording import Array, Recording, mean_speed

SEPARATES = 2.0 * TWIN_MARGIN  # predicted chi2 that leaves no doubt after chance had its share
MOST_FLOWN = 2  # manoeuvres, in simulation
LEAST_CONFIRMED = 0.25 * SEPARATES  # of BIC: chance may take the rest
MOST_CONFIRMED = 20_000  # rows; longer flights take long to fit
LONGEST_FLIGHT = 1800.0  # s, of repeats of a manoeuvre that says little
KNOWN_SPEED = 0.02  # m/s, deviation of a good speed sensor
LONGEST_BESIDE = 300.0  # s of the recording that the confirmation is fitted beside
ELSE: dict[Slot, str] = {
    "environment": "another speed: forces on the hull change with it, the water does not",
    "actuator": "a sensor of the plane's own angle",
    "sensor": "a second sensor, or the mounting measured",
    "surge": "the speed recorded",
    "heave": "another speed, with which the two change differently",
    "pitch": "another speed, with which the two change differently",
    "kinematics": "the speed recorded, at larger angles",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Separation:
    """How to tell one effect from one twin.

    manoeuvre   None where none of the library at this speed separates the two
    predicted   chi2 between the two explanations on the best manoeuvre, the twin re-adjusted
    confirmed   BIC by which the named model wins when it flew the manoeuvre in simulation and both are fitted
                to recording and manoeuvre; NaN where that was not tried
    difference  (2, N) pitch and depth of the named model less the re-adjusted twin, over the sensors' noise
    """

    effect: str
    twin: str
    manoeuvre: Manoeuvre | None
    sentence: str
    predicted: float
    confirmed: float
    difference: Array


def separations(found: Diagnosis, on_progress: Progress = lambda _: None) -> list[Separation]:
    """One for each named effect and each of its twins."""
    fitter = Fitter(found.recordings, known=found.extended)
    separated = []
    for effect in found.effects:
        if effect.name not in found.extended.names:
            continue
        without = found.extended
        if effect.twins:
            without = fitter.polished(fitter.shrunk(found.extended, effect.name))
        for twin in effect.twins:
            on_progress(f"manoeuvre to tell {effect.name} from {twin}")
            rival = fitter.polished(fitter.grown(without, twin, []))
            separated.append(_separation(found, effect.name, twin, rival))
    return separated


def _separation(found: Diagnosis, name: str, twin: str, rival: Explanation) -> Separation:
    named = found.extended
    # What came at one moment was there before and after in either case.
    advice = _else(name, twin) if both_come(BY_NAME[name], BY_NAME[twin]) else BY_NAME[name].manoeuvre
    base = Separation(
        effect=name,
        twin=twin,
        manoeuvre=None,
        sentence=f"to tell {_title(name)} from {_title(twin)}: {advice}",
        predicted=float("nan"),
        confirmed=float("nan"),
        difference=np.empty((2, 0)),
    )
    if any(_happens_once(BY_NAME[one]) for one in (name, twin)):
        return base
    flights = [_Flight(found, named, rival, one) for one in library(found.recordings, named.fit.parameters)]
    flights = [flight for flight in flights if np.isfinite(flight.predicted)]
    if not flights:
        return base
    flights.sort(key=lambda flight: -flight.predicted)
    for flight in flights[:MOST_FLOWN]:
        long = _long_enough(found, flight, named, rival)
        if long is None:
            break
        if not np.isfinite(long.predicted):
            continue  # repeated, it turns the vehicle over
        predicted, rows = long.predicted, long.manoeuvre.rudder.size
        confirmed = long.confirmed() if rows <= MOST_CONFIRMED else float("nan")
        told = replace(base, manoeuvre=long.manoeuvre, predicted=predicted, confirmed=confirmed)
        if not confirmed < LEAST_CONFIRMED:
            sentence = _fly(long.manoeuvre, name, twin, predicted, confirmed)
            return replace(told, sentence=sentence, difference=long.difference())
        base = replace(
            told, manoeuvre=None, sentence=_in_vain(long.manoeuvre, name, twin, predicted, confirmed)
        )
    if np.isfinite(base.confirmed):
        return base
    return replace(base, predicted=flights[0].predicted, sentence=_none(found, flights, name, twin))


def _long_enough(
    found: Diagnosis, flight: "_Flight", named: Explanation, rival: Explanation
) -> "_Flight | None":
    """The flight repeated until it separates; None where that takes too long."""
    lacking = SEPARATES / max(flight.predicted, 1e-9)
    # A longer flight also lets the twin re-adjust further: a quarter more than in proportion.
    repeats = int(np.ceil(min(1.25 * lacking, 1e6))) if lacking > 1.0 else 1
    if repeats * flight.manoeuvre.duration > LONGEST_FLIGHT:
        return None
    if repeats == 1:
        return flight
    longer = replace(flight.manoeuvre, rudder=np.tile(flight.manoeuvre.rudder, repeats))
    return _Flight(found, named, rival, longer)


def _fly(flown: Manoeuvre, name: str, twin: str, predicted: float, confirmed: float) -> str:
    time = flown.duration
    lasting = f"{time:.0f} s" if time < 150.0 else f"{time / 60.0:.0f} min"
    gave = f"; flown in simulation it gave {confirmed:.0f} of BIC" if np.isfinite(confirmed) else ""
    told = f"it tells {_title(name)} from {_title(twin)} (predicted chi2 {predicted:.0f}{gave})"
    return f"fly {flown.words}, for {lasting}: {told}"


def _in_vain(flown: Manoeuvre, name: str, twin: str, predicted: float, confirmed: float) -> str:
    return (
        f"no manoeuvre is sure to tell {_title(name)} from {_title(twin)}: {flown.words} promises to "
        f"(predicted chi2 {predicted:.0f}), but flown in simulation it gave {confirmed:.0f} of BIC"
    )


def _happens_once(effect: Effect) -> bool:
    """Whether it belongs to the hour of the recording: another flight would not meet it again."""
    return effect.periods is not None or "duration" in effect.scales


def _none(found: Diagnosis, flights: list["_Flight"], name: str, twin: str) -> str:
    """What else than a plane movement at this speed would help."""
    begin = f"no plane movement at this speed tells {_title(name)} from {_title(twin)}"
    if not found.recordings[0].has_speed:
        best = max(flights, key=lambda flight: flight.with_speed)
        if best.with_speed > SEPARATES:
            return (
                f"{begin}; with the speed recorded, {best.manoeuvre.words} would, within "
                f"{best.manoeuvre.duration:.0f} s (predicted chi2 {best.with_speed:.0f})"
            )
    return f"{begin}; what would: {_else(name, twin)}"


def _else(name: str, twin: str) -> str:
    """What other measurement would tell."""
    slots = [BY_NAME[one].slot for one in (name, twin)]
    strange: list[Slot] = ["environment", "sensor", "actuator", "surge", "kinematics", "heave", "pitch"]
    return ELSE[min(slots, key=strange.index)]


class _Flight:
    """The named model on one manoeuvre, and its twin beside it."""

    def __init__(self, found: Diagnosis, named: Explanation, rival: Explanation, flown: Manoeuvre) -> None:
        self.found, self.named, self.rival, self.manoeuvre = found, named, rival, flown
        longest = max(found.recordings, key=lambda recording: recording.duration)
        depth = float(np.nanmean(longest.depth))
        self.recording = _blank(flown, longest)
        self.inputs = inputs_of(self.recording, named.fit.structure, LONGEST_SUBSTEP)
        fit = named.fit
        with np.errstate(over="ignore", invalid="ignore"):
            outputs = free_run(fit.parameters, begun_at(0.0, depth), self.inputs).outputs
            # Deep enough to stay in the water.
            self.depth = depth + max(0.0, float(np.nanmin(longest.depth)) - float(np.min(outputs[1])))
            start = begun_at(0.0, self.depth)
            self.outputs = free_run(fit.parameters, start, self.inputs).outputs
        self._point = Point(rival.fit.structure, rival.fit.parameters, [start], fit.noise)
        self.predicted, self.with_speed = float("nan"), float("nan")
        self._step: GaussNewton | None = None
        if np.isfinite(self.outputs).all() and np.abs(self.outputs[0]).max() < 0.5 * np.pi:
            self._predict()

    def _predict(self) -> None:
        free = self.rival.fit.free
        inputs = self._seen_by_rival()
        with np.errstate(over="ignore", invalid="ignore"):
            if self.named.fit.has_process_noise:
                white = whitened_innovations(self._point, [inputs])
            else:
                white, _ = residuals_at(self._point, [inputs])
            cost = sum(float(np.sum(e**2)) for e, _ in white)
            if not np.isfinite(cost) or not all(np.isfinite(S).all() for _, S in white):
                return
            step = GaussNewton(white, self._point, free)
            step.H += self.rival.fit.information[np.ix_(free, free)]
            self._step = step
            self.predicted = max(step.predicted_cost(cost), 0.0)
            index = NAMES.index("u0")
            if free[index]:  # a measured speed is one more datum
                own = int(free[:index].sum())
                off = float(self.named.fit.parameters[index] - self.rival.fit.parameters[index])
                with_speed = GaussNewton(white, self._point, free)
                with_speed.H += self.rival.fit.information[np.ix_(free, free)]
                with_speed.H[own, own] += KNOWN_SPEED**-2.0
                with_speed.g[own] += off / KNOWN_SPEED**2
                self.with_speed = max(with_speed.predicted_cost(cost + (off / KNOWN_SPEED) ** 2), 0.0)

    def _seen_by_rival(self) -> Inputs:
        inputs = inputs_of(self.recording, self.rival.fit.structure, LONGEST_SUBSTEP)
        return replace(inputs, measured=self.outputs, present=np.ones_like(self.outputs))

    def difference(self) -> Array:
        """Named model less re-adjusted twin, over the sensors' noise, pitch and depth (2, N)."""
        if self._step is None:
            return np.empty((2, 0))
        adjusted = self._step.trial(1e-9)
        run = free_run(adjusted.parameters, adjusted.initial[0], self._seen_by_rival()).outputs
        return np.asarray((self.outputs - run) / np.sqrt(self.named.fit.noise[:2])[:, None])

    def confirmed(self) -> float:
        """BIC between the two once the named model has flown the manoeuvre with sensor noise."""
        if self.named.fit.has_process_noise or self.named.fit.has_coloured_noise:
            return float("nan")  # a sea is not flown here
        rng = np.random.default_rng(0)
        noise = np.sqrt(self.named.fit.noise[:2])[:, None] * rng.standard_normal(self.outputs.shape)
        pitch, depth = self.outputs + noise
        flown = replace(self.recording, pitch=pitch, depth=depth)
        beside: list[Recording] = []
        left = LONGEST_BESIDE
        for recording in self.found.recordings:
            if left > 0.0:
                beside.append(recording.between(recording.time[0], recording.time[0] + left))
                left -= recording.duration
        fitter = Fitter([*beside, flown], known=self.named)
        return fitter.refitted(self.rival).bic - fitter.refitted(self.named).bic


def _blank(flown: Manoeuvre, like: Recording) -> Recording:
    """The manoeuvre as a recording of which nothing but plane and speed is known yet."""
    rows = flown.rudder.size
    nan = np.full(rows, np.nan)
    return replace(
        like,
        name=flown.name,
        time=np.asarray(np.arange(rows) * flown.step),
        depth=nan,
        pitch=nan,
        pitch_rate=nan,
        speed=np.full(rows, mean_speed([like])) if like.has_speed else nan,
        rudder=flown.rudder,
        plane=None,
        plane_doubt=None,
        plane_moved=None,
        step=flown.step,
    )


def _title(name: str) -> str:
    return name.replace("_", " ")
