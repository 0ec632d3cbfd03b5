"""How well a fitted set of effects meets stretches it did not learn from."""

from dataclasses import dataclass

import numpy as np

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.proof.foretold import following, foretold_errors
from host.diagnosis.recordings.spans import Spans
from host.dynamics.propagate import Run, free_run, inputs_of
from host.dynamics.sensitivities import steered_run
from host.identification.predict import SETTLING_SPAN, estimate_initial_state
from host.likelihood.fit import Fit
from host.noise.drift import drifts_of, whitenings
from host.noise.unseen_plane import foreseen_unseen
from host.recordings.recording import Array, Recording

FORETOLD = 0.9  # of the squared error that is left: less than a tenth better is chance


@dataclass(frozen=True, slots=True, kw_only=True)
class Misfit:
    """Errors of free runs; chi2 is the mean square over the sensors' noise variance.

    Where something drifts beside that noise, over the variance of both.
    """

    depth_rmse_m: float
    pitch_rmse_rad: float
    chi2_depth: float
    chi2_pitch: float

    def as_json(self) -> dict[str, float]:
        return {
            "depth_rmse_m": self.depth_rmse_m,
            "pitch_rmse_rad": self.pitch_rmse_rad,
            "chi2_depth": self.chi2_depth,
            "chi2_pitch": self.chi2_pitch,
        }

    @property
    def chi2(self) -> float:
        """Both channels together."""
        return 0.5 * (self.chi2_depth + self.chi2_pitch)


def free_run_errors(explanation: Explanation, recording: Recording, lost: float = np.nan) -> Array:
    """Measured minus free run, pitch and depth (2, N); NaN where not measured and in the first 5 s.

    lost  what a run gives where it leaves the numbers
    """
    fit = explanation.fit
    inputs = inputs_of(recording, fit.structure)
    opening = recording.between(recording.time[0], recording.time[0] + SETTLING_SPAN)
    initial = estimate_initial_state(fit.parameters, opening, inputs)
    with np.errstate(over="ignore", invalid="ignore"):
        run = free_run(fit.parameters, initial, inputs)
    errors = np.vstack([recording.pitch, recording.depth]) - _known(run, lost)
    errors[:, recording.time < recording.time[0] + SETTLING_SPAN] = np.nan
    return errors


def misfit(explanation: Explanation, spans: Spans, floor: Array, horizon: float | None = None) -> Misfit:
    """Scores a fit to the teaching recordings on what it has not seen, against the noise floor (2,).

    The free run of the fit passes through the stretches that were held out, so that lags and the speed arrive
    there as they are. Where random forces act it would stray from any truth: there a Kalman filter follows
    what was taught, and runs freely over what was held out; so does one for what drifts beside the vehicle.
    Where recordings judge as a whole it begins anew.

    horizon  s over which each stretch is foretold instead
    """
    if horizon is not None:
        errors = [foretold_errors(explanation, one, horizon) for one in spans.judging or spans.teaching]
    elif spans.unseen:
        errors, doubts = _errors_passing(explanation, spans)
    else:
        errors = [free_run_errors(explanation, piece, np.inf) for piece in spans.judging or spans.teaching]
    if horizon is not None or not spans.unseen:
        doubts = [np.ones_like(error) for error in errors]
    pitch, depth = _mean_squares(np.hstack(errors))
    whitened = _mean_squares(np.hstack(errors) / np.sqrt(np.hstack(doubts)))
    return Misfit(
        depth_rmse_m=float(np.sqrt(depth)),
        pitch_rmse_rad=float(np.sqrt(pitch)),
        chi2_depth=float(whitened[1] / floor[1]),
        chi2_pitch=float(whitened[0] / floor[0]),
    )


def _mean_squares(errors: Array) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(np.nanmean(errors**2, axis=1), nan=1e12, posinf=1e12))


def foretells(base: Explanation, best: Explanation, spans: Spans, floor: Array, horizon: float) -> bool:
    """Whether a set foretells what was held out clearly better than the base, `horizon` s ahead.

    Random forces lead any free run away, that of the true physics, too; over a few seconds they hardly do.
    """
    before, after = (misfit(one, spans, floor, horizon).chi2 for one in (base, best))
    return after < FORETOLD * before


def _errors_passing(explanation: Explanation, spans: Spans) -> tuple[list[Array], list[Array]]:
    """Of each recording, with the variance of what drifts and of white noise in units of the latter."""
    fit = explanation.fit
    errors, doubts = [], []
    for run, unseen, initial in zip(spans.teaching, spans.unseen, fit.initial, strict=True):
        inputs = inputs_of(run, fit.structure)
        with np.errstate(over="ignore", invalid="ignore"):
            if fit.has_process_noise:
                passed = steered_run(fit.parameters, initial, inputs, following(fit, initial, inputs))
            else:
                passed = free_run(fit.parameters, initial, inputs)
        drifted, doubt = _drifted(fit, run, passed)
        # A run that leaves the numbers is as far off as can be, not only as far as it can be followed.
        errors.append(np.vstack([unseen.pitch, unseen.depth]) - _known(passed, np.inf) - drifted)
        doubts.append(doubt)
    return errors, doubts


def _drifted(fit: Fit, taught: Recording, passed: Run) -> tuple[Array, Array]:
    """How far pitch and depth have drifted, as far as what was taught tells, and how far that may be off.

    Or were led off by a plane that stepped unseen. (2, N) each; the second is a variance in units of the
    sensor's white noise, which it includes.
    """
    measured = np.vstack([taught.pitch, taught.depth])
    left = np.nan_to_num(measured - passed.outputs)
    if taught.plane_doubt is not None:
        return foreseen_unseen(taught.plane_doubt, left, np.isfinite(measured), fit.noise[:2])
    foreseen, doubt = np.zeros_like(left), np.ones_like(left)
    for i, filtered in enumerate(whitenings(*drifts_of(taught, None, fit.relative_wander))):
        if filtered is not None:
            foreseen[i], doubt[i] = filtered.foreseen(left[i : i + 1])[0], filtered.doubt
    return foreseen, doubt


def _known(run: Run, lost: float) -> Array:
    return np.where(np.isfinite(run.outputs), run.outputs, lost)
