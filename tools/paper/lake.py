"""Section 6: RLS and MILS p = 8 on w, q, theta, and the free run of what they find on the recorded rudder."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from host.recordings.recording import Array
from tools.paper.lake_data import (
    CHANNELS,
    STEP,
    Trial,
    derivative,
    lake_hull,
    low_pass,
    rudder_force,
    solved_form,
    trial,
)
from tools.paper.printed import printed
from tools.paper.regression import Rows, square_root
from tools.paper.table import Table

LENGTH = 8
SETTLING = 40  # rows at each end that the low-pass still feels
NAMES = (
    ("w' per w", "1/s"),
    ("w' per q", "m/s per s per rad/s"),
    ("w' per rudder", "m/s² per rad"),
    ("q' per w", "rad/s² per m/s"),
    ("q' per q", "1/s"),
    ("q' per rudder", "1/s²"),
)
DEGREES = {"w": 1.0, "q": 1.0, "theta": 180.0 / np.pi}


@dataclass(frozen=True, slots=True, kw_only=True)
class LakeModel:
    """History of theta1 (N, 4) and theta2 (N, 4), and the form solved for w', q' that follows from the last "
    "(2, 3)."""

    p: int
    time: Array
    theta1: Array
    theta2: Array
    solved: Array


def identify_lake(data: Trial, p: int) -> LakeModel:
    """y1 = q' on [w', w, q, Mdelta delta], y2 = w' on [q', w, q, Zdelta delta]; all signals through one "
    "low-pass."""
    force, moment = rudder_force()
    w, q = data.cleaned["w"], data.cleaned["q"]
    # A held rudder acts between rows, so at a row it counts as the mean of before and after.
    delta = low_pass(0.5 * (data.rudder + np.concatenate([data.rudder[:1], data.rudder[:-1]])))
    inner = slice(SETTLING, w.size - SETTLING)
    w_rate, q_rate = derivative(w), derivative(q)
    k = np.arange(w.size)[inner]
    pitch = Rows(np.column_stack([w_rate, w, q, moment * delta])[inner], q_rate[inner], k)
    heave = Rows(np.column_stack([q_rate, w, q, force * delta])[inner], w_rate[inner], k)
    theta1, theta2 = square_root(pitch, p), square_root(heave, p)
    one, two = theta1[-1], theta2[-1]
    coupled = np.array([[1.0, -two[0]], [-one[0], 1.0]])
    right = np.array([[two[1], two[2], two[3] * force], [one[1], one[2], one[3] * moment]])
    return LakeModel(
        p=p, time=data.time[inner], theta1=theta1, theta2=theta2, solved=np.linalg.solve(coupled, right)
    )


