"""What a model foretells over a few seconds, for a hull that no free run follows for long."""

from dataclasses import replace

import numpy as np

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import first_known
from host.dynamics.propagate import Inputs, begun_at, inputs_of
from host.dynamics.sensitivities import steered_run
from host.identification.predict import SETTLING_SPAN
from host.likelihood.fit import Fit
from host.likelihood.kalman import kalman_pass
from host.recordings.recording import Array, Recording

FIRST_SPREAD = (0.5, 0.5, 0.2, 2.0)  # of w, q, theta and zeta, SI: the filter begins anywhere
FIRST_LOSS = 0.5  # m/s, of the speed where none is measured


def foretold_errors(explanation: Explanation, recording: Recording, horizon: float) -> Array:
    """Measured minus foretold, pitch and depth (2, N); NaN where not measured and in the first 5 s.

    A Kalman filter follows the measurements; every `horizon` s it is let go, and until the next time the
    planes alone are known.
    """
    fit, time = explanation.fit, recording.time
    inputs = inputs_of(recording, fit.structure)
    initial = begun_at(first_known(recording.pitch), first_known(recording.depth))
    followed = following(fit, initial, inputs)
    outputs = np.full((2, time.size), np.nan)
    number = np.floor((time - time[0] - SETTLING_SPAN) / horizon)
    for ahead in (number == one for one in np.unique(number[number >= 0.0])):
        until = np.flatnonzero(ahead)[-1] + 1
        gains = np.where(ahead, 0.0, followed)[:, :until]
        cut = {name: getattr(inputs, name)[:, :until] for name in ("drive", "measured", "present")}
        run = steered_run(fit.parameters, initial, replace(inputs, **cut), gains)
        outputs[:, ahead] = run.outputs[:, ahead[:until]]
    outputs[~np.isfinite(outputs) & (number >= 0.0)] = np.inf
    return np.asarray(np.vstack([recording.pitch, recording.depth]) - outputs)


def following(fit: Fit, initial: Array, inputs: Inputs) -> Array:
    """Gains (2 nx, N) of a Kalman filter that begins near this state (5,), under the fit's random forces."""
    spread = np.zeros(len(fit.structure.states))
    spread[: len(FIRST_SPREAD)] = np.square(FIRST_SPREAD)
    if "speed_loss" in fit.structure.states:
        spread[fit.structure.states.index("speed_loss")] = FIRST_LOSS**2
    return kalman_pass(fit.parameters, initial, fit.noise, inputs, spread).gains
