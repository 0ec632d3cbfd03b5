"""Errors in the numbers that the paper prints."""

from itertools import combinations

import numpy as np
from scipy.signal import ss2tf

from host.recordings.recording import Array
from tools.paper.erratum import Erratum
from tools.paper.printed import (
    correct_truth,
    physical_truth,
    printed,
    printed_estimates,
    printed_truth,
    relative_error,
)


def errata_in_values() -> list[Erratum]:
    """In the order of the paper."""
    return [
        _alpha2(),
        *_betas(),
        _depth_integrates(),
        _copied_rows(),
        _longer_window(),
        _heave_damping(),
        _table6_error(),
    ]


def system(physical: dict[str, float], u0: float) -> tuple[Array, Array]:
    """A (4, 4) and B (4, 1) of x = [w, q, theta, zeta] (Eq. 2)."""
    A = np.zeros((4, 4))
    A[0, 0], A[1, 1], A[1, 2], A[2, 1] = physical["a1"], physical["a2"], physical["a3"], 1.0
    A[3, 0], A[3, 2] = 1.0, -u0
    return A, np.array([[physical["b1"]], [physical["b2"]], [0.0], [0.0]])


def euler_car() -> tuple[Array, Array]:
    """alpha (3,) and beta (7,), printed signs, by numerical transfer functions of I + h A and h B alone."""
    t = printed()["table1"]
    A, B = system(physical_truth(), t["u0"])
    Phi, Delta = np.eye(4) + t["h"] * A, t["h"] * B
    pitch = slice(1, 3)  # q and theta stand on their own
    found = []
    for matrix, drive, output in ((Phi[pitch, pitch], Delta[pitch], 1), (Phi, Delta, 3)):
        C = np.eye(matrix.shape[0])[[output]]
        numerator, denominator = ss2tf(matrix, drive, C, np.zeros((1, 1)))
        found.append(np.concatenate([-denominator[1:], numerator[0, 2:]]))
    return found[0], found[1]


def constant_error() -> tuple[float, float]:
    """Error, in %, that an exact estimate of alpha shows against the printed "real value": as the paper's

    tables compute it, and as |alpha2 - printed alpha2|/||printed|| from numbers of four digits alone.
    """
    real, true = printed_truth().alpha, correct_truth().alpha
    slip = abs(round(float(true[1]), 4) - float(real[1]))
    return float(relative_error(true, real)), 100.0 * slip / float(np.linalg.norm(real))


def _alpha2() -> Erratum:
    t, physical = printed()["table1"], physical_truth()
    a2, a3, h = physical["a2"], physical["a3"], t["h"]
    slipped, true = 1.0 + h * a2 + h * h * a3, euler_car()[0][1]
    exact, rounded = constant_error()
    last = [block.errors[-1] for block in printed_estimates("alpha")]
    return Erratum(
        where='Eq. 30, Tables 2 and 3: "real value" of alpha2',
        printed="0.5793",
        correct=f"{-true:.4f}",
        evidence=(
            f"1 + h a2 − h² a3 = {-true:.4f}; the sign of h² a3 slipped: 1 + h a2 + h² a3 = {slipped:.4f}. "
            f"An exact estimate then shows the constant error {exact:.4f} % (|0.7433 − 0.5793|/norm = "
            f"{rounded:.3f} %); "
            f"the tables end at {min(last):.4f} to {max(last):.4f} %"
        ),
        is_shown=abs(slipped - 0.5793) < 2e-4 and all(abs(e - exact) < 3e-3 for e in last),
    )


def _betas() -> list[Erratum]:
    true, real = euler_car()[1], printed_truth().beta
    rows = []
    for i, name in ((1, "beta2"), (2, "beta3"), (3, "beta4"), (6, "beta7")):
        rows.append(
            Erratum(
                where=f'Eq. 30, Tables 4 and 5: "real value" of {name}',
                printed=_signed(real[i]),
                correct=_signed(true[i]),
                evidence=_slip(i, float(real[i])),
                is_shown=abs(true[i] - real[i]) > 5e-4,
            )
        )
    return rows


