"""What moments at which nobody saw the plane step leave in a free run, and how to whiten it.

A moment that is off by df leaves B df in the residuals of pitch and depth, B as host.diagnosis.plane_moments
finds it. With df of covariance V the residuals have the covariance R + B V B^T; with the singular values s
and left vectors Q of R^(-1/2) B V^(1/2) they are whitened by

    e' = R^(1/2) (1 - Q (1 - (1 + s^2)^(-1/2)) Q^T) R^(-1/2) e.

So what a step at another moment would do counts for next to nothing, in any set of effects.
"""

from dataclasses import dataclass

import numpy as np

from host.recordings.recording import Array

SLIGHT = 0.05  # of s: hardly seen in the noise


@dataclass(frozen=True, slots=True, eq=False)
class UnseenPlane:
    """The whitening over one recording of N rows.

    weight  (2,) 1 / rad and 1 / m, of the sensors' noise
    basis   (J, 2 N) Q^T, pitch and then depth
    less    (J,) 1 - (1 + s^2)^(-1/2)
    """

    weight: Array
    basis: Array
    less: Array

    def whitened(self, values: Array) -> Array:
        """Residuals (2, N) or sensitivities (2, c, N), 0 where nothing was measured, whitened."""
        scale = self.weight.reshape(2, *[1] * (values.ndim - 1))
        with np.errstate(invalid="ignore", over="ignore"):  # what has run away
            flat = np.moveaxis(values * scale, 0, -2).reshape(-1, self.basis.shape[1])
            flat = flat - ((flat @ self.basis.T) * self.less) @ self.basis
        shape = (*values.shape[1:-1], 2, values.shape[-1])
        return np.asarray(np.moveaxis(flat.reshape(shape), -2, 0) / scale)


def unseen_plane(doubt: Array | None, present: Array, floor: Array) -> UnseenPlane | None:
    """The whitening for B V^(1/2) (J, 2, N) where `present` (2, N) was measured; None where that is nothing.

    floor  rad^2, m^2: variances of the sensors' noise
    """
    if doubt is None:
        return None
    weight = 1.0 / np.sqrt(floor)
    shifts = (doubt * present * weight[:, None]).reshape(len(doubt), -1)
    _, s, basis = np.linalg.svd(shifts, full_matrices=False)
    seen = s > SLIGHT
    return UnseenPlane(weight, basis[seen], 1.0 - 1.0 / np.sqrt(1.0 + s[seen] ** 2)) if seen.any() else None


def foreseen_unseen(doubt: Array, left: Array, present: Array, noise: Array) -> tuple[Array, Array]:
    """What moments do to pitch and depth, as far as residuals (2, N) tell, and the variance of what is left.

    B V^(1/2) z with z = (1 + V^(1/2) B^T R^(-1) B V^(1/2))^(-1) V^(1/2) B^T R^(-1) e over the rows that are
    `present`, in rad and m (2, N); the variance over that of the sensors' noise (2,), which it includes.
    """
    flat, weight = doubt.reshape(len(doubt), -1), np.repeat(1.0 / noise, left.shape[1])
    told = flat * (weight * present.ravel())
    inverse = np.linalg.inv(np.eye(len(doubt)) + told @ flat.T)
    spread = 1.0 + weight * np.sum(flat * (inverse @ flat), axis=0)
    return (inverse @ (told @ left.ravel()) @ flat).reshape(left.shape), spread.reshape(left.shape)
