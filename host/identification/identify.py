"""Bench identification: recordings of one vehicle to its model, with what is known and what is not."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite
from typing import Literal, NamedTuple

import numpy as np

from host.dynamics.equations import NAMES
from host.identification.identifiability import ambiguity, open_combinations, undetermined
from host.identification.identify_car import ESTIMATED, car_least_squares, run_estimator
from host.identification.model import VehicleModel, model_of
from host.identification.predict import Prediction, predict
from host.identification.uncertainty import covariance, covariance_within
from host.likelihood.fit import Fit
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.noise.whiteness import is_white
from host.recordings.consistency import check_signs, units_note
from host.recordings.outliers import without_outliers
from host.recordings.plane_between_rows import ways_between
from host.recordings.recording import Array, Recording
from host.vehicle import Vehicle

Method = Literal["car", "mils", "robust", "ml"]
METHODS: tuple[Method, ...] = ("car", "mils", "robust", "ml")
SHORTEST_TO_SPLIT = 40.0  # s; below it a held-out part would leave too little to learn from
HELD_OUT_SHARE = 0.3
FEWEST_ROWS = 10  # of a stretch to learn from
CLEARLY = 6.0  # of BIC: odds of 20 to 1
UNKNOWN = 1e4  # of a standard deviation in SI: the recording says nothing at all

CLEARLY_POSITIVE = 4.0  # deviations

Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification:
    """What was learnt.

    predictions   free run of the model on every recording it learnt from
    held_out      free run, over the last 30 %, of a second model that learnt from the first 70 % only;
                  None where the recordings are too short to be divided
    undetermined  names of parameters that the recordings leave open
    notes         sentences a person should read
    history       estimates after each sample, name -> (N,), for recursive methods
    """

    method: Method
    model: VehicleModel
    recordings: list[Recording]
    predictions: list[Prediction]
    held_out: list[Prediction] | None
    undetermined: list[str]
    notes: list[str]
    fit: Fit | None
    history: dict[str, Array] | None


class Learnt(NamedTuple):
    """A model, the fit that made it, and the estimates over time, as far as the method has them."""

    model: VehicleModel
    fit: Fit | None
    history: dict[str, Array] | None

    @property
    def has_waves(self) -> bool:
        return self.fit is not None and bool(self.fit.waves.any())

    @property
    def bic(self) -> float:
        """Of the fit; infinite without one."""
        return inf if self.fit is None else self.fit.bic


def identify(
    recordings: list[Recording],
    vehicle: Vehicle,
    method: Method = "ml",
    on_progress: Progress = lambda _: None,
) -> Identification:
    """Identifies one vehicle from its recordings, jointly, by the named method (default: most accurate).

    Spikes are left out first, of what is learnt from and of what judges. Method ml asks the motion whether
    the plane held its angles between rows or moved on; for the others, which a vehicle runs on its own
    commands, it held them.

    Raises RecordingError with one line where depth and pitch have opposite signs.
    """
    recordings, others = without_outliers(recordings), []
    check_signs(recordings)
    told = units_note(recordings)
    if method == "ml":
        recordings, *others = _between_rows(recordings, on_progress)
    model, fit, history = learnt = _learn(recordings, vehicle, method, on_progress)
    for other in others if learnt.has_waves else []:
        # Waves hide from a free run what the plane did.
        again = _learn(other, vehicle, method, on_progress)
        if again.bic < learnt.bic - CLEARLY:
            recordings, (model, fit, history) = other, again
    held_out = None
    if sum(recording.duration for recording in recordings) >= SHORTEST_TO_SPLIT:
        on_progress("held-out check")
        held_out = _held_out(recordings, vehicle, method)
    return Identification(
        method=method,
        model=model,
        recordings=recordings,
        predictions=[predict(model, recording) for recording in recordings if _can_predict(recording)],
        held_out=held_out,
        undetermined=_open(model, fit),
        notes=[*_notes(fit, method), *_on_the_plane(model), *([told] if told else [])],
        fit=fit,
        history=history,
    )


def _between_rows(recordings: list[Recording], on_progress: Progress) -> list[list[Recording]]:
    """The recordings with the plane taken to hold its angles, and to move on evenly: the likelier first."""
    held, *others = ways_between(recordings)
    if not others:
        return [held]
    on_progress("the plane between rows")
    held_bic, *bics = (
        fit_maximum_likelihood(each, noise_model="output_error").bic for each in (held, *others)
    )
    moving = others[int(np.argmin(bics))]
    return [moving, held] if min(bics) < held_bic - CLEARLY else [held, moving]


def _learn(recordings: list[Recording], vehicle: Vehicle, method: Method, on_progress: Progress) -> Learnt:
    if method == "ml":
        fit = fit_maximum_likelihood(recordings, on_progress=on_progress)
        std = np.sqrt(np.diag(covariance(fit)))
        std[std > UNKNOWN] = np.inf
        values = dict(zip(NAMES, fit.parameters.tolist(), strict=True))
        deviations = dict(zip(NAMES, std.tolist(), strict=True))
        model = model_of(recordings, vehicle.name, method, values, deviations, fit.noise, wander=fit.wander)
        return Learnt(model, fit, None)
    on_progress("sample by sample" if method == "robust" else "regression on CAR rows")
    if method == "car":
        values, stds = car_least_squares(recordings, vehicle)
        return Learnt(model_of(recordings, vehicle.name, method, values, stds), None, None)
    values, stds, history = run_estimator(recordings, vehicle, method)
    effects = None
    if "c_wq" in values:
        c_wq = {"value": values.pop("c_wq"), "std": stds.pop("c_wq"), "unit": "m/s"}
        effects = [{"name": "heave_pitch_rate_coupling", "parameters": {"c_wq": c_wq}}]
    model = model_of(recordings, vehicle.name, method, values, stds, effects=effects)
    return Learnt(model, None, history)


def _held_out(recordings: list[Recording], vehicle: Vehicle, method: Method) -> list[Prediction] | None:
    """Learns from the first part and predicts the rest: whole recordings where there are several."""
    if len(recordings) >= 3:
        kept = max(1, round(len(recordings) * HELD_OUT_SHARE))
        learn, test = recordings[:-kept], recordings[-kept:]
    else:
        ends = [recording.time[0] + (1.0 - HELD_OUT_SHARE) * recording.duration for recording in recordings]
        learn = [r.between(-np.inf, end) for r, end in zip(recordings, ends, strict=True)]
        test = [r.between(end, np.inf) for r, end in zip(recordings, ends, strict=True)]
    test = [recording for recording in test if _can_predict(recording)]
    learn = [recording for recording in learn if recording.time.size >= FEWEST_ROWS]
    if not test or sum(recording.time.size for recording in learn) < 50:
        return None
    model, _, _ = _learn(learn, vehicle, method, lambda _: None)
    return [predict(model, recording) for recording in test]


def _can_predict(recording: Recording) -> bool:
    """A free run needs somewhere to start: pitch and depth within the first 5 s."""
    opening = recording.between(recording.time[0], recording.time[0] + 5.0)
    return bool(np.isfinite(opening.pitch).any() and np.isfinite(opening.depth).any())


def _open(model: VehicleModel, fit: Fit | None) -> list[str]:
    if model.provenance["method"] == "robust":
        values, stds = (np.array([table[name] for name in NAMES]) for table in (model.values, model.std))
        if not np.isfinite(values).all():
            return list(ESTIMATED)
        return undetermined(values, np.diag(stds**2), stds > 0.0)
    if fit is None:
        return [name for name in ESTIMATED if not isfinite(model.values[name])]
    return undetermined(fit.parameters, covariance(fit), fit.free)


def _notes(fit: Fit | None, method: Method) -> list[str]:
    notes: list[str] = []
    if method == "robust":
        return ["As the vehicle learns: each sample was used once, in order. Method ml is more accurate."]
    if fit is None:
        notes.append(
            f"Method {method} regresses on measured signals: with sensor noise its estimates are biased "
            "and its deviations too small. Use method ml for a trustworthy answer."
        )
        return notes
    if not fit.converged:
        notes.append("The search stopped before it had converged: treat the values with care.")
    if fit.has_process_noise:
        notes.append(
            "Forces that the linear model does not hold act on the vehicle (waves, current or physics left "
            "out): they were estimated as random force and moment, and the deviations include them."
        )
    if not all(is_white(e) for e in fit.whitened):
        notes.append(
            "The innovations are still coloured, so something systematic is left over; the deviations are "
            "corrected for it."
        )
    if fit.waves.any():
        frequency, damping = fit.waves[:2]
        notes.append(
            f"Waves carry the vehicle: met at {frequency:.2g} rad/s (every "
            f"{2.0 * np.pi / frequency:.2g} s), damping ratio {damping:.2g}."
        )
    if fit.has_coloured_noise:
        notes.append(f"The sensors' errors wander{_wandering(fit)}; the deviations include it.")
    notes += [
        combination.sentence
        for combination in open_combinations(fit.parameters, covariance_within(fit), fit.free)
    ]
    notes += [ambiguity(fit.parameters, rival.parameters) for rival in fit.rivals]
    at_bound = [
        parameter.name
        for parameter, value, is_free in zip(fit.structure.parameters, fit.parameters, fit.free, strict=True)
        if is_free and np.isclose(value, (parameter.lower, parameter.upper), rtol=1e-9, atol=0.0).any()
    ]
    if at_bound:
        notes.append(f"At the edge of what is physically possible: {', '.join(at_bound)}.")
    return notes


def _on_the_plane(model: VehicleModel) -> list[str]:
    """A note where it turns the hull the other way than the convention has it."""
    if not model.values["b2"] > CLEARLY_POSITIVE * model.std["b2"]:
        return []
    return [
        "A positive plane angle pitches the nose up here (b2 > 0), against the convention: if the plane is "
        "not mounted so, change the sign of the rudder in the vehicle file."
    ]


def _wandering(fit: Fit) -> str:
    scales = (("pitch", "deg", 180.0 / np.pi), ("depth", "cm", 100.0))
    return "".join(
        f", {name} by {np.sqrt(variance) * scale:.2g} {unit} over {time:.2g} s"
        for (name, unit, scale), (variance, time), white in zip(scales, fit.wander, fit.noise, strict=False)
        if variance > 0.1 * white
    )
