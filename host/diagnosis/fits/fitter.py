"""Fits of sets of effects, jointly with the base, to the recordings of one vehicle."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from host.catalogue import named, structure_of
from host.catalogue.kin import AS_A_LEVER, moving_alike
from host.compiled.side_by_side import side_by_side
from host.diagnosis.fits.absence import one_step_without
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.setting import Setting
from host.diagnosis.fits.starts import guess, idle, is_far, scanned, starts_again, starts_of
from host.diagnosis.fits.trims import trimmed
from host.diagnosis.fits.under_forces import climbed, likelihood
from host.dynamics.equations import NAMES
from host.dynamics.propagate import begun_at, longest_substep
from host.likelihood.fit import NO_WANDER, Fit
from host.likelihood.gauss_newton import Point
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.likelihood.output_error import annealed, free_run_cost, output_error
from host.likelihood.valleys import other_valleys, plausibility, with_rivals
from host.recordings.recording import Array, Recording

# Enough to rank sets; those that count are polished.
FIRST_ITERATIONS, MOST_ITERATIONS, TOLERANCE = 4, 25, 0.2
PATIENT_ITERATIONS = 20  # from a point of another valley, which may lie far up its side
EXACT, SETTLED = 1e-3, 0.005  # of a log-likelihood, that an iteration of a polished fit may still gain
NOT_THERE = 1.2  # times the sensor noise that the set left elsewhere: it has ended in another valley
HOPELESS = 0.1  # of a log-likelihood per sample: a few iterations hardly lead to more
MADE_UP_FOR = 20.0  # of a log-likelihood, by fewer parameters or more usual ones
LINEAR = ("munk_moment", "actuator_lag", "heave_pitch_rate_coupling")
ROUGHLY = 1.0  # of a log-likelihood: a set does at least as well as with one member less


class Fitter(Setting):
    """All fits of one diagnosis, and where they start.

    known    an explanation of other stretches of the same vehicle; without one the base model is fitted
    at_first  effects alone beside the root, as far as these were fitted before the search
    """

    def __init__(self, recordings: list[Recording], known: Explanation | None = None) -> None:
        super().__init__(recordings, NO_WANDER if known is None else known.fit.relative_wander)
        self.at_first: dict[Names, Explanation] = {}
        self.base = self._base() if known is None else known
        parameters = self.base.fit.parameters
        self.longest_substep = longest_substep(parameters, min(r.step for r in recordings))
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
            start = max(moved, start, key=self.likelihood)
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
        return scanned(self, fit.end)

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

    def point(
        self, names: Names, parent: Explanation, added: str | None = None, probe: Array | None = None
    ) -> Point:
        """A start for a set: the parent's values, and for an effect that it has not, those of a probe."""
        fit = parent.fit
        known = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
        if added is not None and probe is not None:
            if added in AS_A_LEVER:
                known = moving_alike(known, added, float(probe[0]))
            known |= {p.name: v for p, v in zip(named(added).parameters, probe.tolist(), strict=True)}
        known |= {name: value for name, value in self.held_in(names).items() if name in known}
        structure = structure_of(names)
        values = structure.clipped(np.array([known[name] for name in structure.names]))
        return Point(structure, values, fit.initial, fit.levels)

    def fitted(self, starts: list[Point], rival: Fit | None = None, first: int = FIRST_ITERATIONS) -> Fit:
        """Goes `first` steps from every start, and on from the best where it may get as far as the rival."""
        structure = starts[0].structure
        names = structure.effect_names
        inputs, free = self.inputs(names), self.free(names)
        least = -np.inf if rival is None else rival.log_likelihood
        if starts[0].noise[2:].any():
            ends = side_by_side(lambda one: climbed(self, one, True, least - MADE_UP_FOR, TOLERANCE), starts)
            return max(ends, key=lambda fit: fit.log_likelihood)
        hopeless = least - (0.0 if rival is None else HOPELESS * rival.samples)
        fits = side_by_side(
            lambda start: output_error(start, inputs, free, first, TOLERANCE, hopeless), starts
        )
        best = max(fits, key=lambda fit: fit.log_likelihood)
        if best.log_likelihood < hopeless:
            return best
        on = Point(structure, best.parameters, best.initial, best.noise)
        return output_error(on, inputs, free, MOST_ITERATIONS, TOLERANCE, least - MADE_UP_FOR)

    def likelihood(self, point: Point) -> float:
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


def first_known(values: Array) -> float:
    """The first that was measured; 0 where none was."""
    return next((float(value) for value in values if np.isfinite(value)), 0.0)
