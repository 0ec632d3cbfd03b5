"""Fits of sets of effects, jointly with the base, to the recordings of one vehicle."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from host.catalogue import CATALOGUE, CHANGES, named, structure_of
from host.catalogue.moments import FIRST, LAST
from host.catalogue.nuisance import FREE_TRIM, PLANE_BEFORE, SPEED_CORRECTION, has_memory
from host.catalogue.unknown import SPANS
from host.diagnosis.fits.absence import one_step_without
from host.diagnosis.fits.charges import charged_bic
from host.diagnosis.fits.corrected_speed import SpeedReadings, speed_readings, strayed
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.first_guess import accelerations
from host.diagnosis.fits.shared_equations import in_shared_equations
from host.diagnosis.fits.starts import guess, idle, is_far, scanned, starts_again, starts_of
from host.diagnosis.fits.trims import HELD, trimmed
from host.diagnosis.fits.under_forces import climbed, likelihood
from host.diagnosis.recordings.spans import ALARM_LATE
from host.dynamics.equations import NAMES, Effect
from host.dynamics.propagate import LONGEST_SUBSTEP, Inputs, begun_at, inputs_of, longest_substep
from host.likelihood.fit import NO_WANDER, Fit
from host.likelihood.gauss_newton import Mask, Point
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.likelihood.output_error import annealed, free_run_cost, output_error
from host.likelihood.valleys import (
    other_valleys,
    plausibility,
    with_rivals,
)
from host.noise.drift import drifts_of, whitenings
from host.noise.noise_floor import noise_floor, resolution
from host.noise.speed_error import speed_errors
from host.recordings.recording import Array, Recording, mean_speed
from host.recordings.rounding import NO_STEPS, thinned

ALARM_EARLY = 30.0  # s, by which a moment that somebody names may lie before the change
# Enough to rank sets; those that count are polished.
FIRST_ITERATIONS, MOST_ITERATIONS, TOLERANCE = 4, 25, 0.2
PATIENT_ITERATIONS = 20  # from a point of another valley, which may lie far up its side
EXACT, SETTLED = 1e-3, 0.005  # of a log-likelihood, that an iteration of a polished fit may still gain
NOT_THERE = 1.2  # times the sensor noise that the set left elsewhere: it has ended in another valley
HOPELESS = 0.1  # of a log-likelihood per sample: a few iterations hardly lead to more
MADE_UP_FOR = 20.0  # of a log-likelihood, by fewer parameters or more usual ones
SLIGHT = 2e-3  # of the variance of all force: 4 % of it, about as much as any model is off
SURGE = {"speed_time": 10.0, "c_ud": 0.0, "c_uq": 0.0}
"""Coefficients of the surge equation, and what they are where nothing tells them."""
LINEAR = ("munk_moment", "actuator_lag", "heave_pitch_rate_coupling")
ROUGHLY = 1.0  # of a log-likelihood: a set does at least as well as with one member less


class Fitter:
    """All that the fits of one diagnosis share: recordings, noise floor, what is held, where fits start.

    known    an explanation of other stretches of the same vehicle; without one the base model is fitted
    steps    (2,) of rounding, where it rules pitch and depth
    thinned  the recordings for what takes errors for normal
    speed_errors  how those of a measured speed make depth drift, where that matters
    wander   (3, 2) of what else drifts (host.noise.drift), variances in units of white noise: as in `known`
    at_first  effects alone beside the root, as far as these were fitted before the search
    candidates  entries that are tried: what changes at one moment only after an alarm, or as `eligible` tells
    """

    def __init__(self, recordings: list[Recording], known: Explanation | None = None) -> None:
        self.floor = noise_floor(recordings)
        self.recordings = recordings
        self.speed_errors, self.steps = speed_errors(recordings, self.floor[1], resolution(recordings))
        self.wander = NO_WANDER if known is None else known.fit.relative_wander
        if self.wander.any():
            self.steps = NO_STEPS  # what drifts takes errors for normal, as a filter does
        self.thinned = thinned(recordings)
        self._told = thinned(recordings, self.steps)
        self._whitenings = [
            whitenings(*drifts_of(recording, error, self.wander))
            for recording, error in zip(self._told, self.speed_errors, strict=True)
        ]
        self.accelerations = accelerations(self.thinned)
        self.held = dict(HELD)
        if recordings[0].has_speed:
            self.held["u0"] = mean_speed(recordings)
            # Where the speed is measured its change is data, and there is nothing in it to estimate.
            self.held |= {"speed_step": 0.0, "speed_change_time": 0.0, "speed_settling": 0.0}
        else:
            self.held["ground_share"] = 0.0
        self.held |= dict.fromkeys(SPANS.values(), max(float(r.time[-1]) for r in recordings))
        self.held[FIRST] = min(float(r.time[0]) for r in recordings)
        self.held[LAST] = max(float(r.time[-1]) for r in recordings)
        self.candidates: tuple[Effect, ...] = CATALOGUE
        alarms = [alarm for recording in recordings for alarm in recording.alarms]
        if alarms:
            self.candidates += CHANGES
            self.held[FIRST] = max(self.held[FIRST], min(alarms) - ALARM_LATE)
            self.held[LAST] = min(self.held[LAST], max(alarms) + ALARM_EARLY)
        self._longest_substep = LONGEST_SUBSTEP
        self._inputs: dict[tuple[bool, bool], list[Inputs]] = {}  # by whether they hold earlier commands
        self.at_first: dict[Names, Explanation] = {}
        self.base = self._base() if known is None else known
        parameters = self.base.fit.parameters
        self._longest_substep = longest_substep(parameters, min(r.step for r in recordings))
        self.speed = float(parameters[NAMES.index("u0")])
        self.scales = {
            "": 1.0,
            "rudder": float(max(np.abs(r.rudder).max() for r in recordings)) or 1.0,
            "duration": float(recordings[-1].time[-1]),
            "depth": float(np.nanmean(np.concatenate([r.depth for r in recordings]))),
        }

    def _base(self) -> Explanation:
        held = {name: value for name, value in self.held.items() if name in NAMES}
        fit = fit_maximum_likelihood(self.recordings, held=held, noise_model="output_error")
        return self.explained(frozenset(), fit)

    @cached_property
    def root(self) -> Explanation:
        """The base with a free constant force and moment; see host.diagnosis.fits.trims."""
        return trimmed(self)

    @cached_property
    def linear(self) -> Explanation:
        """The root with what moves every hull with its plane, as far as that is linear."""
        hull = self.root
        for name in LINEAR:
            hull = self.grown(hull, name, [])
        return hull

    def excess(self, fit: Fit) -> float:
        """Sensor noise of a fit over the noise floor, in the worse channel: 1 where nothing is left."""
        return float(np.max(fit.noise[:2] / self.floor))

    def grown(
        self,
        parent: Explanation,
        name: str,
        values: list[Array],
        rival: Explanation | None = None,
        goal: Fit | None = None,
    ) -> Explanation:
        """The parent's set with one effect more, from the two most promising of its start values.

        And where the parent may be bent into another valley than the truth, from what needs no parent; where
        the end may lie in another, from other points.

        values  start values of the effect's parameters from elsewhere, beside its own probes
        rival   the parent's set with another effect that does the same work: a start there, too, as the
                coefficients of a parent without either may be bent into another valley
        goal    a fit: a search is given up where it would not get as far
        """
        starts = starts_of(self, parent, name, values, rival)
        if parent.fit.has_process_noise:  # no free run tells which start is good
            few = starts[:1] if rival is None else [starts[0], starts[-1]]
            return self.explained(parent.names | {name}, self.fitted(few, goal))
        fit = self.fitted(starts, goal)
        again = starts_again(self, parent, name, values, self.explained(parent.names | {name}, fit))
        others = [self.fitted([start], goal or fit, PATIENT_ITERATIONS) for start in again]
        fit = max([fit, *others], key=plausibility)
        if named(name).size_names and fit.log_likelihood < parent.fit.log_likelihood - ROUGHLY:
            fit = self.fitted([idle(starts[0], name)], goal)
        return self.explained(parent.names | {name}, fit)

    def shrunk(self, parent: Explanation, *members: str) -> Explanation:
        """The parent's set without some of its effects; not polished."""
        names = parent.names - {*members}
        start = self.point(names, parent)
        ahead = one_step_without(parent.fit, *map(named, members))
        if ahead is not None:
            known = dict(zip(parent.fit.structure.names, ahead[1].tolist(), strict=True))
            moved = replace(start, parameters=np.array([known[own] for own in start.structure.names]))
            start = max(moved, start, key=self._likelihood)
        starts = [start]
        if not parent.fit.has_process_noise and is_far(self, parent):
            starts.append(guess(self, start, names))
        fit = self.fitted(starts)
        if not np.isfinite(fit.log_likelihood):  # without them it runs away from where they held it
            fit = self.fitted([guess(self, start, names)])
        return self.explained(names, fit)

    def reduced(self, explanation: Explanation, names: Names) -> Explanation:
        """The set with these members only."""
        return self.explained(names, self.carried_on(self.point(names, explanation)))

    def polished(self, explanation: Explanation, tolerance: float = SETTLED) -> Explanation:
        """The same set, its fit carried on until next to nothing more is gained."""
        fit = explanation.fit
        start = Point(fit.structure, fit.parameters, fit.initial, fit.levels)
        return self.explained(explanation.names, self.carried_on(start, tolerance))

    def across(self, explanation: Explanation) -> Explanation:
        """The same set in the likeliest valley of all, with the others that this recording cannot rule out.

        With random forces it stays where it is: the valleys of a free run are not those of a filter.
        """
        fit = explanation.fit
        if fit.has_process_noise:
            return explanation
        ends = other_valleys(fit, self.inputs(explanation.names))
        return self.explained(explanation.names, with_rivals(fit, ends))

    def entered(self, start: Point, rival: Explanation) -> Explanation:
        """The rival's set begun in another valley, given up where it would not get as far there."""
        return self.explained(rival.names, self.fitted([start], rival.fit, PATIENT_ITERATIONS))

    def refitted(self, explanation: Explanation) -> Explanation:
        """A set fitted to other stretches, fitted to these."""
        start = self.begun(explanation)
        fit = self.fitted([start])
        if self.excess(fit) > NOT_THERE * self.excess(explanation.fit):
            inputs = self.inputs(explanation.names, for_filter=True)
            moved = annealed(start, inputs, fit.free, self.accelerations)
            fit = self.fitted([start, moved])
        return self.polished(self.explained(explanation.names, fit), EXACT)

    def begun(self, explanation: Explanation) -> Point:
        """What was fitted to other stretches, with the initial states of these, all coefficients held.

        Until those are found coefficients would run away: a moment would go beyond the recordings, where it
        makes no difference any more, and never come back.
        """
        start = self.carried_over(explanation)
        held = np.zeros(start.parameters.size, dtype=bool)
        inputs = self.inputs(explanation.names)
        fit = output_error(start, inputs, held, FIRST_ITERATIONS, TOLERANCE)
        return scanned(self, Point(fit.structure, fit.parameters, fit.initial, fit.noise))

    def carried_over(self, explanation: Explanation) -> Point:
        """The coefficients of a fit to other stretches, with states such as these begin with."""
        structure, values = structure_of(explanation.names), explanation.fit.parameters.copy()
        for name, value in self.held_in(explanation.names).items():
            if name in structure.names:
                values[structure.names.index(name)] = value
        initial = [
            begun_at(first_known(recording.pitch), first_known(recording.depth))
            for recording in self.recordings
        ]
        return Point(structure, values, initial, np.array([*self.floor, 0.0, 0.0]))

    def held_in(self, names: Names) -> dict[str, float]:
        """What is held in a set: of a measured speed the surge equation, too, unless it corrects that."""
        is_taken = self.recordings[0].has_speed and SPEED_CORRECTION.name not in names
        return SURGE | self.held if is_taken else self.held

    def tools_beside(self, names: Names) -> tuple[str, ...]:
        """What a set needs that is no physics: the plane's angle before, and errors of a measured speed."""
        remembers = any(has_memory(named(name)) for name in names)
        is_astray = "speed_loss" in names and any(error is not None for error in self.speed_errors)
        return (PLANE_BEFORE.name,) * remembers + (SPEED_CORRECTION.name,) * is_astray

    def free(self, names: Names) -> Mask:
        """Which parameters of a set are estimated."""
        held = {*self.held_in(names)}
        if FREE_TRIM.name in names:
            held.add("neutral_depth")  # which would do the same
        return np.array([name not in held for name in structure_of(names).names])

    def free_parameters(self, names: Names) -> int:
        """How many coefficients the set adds to the base."""
        return int(self.free(names).sum() - self.free(frozenset()).sum())

    def bic(self, fit: Fit, names: Names) -> float:
        """Of a fit with the charges of its effects; see host.diagnosis.fits.charges."""
        longest = max(self.recordings, key=lambda recording: recording.duration)
        charged = charged_bic(fit, names, self.free_parameters(names), longest)
        if SPEED_CORRECTION.name not in names:
            return charged
        return charged + strayed(fit, self.inputs(names), self._speed_readings)

    @cached_property
    def _speed_readings(self) -> list[SpeedReadings]:
        return [speed_readings(recording) for recording in self.recordings]

    def inputs(self, names: Names, for_filter: bool = False) -> list[Inputs]:
        """What drives the set's equations over each recording.

        A filter takes errors for normal: of rounded readings it gets no more than they tell.
        """
        structure, steps = structure_of(names), NO_STEPS if for_filter else self.steps
        kind = structure.needs_lags, for_filter
        if kind not in self._inputs:
            rows = zip(self.thinned if for_filter else self._told, self._whitenings, strict=True)
            self._inputs[kind] = [
                inputs_of(recording, structure, self._longest_substep, steps, whitening)
                for recording, whitening in rows
            ]
        shared = in_shared_equations(names)
        return [one.of(structure, shared) for one in self._inputs[kind]]

    def explained(self, names: Names, fit: Fit) -> Explanation:
        """The fit of a set, with what the set is charged."""
        if self.wander.any() and not fit.has_process_noise:
            fit = fit.with_wander(self.wander)
        return Explanation(names, fit, self.bic(fit, names))

    def point(
        self, names: Names, parent: Explanation, added: str | None = None, probe: Array | None = None
    ) -> Point:
        """A start for a set: the parent's values, and for an effect that it has not, those of a probe."""
        fit = parent.fit
        known = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
        if added is not None and probe is not None:
            known |= {p.name: v for p, v in zip(named(added).parameters, probe.tolist(), strict=True)}
        known |= {name: value for name, value in self.held_in(names).items() if name in known}
        structure = structure_of(names)
        return Point(structure, np.array([known[name] for name in structure.names]), fit.initial, fit.levels)

    def fitted(self, starts: list[Point], rival: Fit | None = None, first: int = FIRST_ITERATIONS) -> Fit:
        """Goes `first` steps from every start, and on from the best where it may get as far as the rival."""
        structure = starts[0].structure
        names = structure.effect_names
        inputs, free = self.inputs(names), self.free(names)
        least = -np.inf if rival is None else rival.log_likelihood
        if starts[0].noise[2:].any():
            ends = [climbed(self, start, True, least - MADE_UP_FOR, TOLERANCE) for start in starts]
            return max(ends, key=lambda fit: fit.log_likelihood)
        hopeless = least - (0.0 if rival is None else HOPELESS * rival.samples)
        fits = [output_error(start, inputs, free, first, TOLERANCE, hopeless) for start in starts]
        best = max(fits, key=lambda fit: fit.log_likelihood)
        if best.log_likelihood < hopeless:
            return best
        on = Point(structure, best.parameters, best.initial, best.noise)
        return output_error(on, inputs, free, MOST_ITERATIONS, TOLERANCE, least - MADE_UP_FOR)

    def _likelihood(self, point: Point) -> float:
        """The log-likelihood at a point, but for a constant, by a filter where the point has forces."""
        if point.noise[2:].any():
            return likelihood(self, point)
        names = point.structure.effect_names
        return -free_run_cost(point, self.inputs(names))

    def carried_on(self, start: Point, tolerance: float = SETTLED) -> Fit:
        """A fit from this point to its end, under random forces or waves where the point has them."""
        if start.noise[2:].any():
            return climbed(self, start, holds_noise=False)
        names = start.structure.effect_names
        return output_error(start, self.inputs(names), self.free(names), tolerance=tolerance)

    def are_slight(self, noise: Array) -> bool:
        """Whether random forces of these levels (4,) leave no stable hull far away.

        Larger ones excuse so much that how the filter's gain moves with the parameters hardly counts.
        """
        return bool((noise[2:4] < SLIGHT * np.square(self.accelerations)).all())


def first_known(values: Array) -> float:
    """The first that was measured; 0 where none was."""
    return next((float(value) for value in values if np.isfinite(value)), 0.0)