def _slip(index: int, real: float) -> str:
    """Which slip turns the correct beta into the printed one, to its last digit."""
    t, physical = printed()["table1"], physical_truth()
    h, true = t["h"], euler_car()[1]
    a1, a3, b1 = physical["a1"], physical["a3"], physical["b1"]
    # The terms with a3, as they stand in the difference equation's coefficients.
    terms = {
        1: {"h² a3": h**2 * a3},
        2: {"2 h² a3": -2.0 * h**2 * a3, "h³ a1 a3": -(h**3) * a1 * a3},
        3: {"h² a3": h**2 * a3, "h³ a1 a3": h**3 * a1 * a3},
        6: {"h⁴ a3 b1": -(h**4) * a3 * b1},
    }[index]
    for count in range(1, len(terms) + 1):
        for names in combinations(terms, count):
            slipped = float(true[index]) - 2.0 * sum(terms[name] for name in names)
            if abs(slipped - real) < 6e-5:
                return f"with the sign of {' and '.join(names)} reversed it is {_signed(slipped)}"
    if abs(real - round(float(true[5]), 4)) < 5e-5:
        return "printed is the value of beta6 once more"
    return "no reversed sign of a term with a3 gives the printed value; it is not explained"


def _signed(value: float) -> str:
    return f"{value:.4f}".replace("-", "−")


def _depth_integrates() -> Erratum:
    real, true = printed_truth().beta, euler_car()[1]
    at_one = [1.0 - float(np.sum(beta[:4])) for beta in (real, true)]
    return Erratum(
        where="Eq. 30: depth polynomial at z = 1",
        printed=_signed(at_one[0]),
        correct="0",
        evidence="depth integrates, so 1 + beta1 + ... + beta4 = 0, as the corrected values have it",
        is_shown=abs(at_one[0]) > 0.1 and abs(at_one[1]) < 1e-9,
    )


def _heave_damping() -> Erratum:
    real, true = printed_truth().physical[0], correct_truth().physical[0]
    return Erratum(
        where="Table 6: Zw/(m − Zwdot)",
        printed=_signed(real),
        correct=_signed(true),
        evidence="Zw/(m − Zwdot) of Table 1; two digits are transposed",
        is_shown=abs(real - true) > 5e-3,
    )


def _copied_rows() -> Erratum:
    blocks = {block.p: block for block in printed_estimates("alpha")}
    real = printed_truth().alpha
    same = bool(np.array_equal(blocks[5].values, blocks[8].values))
    implied = relative_error(blocks[8].values[:3], real)
    return Erratum(
        where="Table 3: estimates for p = 8",
        printed="the rows of p = 5 once more",
        correct="not known",
        evidence=(
            f"the printed estimates imply the errors {', '.join(f'{e:.2f}' for e in implied)} %, "
            f"printed are {', '.join(f'{e:.2f}' for e in blocks[8].errors[:3])} %"
        ),
        is_shown=same and bool(np.max(np.abs(implied - blocks[8].errors[:3])) > 1.0),
    )


def _table6_error() -> Erratum:
    row, real = printed()["table6"]["p1"], printed_truth().physical
    implied = float(relative_error(np.array(row["estimate"]), real))
    return Erratum(
        where="Table 6: error of RLS",
        printed=f"{row['error']:.4f} %",
        correct=f"{implied:.4f} %",
        evidence="its own estimates give this; the table's other rows agree to 0.001: digits transposed",
        is_shown=abs(implied - row["error"]) > 0.1,
    )


def _longer_window() -> Erratum:
    """The remark below Table 5 rests on the wrong "real values"."""
    last = {block.p: block.values[-1] for block in printed_estimates("beta")}
    wrong = {p: float(relative_error(value, printed_truth().beta)) for p, value in last.items()}
    right = {p: float(relative_error(value, correct_truth().beta)) for p, value in last.items()}
    return Erratum(
        where='below Table 5: "p = 8 increases compared to p = 5 because of data saturation"',
        printed=f"{wrong[5]:.2f} → {wrong[8]:.2f} %",
        correct=f"{right[5]:.2f} → {right[8]:.2f} %",
        evidence=(
            "the same printed estimates against the correct values: "
            + ", ".join(f"p = {p}: {right[p]:.2f} %" for p in sorted(right))
            + "; nothing saturates"
        ),
        is_shown=wrong[8] > wrong[5] and right[8] < right[5],
    )
