"""CAR coefficients of the Euler-discretised vertical plane <-> the coefficients of its equations of motion.

    w' = a1 w + b1 delta     q' = a2 q + a3 theta + b2 delta     theta' = q     zeta' = w - u0 theta

    D(z) = z^2 + alpha1 z + alpha2         g = 1 + h a1
    pitch: theta = h^2 b2/D(z) delta
    depth: zeta = [h^2 b1 D(z) - h^3 u0 b2 (z - g)] / [(z - 1)(z - g) D(z)] delta

after Yuan et al., J. Mar. Sci. Eng. 2025, 13, 1489, Eq. 7-9, with its beta2 put right (a1 a2 - a3).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass

from firmware_model.state import require


@dataclass(frozen=True, slots=True, kw_only=True)
class Physical:
    """Coefficients of the equations of motion, or their standard deviations; NaN where unknown.

    a1  1/s      heave damping             b1  m/s^2/rad  heave force of the stern plane
    a2  1/s      pitch damping             b2  1/s^2      pitch moment of the stern plane (rad/s^2 per rad)
    a3  1/s^2    pitch restoring moment
    """

    a1: float
    a2: float
    a3: float
    b1: float
    b2: float


def car_from_physical(
    a1: float, a2: float, a3: float, b1: float, b2: float, u0: float, h: float
) -> tuple[tuple[float, float, float], tuple[float, float, float, float, float, float, float]]:
    """(alpha1..alpha3, beta1..beta7) for the speed u0 (m/s) and the step h (s)."""
    _require_step(h)
    alpha1 = -(h * a2 + 2.0)
    alpha2 = 1.0 + h * a2 - h * h * a3
    g = 1.0 + h * a1
    e1, e2, e3 = _pitch_and_integrator(alpha1, alpha2)
    force = h * h * b1
    moment = h * h * h * u0 * b2
    alpha = (alpha1, alpha2, h * h * b2)
    beta = (
        e1 - g,
        e2 - g * e1,
        e3 - g * e2,
        -g * e3,
        force,
        force * alpha1 - moment,
        force * alpha2 + moment * g,
    )
    return alpha, beta


def pitch_from_car(alpha: Sequence[float], h: float) -> tuple[float, float, float]:
    """(a2, a3, b2) of the pitch channel alone."""
    _require_step(h)
    alpha1, alpha2, alpha3 = alpha
    return -(alpha1 + 2.0) / h, -(1.0 + alpha1 + alpha2) / (h * h), alpha3 / (h * h)


def physical_from_car(
    alpha: Sequence[float],
    beta: Sequence[float],
    u0: float,
    h: float,
    covariance: Sequence[Sequence[float]] | None = None,
) -> Physical:
    """The five coefficients from both channels.

    alpha gives a2, a3 and b2. beta holds them again, but ill-conditioned, so D(z) is taken from alpha and
    beta tells only what is new: it is linear in g = 1 + h a1 and in b1, which follow by least squares over
    its seven entries, weighted by the inverse of beta's `covariance` (7 x 7, any scale); unweighted without
    one, or with one that is not positive definite. The errors of beta lie almost all along the third
    difference, which the weights know: they halve the error of a1. NaN goes through as NaN; nothing else
    fails to convert.
    """
    factor = None if covariance is None else _cholesky(covariance)
    return _convert(alpha, beta, u0, h, factor)


def physical_std_from_car(
    alpha: Sequence[float],
    beta: Sequence[float],
    u0: float,
    h: float,
    alpha_covariance: Sequence[Sequence[float]],
    beta_covariance: Sequence[Sequence[float]],
) -> Physical:
    """Standard deviations of `physical_from_car`'s weighted answer by the delta method: diag(J cov J^T).

    The covariances are 3 x 3 and 7 x 7; the noises of the two channels are taken as independent, u0 as exact.
    """
    factor = _cholesky(beta_covariance)
    variance = [0.0] * 5
    by_alpha = _jacobian(lambda x: _convert(x, beta, u0, h, factor), alpha)
    by_beta = _jacobian(lambda x: _convert(alpha, x, u0, h, factor), beta)
    for slopes, block in ((by_alpha, alpha_covariance), (by_beta, beta_covariance)):
        for i in range(5):
            for j in range(len(slopes)):
                for k in range(len(slopes)):
                    variance[i] += slopes[j][i] * block[j][k] * slopes[k][i]
    a1, a2, a3, b1, b2 = (math.sqrt(value) if value >= 0.0 else math.nan for value in variance)
    return Physical(a1=a1, a2=a2, a3=a3, b1=b1, b2=b2)


def _convert(
    alpha: Sequence[float], beta: Sequence[float], u0: float, h: float, factor: list[list[float]] | None
) -> Physical:
    a2, a3, b2 = pitch_from_car(alpha, h)
    alpha1, alpha2, _ = alpha
    e1, e2, e3 = _pitch_and_integrator(alpha1, alpha2)
    moment = h * h * h * u0 * b2
    # beta - known = damping g + force (h^2 b1)
    known = (e1, e2, e3, 0.0, 0.0, -moment, 0.0)
    residual = [beta[i] - known[i] for i in range(7)]
    damping = [-1.0, -e1, -e2, -e3, 0.0, 0.0, moment]
    force = [0.0, 0.0, 0.0, 0.0, 1.0, alpha1, alpha2]
    if factor is not None:
        for column in (residual, damping, force):
            _whiten(factor, column)
    gg, gf, ff = _dot(damping, damping), _dot(damping, force), _dot(force, force)
    gr, fr = _dot(damping, residual), _dot(force, residual)
    determinant = gg * ff - gf * gf
    if not determinant > 0.0:
        return Physical(a1=math.nan, a2=a2, a3=a3, b1=math.nan, b2=b2)
    g = (ff * gr - gf * fr) / determinant
    b1 = (gg * fr - gf * gr) / determinant / (h * h)
    return Physical(a1=(g - 1.0) / h, a2=a2, a3=a3, b1=b1, b2=b2)


def _pitch_and_integrator(alpha1: float, alpha2: float) -> tuple[float, float, float]:
    """(z - 1) D(z) without its leading 1."""
    return alpha1 - 1.0, alpha2 - alpha1, -alpha2


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


def _cholesky(covariance: Sequence[Sequence[float]]) -> list[list[float]] | None:
    """Lower triangular factor; None if the matrix is not positive definite."""
    n = len(covariance)
    factor = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for j in range(i + 1):
            total = covariance[i][j] - _dot(factor[i][:j], factor[j][:j])
            if i > j:
                factor[i][j] = total / factor[j][j]
            elif 0.0 < total < math.inf:
                factor[i][i] = math.sqrt(total)
            else:
                return None
    return factor


def _whiten(factor: list[list[float]], column: list[float]) -> None:
    """column <- factor^-1 column."""
    for i in range(len(column)):
        column[i] = (column[i] - _dot(factor[i][:i], column[:i])) / factor[i][i]


def _jacobian(convert: Callable[[Sequence[float]], Physical], x: Sequence[float]) -> list[tuple[float, ...]]:
    """Rows d(a1, a2, a3, b1, b2)/dx_j by central differences; the functions are nearly linear."""
    slopes = []
    for j in range(len(x)):
        step = 1e-5 * max(abs(x[j]), 1e-2)
        above = astuple(convert([*x[:j], x[j] + step, *x[j + 1 :]]))
        below = astuple(convert([*x[:j], x[j] - step, *x[j + 1 :]]))
        slopes.append(tuple((a - b) / (2.0 * step) for a, b in zip(above, below, strict=True)))
    return slopes


def _require_step(h: float) -> None:
    require(0.0 < h < math.inf, "h must be positive and finite", h)
