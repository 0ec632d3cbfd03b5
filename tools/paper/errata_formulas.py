"""Errors in the formulas and claims of the paper."""

import numpy as np
from scipy.linalg import expm

from tools.paper.errata_values import system
from tools.paper.erratum import Erratum
from tools.paper.printed import correct_truth, physical_truth, printed
from tools.paper.regression import rank, respond, rows_of
from tools.paper.rudder import sine


def errata_in_formulas() -> list[Erratum]:
    """In the order of the paper."""
    return [
        _input_matrix(),
        _beta2_formula(),
        _second_channel(),
        _shape_of_covariance(),
        _one_sine(),
        _section6_form(),
    ]


def _input_matrix() -> Erratum:
    t = printed()["table1"]
    A, B = system(physical_truth(), t["u0"])
    block = np.zeros((5, 5))
    block[:4, :4], block[:4, 4:] = A, B
    Delta = expm(block * t["h"])[:4, 4]
    series = sum(
        np.linalg.matrix_power(A, i) @ B[:, 0] * t["h"] ** (i + 1) / np.prod(np.arange(1.0, i + 2))
        for i in range(12)
    )
    return Erratum(
        where="Eq. 4: input matrix",
        printed="A⁻¹(Φ − I)B",
        correct="block of exp([A B; 0 0] h)",
        evidence=(
            f"A has rank {np.linalg.matrix_rank(A)} of 4 (depth integrates), so it has no inverse; the "
            f"augmented "
            f"exponential agrees with the power series to {np.max(np.abs(Delta - series)):.0e}"
        ),
        is_shown=bool(np.linalg.matrix_rank(A) < 4) and bool(np.allclose(Delta, series, atol=1e-12)),
    )


def _beta2_formula() -> Erratum:
    """Eq. 9 against the characteristic polynomial of random vehicles."""
    rng, h = np.random.default_rng(0), 0.1
    worst = {"a1 a3": 0.0, "a1 a2": 0.0}
    for _ in range(100):
        physical = dict(zip(("a1", "a2", "a3", "b1", "b2"), rng.uniform(-5.0, 5.0, 5), strict=True))
        A, _ = system(physical, 2.0)
        beta2 = np.poly(np.eye(4) + h * A)[2]
        a1, a2, a3 = physical["a1"], physical["a2"], physical["a3"]
        for name, product in (("a1 a3", a1 * a3), ("a1 a2", a1 * a2)):
            value = h * h * (product - a3) + 3.0 * h * (a1 + a2) + 6.0
            worst[name] = max(worst[name], abs(value - beta2))
    return Erratum(
        where="Eq. 9: beta2",
        printed="h²(a1 a3 − a3) + ...",
        correct="h²(a1 a2 − a3) + ...",
        evidence=(
            f"over 100 random vehicles the printed formula misses the characteristic polynomial by up to "
            f"{worst['a1 a3']:.2f}, the corrected one by {worst['a1 a2']:.0e}"
        ),
        is_shown=worst["a1 a3"] > 1e-3 and worst["a1 a2"] < 1e-9,
    )


def _second_channel() -> Erratum:
    """Does the depth polynomial annihilate depth or pitch?"""
    truth, rudder = correct_truth(), sine(2.0, 200.0)
    pitch, depth = respond(truth.alpha, rudder), respond(truth.beta, rudder)
    k = np.arange(4, rudder.size)
    driven = sum(truth.beta[4 + i] * rudder[k - 2 - i] for i in range(3))
    left = [
        float(np.max(np.abs(y[k] - sum(truth.beta[i] * y[k - 1 - i] for i in range(4)) - driven)))
        / float(np.max(np.abs(y)))
        for y in (pitch, depth)
    ]
    return Erratum(
        where="Eq. 10, second line",
        printed="B1(z) theta(k)",
        correct="B1(z) zeta(k)",
        evidence=f"on simulated signals it misses by {left[0]:.1e} with pitch, {left[1]:.0e} with depth",
        is_shown=left[0] > 1e-4 > left[1],
    )


def _shape_of_covariance() -> Erratum:
    n, p = 3, 5
    Phi, P = np.ones((n, p)), np.eye(n)
    L = P @ Phi @ np.linalg.inv(np.eye(p) + Phi.T @ P @ Phi)
    shape = (P - L @ Phi.T @ P).shape
    return Erratum(
        where="after Eq. 27: size of P",
        printed="n × p",
        correct="n × n",
        evidence=f"n = {n}, p = {p}: P − L Φᵀ P is {shape[0]} × {shape[1]}, L is {L.shape[0]} × {L.shape[1]}",
        is_shown=shape == (n, n),
    )


def _one_sine() -> Erratum:
    """Rank of the information matrix under one sine, the transient over."""
    truth, rudder = correct_truth(), sine(0.2, 400.0)
    settled = slice(2000, None)
    ranks = []
    for channel, coefficients in (("alpha", truth.alpha), ("beta", truth.beta)):
        rows = rows_of(channel, respond(coefficients, rudder)[settled], rudder[settled])
        # Depth wanders from a mean that the start left behind; as a constant it is one more direction.
        ranks.append(rank(rows.phi))
    return Erratum(
        where='"a sine ensures full excitation" (Section 5)',
        printed="3 and 7 parameters",
        correct=f"rank {ranks[0]} and {ranks[1]}",
        evidence=(
            f"one sine is persistently exciting of order 2: settled, the information matrix has rank "
            f"{ranks[0]} of 3 for "
            f"pitch and {ranks[1]} of 7 for depth (2 of the sine, 1 of depth's constant mean); "
            "the rest comes from the start-up transient and the prior"
        ),
        is_shown=ranks[0] == 2 and ranks[1] == 3,
    )


def _section6_form() -> Erratum:
    """Eq. of Section 6: q' regressed on [w', w, q, delta], w' on [q', w, q, delta]."""
    rng = np.random.default_rng(0)
    state = rng.normal(size=(400, 3))  # w, q, rudder force
    rates = state @ rng.normal(size=(3, 2))  # the equations solved for w', q'
    heave = np.column_stack([rates[:, 1], state])
    pitch = np.column_stack([rates[:, 0], state])
    found = rank(heave), rank(pitch)
    return Erratum(
        where="Section 6: theta1 and theta2",
        printed="8 coefficients",
        correct="6 can be told",
        evidence=(
            f"the equations solved for w' and q' make w' a combination of w, q and the rudder force: the "
            f"regressors have rank "
            f"{found[0]} and {found[1]} of 4. Added-mass couplings and dampings cannot be told apart, "
            f"whatever the data; "
            "the free run only needs the six of the solved form"
        ),
        is_shown=found == (3, 3),
    )