def fly_lake(solved: Array, data: Trial) -> dict[str, Array]:
    """w, q, theta of the free run: the recorded rudder, and the first cleaned values to start from."""
    A = np.zeros((4, 4))
    A[:2, :2], A[:2, 3], A[2, 1] = solved[:, :2], solved[:, 2], 1.0
    E = expm(A * STEP)
    x = np.array([data.cleaned[name][0] for name in CHANNELS])
    states = np.empty((3, data.time.size))
    with np.errstate(over="ignore", invalid="ignore"):
        for k, delta in enumerate(data.rudder):
            states[:, k] = x
            x = E[:3, :3] @ x + E[:3, 3] * delta
    return dict(zip(CHANNELS, states, strict=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class Lake:
    """The trial learnt from, one held out, the models by p, and their free runs over the held-out one."""

    learnt: Trial
    held_out: Trial
    models: dict[int, LakeModel]
    flights: dict[int, dict[str, Array]]


def lake(righting_arm: float = 0.0, duration: float = 200.0) -> Lake:
    """The whole of Section 6."""
    learnt = trial(1, duration, righting_arm=righting_arm)
    held_out = trial(2, duration / 2.0, righting_arm=righting_arm)
    models = {p: identify_lake(learnt, p) for p in (1, LENGTH)}
    flights = {p: fly_lake(model.solved, held_out) for p, model in models.items()}
    return Lake(learnt=learnt, held_out=held_out, models=models, flights=flights)


def errors_of(flight: dict[str, Array], data: Trial) -> tuple[dict[str, float], dict[str, float]]:
    """MAE and MSE by channel against the cleaned record; w m/s, q rad/s, theta deg."""
    gaps = {name: DEGREES[name] * (flight[name] - data.cleaned[name]) for name in CHANNELS}
    mean = {name: float(np.mean(np.abs(gap))) for name, gap in gaps.items()}
    return mean, {name: float(np.mean(gap**2)) for name, gap in gaps.items()}


def table8(as_modelled: Lake, with_righting: Lake) -> Table:
    """Table 8 beside ours; the paper's data are not public, so only the orders of magnitude can be "
    "compared."""
    rows: list[tuple[str | float, ...]] = []
    for name, key in (("RLS", "rls"), ("MILS p = 8", "mils")):
        t = printed()["table8"]
        mean, square = t[f"mae_{key}"], t[f"mse_{key}"]
        rows.append(("printed in Table 8 (other data)", name, *_six(mean, square)))
    for source, found in (
        ("simulated trial, held out", as_modelled),
        ("the same vehicle with a righting moment", with_righting),
    ):
        for p, name in ((1, "RLS"), (LENGTH, "MILS p = 8")):
            rows.append((source, name, *_six(*errors_of(found.flights[p], found.held_out))))
        exact = fly_lake(solved_form(lake_hull()), found.held_out)
        if found is as_modelled:
            rows.append(
                (source, "true coefficients (what noise leaves)", *_six(*errors_of(exact, found.held_out)))
            )
    return Table(
        name="table_8",
        title="Table 8: error of the free run",
        columns=(
            "data",
            "method",
            "MAE w, m/s",
            "MAE θ, deg",
            "MAE q, rad/s",
            "MSE w",
            "MSE θ",
            "MSE q",
        ),
        rows=rows,
        formats=("", "", ".4f", ".3f", ".5f", ".2e", ".2e", ".2e"),
        marked=(0, 1),
        note=(
            "The units of Table 8 are not printed; m/s, degrees and rad/s are assumed. θ is integrated from "
            "q, so it shows "
            "every small error of q. The model of Section 6 has no righting moment: on a vehicle that has "
            "one it drifts."
        ),
    )


def _six(mean: dict[str, float], square: dict[str, float]) -> tuple[float, ...]:
    order = ("w", "theta", "q")
    return tuple(float(one[name]) for one in (mean, square) for name in order)


def coefficients_table(found: Lake) -> Table:
    """The six coefficients that can be told, and the eight of theta1, theta2 that cannot."""
    truth = solved_form(lake_hull()).ravel()
    learnt = [found.models[p].solved.ravel() for p in (1, LENGTH)]
    rows: list[tuple[str | float | None, ...]] = [
        (name, unit, float(true), *(float(one[i]) for one in learnt))
        for i, ((name, unit), true) in enumerate(zip(NAMES, truth, strict=True))
    ]
    hull = lake_hull()
    pitch_inertia, heave_mass = hull.Iy - hull.Mqdot, hull.mass - hull.Zwdot
    singles = (
        ("theta1: Mwdot/(Iy − Mqdot)", "1/m", hull.Mwdot / pitch_inertia, "theta1", 0),
        ("theta1: 1/(Iy − Mqdot)", "1/(kg m²)", 1.0 / pitch_inertia, "theta1", 3),
        ("theta2: Zqdot/(m − Zwdot)", "m", hull.Zqdot / heave_mass, "theta2", 0),
        ("theta2: 1/(m − Zwdot)", "1/kg", 1.0 / heave_mass, "theta2", 3),
    )
    for name, unit, true, which, at in singles:
        values = (float(getattr(found.models[p], which)[-1][at]) for p in (1, LENGTH))
        rows.append((name, unit, true, *values))
    return Table(
        name="section_6_coefficients",
        title="Section 6: what was found, and what cannot be",
        columns=("coefficient", "unit", "true", "RLS", "MILS p = 8"),
        rows=rows,
        formats=("", "", ".4f", ".4f", ".4f"),
        marked=tuple(range(6, 10)),
        note=(
            "Upper six: the equations solved for w' and q'. Lower four (tinted): entries of theta1 and "
            "theta2 as the paper writes them; "
            "they depend on noise and prior, because the regressors are linearly dependent (see the errata)."
        ),
    )
