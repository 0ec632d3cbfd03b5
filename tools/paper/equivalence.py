"""What overlapping windows do: MILS with p0 is RLS with p p0; compared fairly, the advantage is gone.

Without forgetting a row enters p times, so sum p phi phi^T + I/p0 = p (sum phi phi^T + I/(p p0)): the same
minimum as RLS from a prior p times weaker, and a P that is p times too small. Only the last p - 1 rows are
counted less often.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from host.recordings.recording import Array
from tools.paper.printed import correct_truth, relative_error
from tools.paper.regression import P0, Rows, multiplicity, respond, rows_of, square_root, weighted_fit
from tools.paper.rudder import H, multistep
from tools.paper.table import LINES, Cell, Table

LENGTHS = (1, 3, 5, 8)
DURATION = 60.0  # s
CHECK_AFTER = (1.0, 5.0, 60.0)  # s
NOISE = 1e-3  # rad, white, in the equation as in Eq. 11: the case least squares is made for
FORGETTING = 0.97


@dataclass(frozen=True, slots=True, kw_only=True)
class Equality:
    """Errors (%) over time (s): MILS with p and p0, RLS with p p0, RLS with p0.

    difference     between the first two estimates, relative
    window_closed  the same when every row has been counted p times
    confidence     P of RLS with p p0 over P of MILS
    """

    p: int
    time: Array
    mils: Array
    rls_weaker_prior: Array
    rls: Array
    difference: Array
    window_closed: float
    confidence: float


def equality(p: int = 5, p0: float = 1e3) -> Equality:
    """One noise-free run, recursively. p0 is small enough for the prior to be seen at work."""
    truth = correct_truth().alpha
    rudder = multistep(np.random.default_rng(1), DURATION)
    rows = rows_of("alpha", respond(truth, rudder), rudder)
    last: dict[str, Array] = {}

    def keep(name: str) -> Callable[..., None]:
        return lambda mils: last.__setitem__(name, mils.covariance)

    mils = square_root(rows, p, p0=p0, watch=keep("mils"))
    weaker = square_root(rows, 1, p0=p * p0, watch=keep("weaker"))
    plain = square_root(rows, 1, p0=p0)
    return Equality(
        p=p,
        time=np.asarray(rows.k * H, dtype=np.float64),
        mils=relative_error(mils, truth),
        rls_weaker_prior=relative_error(weaker, truth),
        rls=relative_error(plain, truth),
        difference=np.linalg.norm(mils - weaker, axis=1) / np.linalg.norm(truth),
        window_closed=_closed_difference(rows, p, p0),
        confidence=float(np.median(np.diag(last["weaker"]) / np.diag(last["mils"]))),
    )


def _closed_difference(rows: Rows, p: int, p0: float) -> float:
    """MILS against RLS with p p0 when the window has run out: each row then counted exactly p times."""
    n = rows.phi.shape[1]
    idle = Rows(
        np.vstack([rows.phi, np.zeros((p - 1, n))]),
        np.concatenate([rows.y, np.zeros(p - 1)]),
        np.concatenate([rows.k, rows.k[-1] + np.arange(1, p)]),
    )
    theta_mils = square_root(idle, p, p0=p0)[-1]
    # theta(0) = 1/p0 of the one must be that of the other for the last digits to agree.
    shifted = Rows(rows.phi, rows.y - rows.phi @ np.full(n, 1.0 / p0 - 1.0 / (p * p0)), rows.k)
    theta_rls = square_root(shifted, 1, p0=p * p0)[-1] + (1.0 / p0 - 1.0 / (p * p0))
    return float(np.max(np.abs(theta_mils - theta_rls)) / np.max(np.abs(theta_rls)))


def effective_memory(p: int, forgetting: float, rows: int = 2000) -> float:
    """(sum w)^2/sum w^2, in rows: over how many rows the estimate averages noise."""
    w = multiplicity(rows, p, forgetting)
    return float(w.sum() ** 2 / np.sum(w**2))


def forgetting_for(p: int, memory: float) -> float:
    """The forgetting factor with which MILS averages over `memory` rows."""
    low, high = 0.5, 1.0 - 1e-9
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective_memory(p, middle) < memory else (low, middle)
    return 0.5 * (low + high)


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """One estimator of the comparison."""

    name: str
    p: int
    p0: float
    forgetting: float


def settings() -> list[tuple[str, Setting]]:
    """As published (same p0 and forgetting for all p), and fair (prior p0/p, same effective memory)."""
    memory = effective_memory(1, FORGETTING)
    found = []
    for case, forgets in (("no forgetting", False), (f"memory of {memory:.0f} rows", True)):
        for p in LENGTHS:
            base = FORGETTING if forgets else 1.0
            name = "RLS" if p == 1 else f"MILS p = {p}"
            found.append((case, Setting(name=f"{name}, as published", p=p, p0=P0, forgetting=base)))
            if p > 1:
                fair = forgetting_for(p, memory) if forgets else 1.0
                found.append((case, Setting(name=f"{name}, fair", p=p, p0=P0 / p, forgetting=fair)))
    return found


def comparison(seeds: int, on_step: Callable[[], None] = lambda: None) -> Table:
    """Monte Carlo on the pitch channel: errors without noise soon after the start, errors with noise, "
    "honesty of P."""
    truth, choices = correct_truth().alpha, settings()
    clean = np.zeros((len(choices), len(CHECK_AFTER), seeds))
    noisy = np.zeros((len(choices), seeds))
    claimed = np.zeros((len(choices), seeds))
    actual = np.zeros((len(choices), seeds))
    for seed in range(seeds):
        rng = np.random.default_rng([seed, 7])
        rudder = multistep(rng, DURATION)
        noise = NOISE * rng.standard_normal(rudder.size)
        quiet = rows_of("alpha", respond(truth, rudder), rudder)
        loud = rows_of("alpha", respond(truth, rudder, noise), rudder)
        for i, (_, choice) in enumerate(choices):
            arguments = (choice.p, choice.forgetting, choice.p0)
            for j, after in enumerate(CHECK_AFTER):
                count = int(np.searchsorted(quiet.k, round(after / H), side="right"))
                clean[i, j, seed] = relative_error(weighted_fit(quiet.first(count), *arguments), truth)
            found = weighted_fit(loud, *arguments)
            noisy[i, seed] = relative_error(found, truth)
            P = _covariance(loud, *arguments)
            claimed[i, seed] = NOISE**2 * float(np.trace(P))
            actual[i, seed] = float(np.sum((found - truth) ** 2))
        on_step()
    rows: list[tuple[Cell, ...]] = []
    for i, (case, choice) in enumerate(choices):
        too_small = float(np.sqrt(actual[i].mean() / claimed[i].mean()))
        medians = [float(np.median(clean[i, j])) for j in range(len(CHECK_AFTER))]
        rms = float(np.sqrt(np.mean(noisy[i] ** 2)))
        rows.append((case, choice.name, f"{choice.p0:.3g}", choice.forgetting, *medians, rms, too_small))
    return Table(
        name="rls_against_mils",
        title=f"RLS and MILS compared, {seeds} random records",
        columns=(
            "memory",
            "estimator",
            "p0",
            "forgetting",
            *(f"no noise, {t:g} s: e, %" for t in CHECK_AFTER),
            f"noise, {DURATION:g} s: e rms, %",
            "real error / claimed by P",
        ),
        rows=rows,
        formats=(LINES, LINES, "", ".4f", ".2e", ".2e", ".2e", ".3f", ".2f"),
        marked=tuple(i for i, (_, choice) in enumerate(choices) if "fair" in choice.name),
        note=(
            f"Pitch channel, random rudder steps of ±0.25 rad; noise {NOISE:g} rad in the equation. Fair: "
            f"p0/p, and the forgetting "
            "that averages over as many rows. Errors against the correct values; median without noise, rms "
            "with."
        ),
    )


def _covariance(rows: Rows, p: int, forgetting: float, p0: float) -> Array:
    """P after these rows."""
    w, count = multiplicity(rows.y.size, p, forgetting), rows.y.size
    information = rows.phi.T @ (w[:, None] * rows.phi) + forgetting**count / p0 * np.eye(rows.phi.shape[1])
    return np.asarray(np.linalg.inv(information))
