"""What the best explanation leaves: nothing, or something systematic that no entry of the catalogue is."""

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from host.catalogue.unknown import ANY_SMOOTH_FORCE
from host.diagnosis.fits.explanation import COLOUR, Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.prospects import gain
from host.diagnosis.fits.speed_forces import are_by_speed
from host.dynamics.equations import NAMES
from host.likelihood.fit import Fit
from host.noise.noise_floor import is_quantised
from host.noise.whiteness import correlation_factor, is_even, is_white
from host.recordings.recording import Array, Recording

SIGNIFICANCE = 1e-4
SEA_DOUBT = 1.5  # no sea is as white and steady as the filter takes it to be
GROUPS, LEAST_IN_GROUP = 10, 5
LEAST_SEA = 0.001  # m/s, of a hull, which follows water in part; below it physics left out
MOVEMENT_SPAN = 0.5  # s
FLOOR_DOUBT = 1.3  # times the noise floor, which no sensor keeps to exactly
FLOOR_SPREAD = 14.0  # over the root of the samples: 4.5 relative deviations of the floor's own estimate
ROUNDING_DOUBT = 2.0  # the same where rounding rules: noise adds to it and is hidden by it


@dataclass(frozen=True, slots=True, kw_only=True)
class Leftover:
    """Signs that something is left.

    is_coloured     the innovations are not white, fast or slow
    is_local        they are larger in one range of the motion than in another, as those of no sea are
    is_by_speed     the random forces of the fit are what errors of the measured speed do: no sign of anything
    is_no_sea       the fit needs random forces, and neither a sea nor those errors are such
    is_above_floor  the sensor noise of the fit exceeds what the sensors themselves show
    smooth_gain     twice the log-likelihood that any smooth force of the motion would gain, correlation
                    discounted
    is_smooth       whether that is more than chance gives
    is_by_plane     the random forces of the fit stand beside a plane that moved more often than it was
                    recorded: they are what it did in part
    """

    is_coloured: bool
    is_local: bool
    is_by_speed: bool
    is_no_sea: bool
    is_above_floor: bool
    smooth_gain: float
    is_smooth: bool
    is_by_plane: bool = False

    @property
    def is_of_what_drives(self) -> bool:
        """Whether a free run is led astray by what is known too little of plane or speed, and by no sea."""
        return self.is_by_speed or self.is_by_plane

    @property
    def is_nothing(self) -> bool:
        signs = self.is_coloured, self.is_local, self.is_no_sea, self.is_above_floor, self.is_smooth
        return not any(signs)


def leftover(fitter: Fitter, best: Explanation) -> Leftover:
    """Tests the innovations of an explanation.

    What rounding leaves is white only under the likelihood of intervals, which no filter has, and its size
    tells of the motion.
    """
    fit = best.fit
    rounded = is_quantised(fitter.recordings)
    even = [e[~rounded] for e in fit.whitened]
    by_intervals = (fitter.steps > 0.0) & (not fit.has_process_noise)
    innovations = [e[~rounded | by_intervals] for e in fit.whitened]
    ahead = gain(fitter, best, ANY_SMOOTH_FORCE.name, [], is_thorough=True)
    smooth_gain = ahead / correlation_factor(fit.whitened)
    by_chance = chi2.isf(SIGNIFICANCE, len(ANY_SMOOTH_FORCE.parameters))
    is_by_speed = are_by_speed(fitter, fit)
    is_by_plane = fit.has_process_noise and any(one.plane_astray > 0.0 for one in fitter.recordings)
    slack = COLOUR if fit.waves.any() or is_by_speed or is_by_plane else 0.0
    doubt = SEA_DOUBT if fit.has_process_noise or fit.has_coloured_noise else 1.0
    is_sea = fit.waves.any() or _heave_by_sea(fit) >= LEAST_SEA
    return Leftover(
        is_coloured=not all(is_white(e, 20, SIGNIFICANCE, slack) and is_even(e, slack) for e in innovations),
        is_local=_is_local(fitter.recordings, even),
        is_by_speed=is_by_speed,
        is_no_sea=bool(fit.has_process_noise and not (is_sea or is_by_speed or is_by_plane)),
        is_above_floor=is_above_floor(fitter, fit),
        smooth_gain=smooth_gain,
        is_smooth=bool(smooth_gain > by_chance * doubt),
        is_by_plane=is_by_plane,
    )


def is_above_floor(fitter: Fitter, fit: Fit) -> bool:
    """Whether the sensor noise of a fit is more than the sensors show, beyond the doubt about those."""
    counts = np.sum([np.isfinite(e).sum(axis=1) for e in fit.whitened], axis=0)
    doubt = np.maximum(FLOOR_DOUBT, 1.0 + FLOOR_SPREAD / np.sqrt(counts))
    doubt = np.where(is_quantised(fitter.recordings), ROUNDING_DOUBT, doubt)
    return bool((fit.noise[:2] > doubt * fitter.floor).any())


def _heave_by_sea(fit: Fit) -> float:
    """Rms heave velocity that the random force keeps up against the damping, m/s: sqrt(q / (2 |a1|))."""
    a1 = fit.parameters[NAMES.index("a1")]
    return float(np.sqrt(fit.noise[2] / (2.0 * abs(a1))))


def _before(values: Array, rows: int) -> Array:
    """The values (N,) so many rows before; at first the first."""
    return np.concatenate([np.full(min(rows, values.size), values[0]), values[:-rows]])


def _is_local(recordings: list[Recording], innovations: list[Array]) -> bool:
    """Whether the squared innovations differ between tenths of plane angle or plane movement.

    The means of ten groups of n white squares scatter by the kurtosis over n; their chi2 has 9 degrees.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # rows without any measurement
        squares = np.concatenate([np.nanmean(np.atleast_2d(e**2), axis=0) for e in innovations])
    stood = [_before(r.rudder, 1) for r in recordings]
    spans = [max(1, round(MOVEMENT_SPAN / r.step)) for r in recordings]
    moved = [np.abs(one - _before(one, rows)) for one, rows in zip(stood, spans, strict=True)]
    known = np.isfinite(squares)
    if known.sum() < LEAST_IN_GROUP * GROUPS:
        return False
    values = squares[known]
    # Not by pitch: a group of measured angles is one of errors, too. Nor by the plane in the very row, where
    # an autopilot answers these.
    for quantity in (np.concatenate(stood), np.concatenate(moved)):
        groups = np.array_split(np.argsort(quantity[known], kind="stable"), GROUPS)
        means = np.array([values[group].mean() for group in groups])
        scatter = np.array([values.var() / group.size for group in groups])
        if np.sum((means - values.mean()) ** 2 / scatter) > chi2.isf(SIGNIFICANCE, GROUPS - 1):
            return True
    return False
