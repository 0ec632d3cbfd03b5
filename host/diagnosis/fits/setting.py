"""What all fits of one diagnosis share: recordings, noise floor, what is held, what drives the equations."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from host.catalogue import CATALOGUE, CHANGES, NEAR_THE_SURFACE, named, structure_of
from host.catalogue.changes import SPEED_CHANGES
from host.catalogue.moments import FIRST, LAST
from host.catalogue.nuisance import FREE_TRIM, PLANE_BEFORE, SPEED_CORRECTION, has_memory
from host.catalogue.unknown import DEEPEST, FORMS, IN_LAYERS, SHALLOWEST, SPANS
from host.diagnosis.fits.charges import charged_bic
from host.diagnosis.fits.corrected_speed import SpeedReadings, speed_readings, strayed
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.first_guess import accelerations
from host.diagnosis.fits.shared_equations import in_shared_equations
from host.diagnosis.fits.trims import HELD
from host.diagnosis.recordings.spans import ALARM_LATE
from host.dynamics.equations import Effect
from host.dynamics.propagate import LONGEST_SUBSTEP, Inputs, inputs_of
from host.likelihood.fit import NO_WANDER, Fit
from host.likelihood.gauss_newton import Mask
from host.noise.drift import drifts_of, whitenings
from host.noise.noise_floor import noise_floor, resolution
from host.noise.speed_error import speed_errors
from host.noise.unseen_plane import unseen_plane
from host.recordings.recording import Array, Recording, mean_speed
from host.recordings.rounding import NO_STEPS, thinned

ALARM_EARLY = 30.0  # s, by which a moment that somebody names may lie before the change
SLIGHT = 2e-3  # of the variance of all force: 4 % of it, about as much as any model is off
SHALLOW = 4.0  # m; the surface pulls at a hull within a few of its diameters
DIVE = 5.0  # m; over less, what goes with the depth hardly differs from what goes with anything
SURGE = {"speed_time": 10.0, "c_ud": 0.0, "c_uq": 0.0}
"""Coefficients of the surge equation, and what they are where nothing tells them."""


class Setting:
    """The recordings of one vehicle, and what is known before any set is fitted to them.

    steps    (2,) of rounding, where it rules pitch and depth
    thinned  the recordings for what takes errors for normal
    speed_errors  how those of a measured speed make depth drift, where that matters
    wander   (3, 2) of what else drifts (host.noise.drift), variances in units of white noise
    held     parameters that are not estimated, and their values
    forms    of unknown physics that are tried
    candidates  entries that are tried: what changes at one moment only after an alarm, or as `eligible` tells
    """

    def __init__(self, recordings: list[Recording], wander: Array = NO_WANDER) -> None:
        self.floor = noise_floor(recordings)
        self.recordings = recordings
        self.speed_errors, self.steps = speed_errors(recordings, self.floor[1], resolution(recordings))
        self.wander = wander
        if self.wander.any() or any(recording.plane_doubt is not None for recording in recordings):
            self.steps = NO_STEPS  # what drifts, or was not seen, takes errors for normal, as a filter does
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
            own = (parameter.name for name in SPEED_CHANGES for parameter in named(name).parameters)
            self.held |= dict.fromkeys(own, 0.0)
        else:
            self.held["ground_share"] = 0.0
        self.held |= dict.fromkeys(SPANS.values(), max(float(r.time[-1]) for r in recordings))
        self.held[FIRST] = min(float(r.time[0]) for r in recordings)
        self.held[LAST] = max(float(r.time[-1]) for r in recordings)
        self.candidates: tuple[Effect, ...] = CATALOGUE
        depths = np.concatenate([recording.depth for recording in recordings])
        top, bottom = float(np.nanmin(depths)), float(np.nanmax(depths))
        self.held |= dict.fromkeys(SHALLOWEST.values(), top) | dict.fromkeys(DEEPEST.values(), bottom)
        self.forms = (
            FORMS if bottom - top > DIVE else tuple(one for one in FORMS if one.name not in IN_LAYERS)
        )
        if top < SHALLOW:
            self.candidates += NEAR_THE_SURFACE
        alarms = [alarm for recording in recordings for alarm in recording.alarms]
        if alarms:
            self.candidates += CHANGES
            self.held[FIRST] = max(self.held[FIRST], min(alarms) - ALARM_LATE)
            self.held[LAST] = min(self.held[LAST], max(alarms) + ALARM_EARLY)
        self.longest_substep = LONGEST_SUBSTEP
        self._inputs: dict[tuple[bool, bool], list[Inputs]] = {}  # by whether they hold earlier commands

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
    def _speed_readings(self) -> list[SpeedReadings | None]:
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
                replace(
                    inputs_of(recording, structure, self.longest_substep, steps, whitening),
                    unseen=unseen_plane(recording.plane_doubt, _present(recording), self.floor),
                )
                for recording, whitening in rows
            ]
        shared = in_shared_equations(names)
        return [one.of(structure, shared) for one in self._inputs[kind]]

    def explained(self, names: Names, fit: Fit) -> Explanation:
        """The fit of a set, with what the set is charged."""
        if self.wander.any() and not fit.has_process_noise:
            fit = fit.with_wander(self.wander)
        return Explanation(names, fit, self.bic(fit, names))

    def excess(self, fit: Fit) -> float:
        """Sensor noise of a fit over the noise floor, in the worse channel: 1 where nothing is left."""
        return float(np.max(fit.noise[:2] / self.floor))

    def are_slight(self, noise: Array) -> bool:
        """Whether random forces of these levels (4,) leave no stable hull far away.

        Larger ones excuse so much that how the filter's gain moves with the parameters hardly counts.
        """
        return bool((noise[2:4] < SLIGHT * np.square(self.accelerations)).all())


def _present(recording: Recording) -> Array:
    return np.isfinite(np.vstack([recording.pitch, recording.depth])).astype(float)
