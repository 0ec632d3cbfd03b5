"""What the errors of a measured speed do to the vehicle in a simulation: random forces that no sea makes.

    v / u0 (a1 w + c_wq q + 2 b1 delta) + a1 theta v in w',    v / u0 (a2 q + c_qw w + 2 b2 delta) in q'

for an error v of the speed (host.noise.speed), as dynamic pressure and what is carried along grow with it,
and as the depth it adds, zeta' = ... - theta v, is that of a hull that this force makes heave. A hull that is
stable forgets them; one that is not, in its straight run or while it turns, is led away by them for good, and
no free run of the best of models stays with the recording.
"""

import numpy as np

from host.diagnosis.fits.fitter import Fitter
from host.likelihood.fit import Fit
from host.likelihood.kalman import kalman_pass
from host.noise.speed import smoothed_speed
from host.recordings.recording import Array

SPEED_DOUBT = 3.0  # times the density expected: of six simulated dives it came to 0.02 to 1.1


def are_by_speed(fitter: Fitter, fit: Fit) -> bool:
    """Whether the random forces of a fit are no more than the errors of the measured speed account for."""
    if not fit.has_process_noise or fit.waves.any() or not fitter.recordings[0].has_speed:
        return False
    return bool((fit.noise[2:] < SPEED_DOUBT * densities(fitter, fit)).all())


def densities(fitter: Fitter, fit: Fit) -> Array:
    """Spectral densities (2,) of force, (m/s^2)^2 s, and moment, (rad/s^2)^2 s, by the speed's errors."""
    p = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    names = fit.structure.effect_names
    found = []
    for x0, inputs, recording in zip(
        fit.initial, fitter.inputs(names, for_filter=True), fitter.recordings, strict=True
    ):
        w, q, theta = kalman_pass(fit.parameters, x0, fit.noise, inputs).states[:3]
        force = p["a1"] * (w + p["u0"] * theta) + p.get("c_wq", 0.0) * q + 2.0 * p["b1"] * recording.rudder
        moment = p["a2"] * q + p.get("c_qw", 0.0) * w + 2.0 * p["b2"] * recording.rudder
        _, variance, decay = smoothed_speed(recording.speed)
        # A first-order process of this decay is, for slower motion, as white noise of this density.
        density = 2.0 * variance * recording.step / (1.0 - decay) / p["u0"] ** 2
        found.append(density * np.mean([force**2, moment**2], axis=1))
    return np.asarray(np.mean(found, axis=0))
