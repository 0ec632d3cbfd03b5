"""Tables 2 to 6: RLS and MILS p = 3, 5, 8 on the paper's vehicle, each error against both "real values"."""

from collections.abc import Callable
from dataclasses import dataclass
from math import radians

import numpy as np

from firmware_model import physical_from_car
from host.recordings.recording import Array
from tools.paper.printed import (
    PHYSICAL,
    Estimates,
    as_printed,
    correct_truth,
    printed,
    printed_estimates,
    printed_truth,
    relative_error,
)
from tools.paper.regression import Rows, Textbook, rows_of, square_root, textbook
from tools.paper.rudder import H
from tools.paper.search import FORGETTING, Record, Search, estimates_of, from_rest
from tools.paper.table import LINES, Table

LENGTHS = (1, 3, 5, 8)
CHANNELS = ("alpha", "beta")


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One estimator on one record: the paper's unguarded update, the vehicle's estimator, and no recursion.

    at_times  (K, n) at the times of the paper's table, exactly
    """

    block: Estimates
    record: Record
    rows: Rows
    unguarded: Textbook
    guarded: Array
    at_times: Array

    def at(self, history: Array) -> Array:
        """A history (N, n) at the times of the table, (K, n)."""
        count = np.searchsorted(self.rows.k, np.rint(self.block.times * self.record.second / H), side="right")
        return np.asarray(history[np.maximum(count - 1, 0)])

    @property
    def lost_at(self) -> float | None:
        """Seconds after which P of the unguarded update was not positive definite any more."""
        lost = self.unguarded.lost_at
        return None if lost is None else float(self.rows.k[lost] * H)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction:
    """Runs by channel and p: on the assumed input, and on the record that comes nearest to the printed "
    "numbers."""

    assumed: dict[str, dict[int, Run]]
    nearest: dict[str, dict[int, Run]]


def assumed_amplitude() -> float:
    """rad; the largest rudder angle of Table 7, since the paper does not say."""
    return radians(printed()["table7"]["largest_angle_deg"])


def reproduce(searches: dict[str, list[Search]], on_step: Callable[[], None] = lambda: None) -> Reproduction:
    """Sixteen runs: two channels, four innovation lengths, two records each."""
    assumed: dict[str, dict[int, Run]] = {}
    nearest: dict[str, dict[int, Run]] = {}
    for channel in CHANNELS:
        likely = next(from_rest(channel, assumed_amplitude()))
        best = min(searches[channel], key=lambda one: one.distance).best
        for record, into in ((likely, assumed), (best, nearest)):
            into[channel] = {}
            for block in printed_estimates(channel):
                into[channel][block.p] = _run(channel, record, block)
            on_step()
    return Reproduction(assumed=assumed, nearest=nearest)


def _run(channel: str, record: Record, block: Estimates) -> Run:
    rows, forgetting = rows_of(channel, record.output, record.rudder), FORGETTING[channel]
    return Run(
        block=block,
        record=record,
        rows=rows,
        unguarded=textbook(rows, block.p, forgetting),
        guarded=square_root(rows, block.p, forgetting),
        at_times=estimates_of(channel, record, block),
    )


def estimates_tables(result: Reproduction) -> list[Table]:
    """Tables 2-3 and 4-5 beside the paper's own numbers."""
    tables = []
    for channel, numbers in (("alpha", "2 and 3"), ("beta", "4 and 5")):
        wrong, right = getattr(printed_truth(), channel), getattr(correct_truth(), channel)
        rows = []
        for p in LENGTHS:
            best, likely = result.nearest[channel][p], result.assumed[channel][p]
            block = best.block
            for i, t in enumerate(block.times):
                rows.append(
                    (
                        block.table,
                        "RLS" if p == 1 else f"MILS p = {p}",
                        int(t),
                        _numbers(block.values[i]),
                        float(block.errors[i]),
                        float(relative_error(block.values[i], right)),
                        _numbers(best.at_times[i]),
                        float(relative_error(best.at_times[i], wrong)),
                        float(relative_error(best.at_times[i], right)),
                        float(relative_error(likely.at_times[i], wrong)),
                        float(relative_error(likely.at_times[i], right)),
                    )
                )
        last = len(printed_estimates(channel)[0].times)
        names = "alpha1 ... alpha3" if channel == "alpha" else "beta1 ... beta7"
        record = result.nearest[channel][1].record
        extra = f", extra {record.extra:.2g}" if record.extra > 0.0 else ""
        tables.append(
            Table(
                name=f"tables_{numbers.replace(' and ', '_')}",
                title=f"Tables {numbers}: {names}, forgetting {FORGETTING[channel]:g}",
                columns=(
                    "table",
                    "method",
                    "t, s",
                    "paper: estimates",
                    "paper: printed e, %",
                    "paper: e against correct, %",
                    "nearest record: estimates",
                    "nearest: e against printed, %",
                    "nearest: e against correct, %",
                    "13°: e against printed, %",
                    "13°: e against correct, %",
                ),
                rows=rows,
                formats=("d", LINES, "d", LINES, ".2f", ".2f", LINES, ".2f", ".2f", ".2f", ".2f"),
                marked=tuple(range(last - 1, len(rows), last)),
                note=(
                    f"Nearest record: {record.kind}, amplitude {record.amplitude:.3g}{extra}. 13° sine: from "
                    f"rest, 0.01 Hz. "
                    "Solved exactly, so that no rounding of the recursion is in these columns."
                ),
            )
        )
    return tables


def _numbers(values: Array) -> str:
    """On one line, or one line for the output's and one for the rudder's coefficients."""
    texts = [f"{value:.4f}".replace("-", "−") for value in values]
    return "  ".join(texts) if len(texts) == 3 else "\n".join(("  ".join(texts[:4]), "  ".join(texts[4:])))


def survival_table(result: Reproduction) -> Table:
    """Does the paper's own update stay a covariance update, and what does it cost when it does not?"""
    rows = []
    for name, runs in (("13° sine from rest", result.assumed), ("nearest record", result.nearest)):
        for channel in CHANNELS:
            right = getattr(correct_truth(), channel)
            for p in LENGTHS:
                run = runs[channel][p]
                ends = [run.at_times, run.at(run.unguarded.history), run.at(run.guarded)]
                worst = np.nanmax(
                    np.where(
                        np.isfinite(run.unguarded.history).all(axis=1),
                        relative_error(run.unguarded.history, right),
                        np.nan,
                    )
                )
                rows.append(
                    (
                        name,
                        "pitch" if channel == "alpha" else "depth",
                        "RLS" if p == 1 else f"MILS p = {p}",
                        run.lost_at,
                        *(float(relative_error(values[-1], right)) for values in ends),
                        float(worst),
                    )
                )
    return Table(
        name="unguarded_update",
        title="Does the paper's update survive its own data?",
        columns=(
            "record",
            "channel",
            "method",
            "P indefinite from, s",
            "exact: e, %",
            "paper's update: e, %",
            "vehicle's estimator: e, %",
            "paper's update: worst e on the way, %",
        ),
        rows=rows,
        formats=(LINES, "", LINES, ".1f", ".2f", ".2f", ".2f", ".1f"),
        note=(
            "At the last time of the paper's tables, against the correct values. Exact: the same weighted "
            "least squares without "
            "recursion. The vehicle's estimator carries a square root of P and does not forget beyond the "
            "prior, so "
            "it may lag behind the exact answer where forgetting winds P up."
        ),
        marked=tuple(i for i, row in enumerate(rows) if row[3] is not None),
    )


def to_physical(alpha: Array, beta: Array) -> Array:
    """a1, a2, a3, b1, b2 the way Table 6 was made: a1 from beta1 alone, b1 from beta5 alone (printed "
    "signs)."""
    a2 = (alpha[0] - 2.0) / H
    return np.array(
        [(beta[0] - 4.0) / H - a2, a2, (alpha[0] + alpha[1] - 1.0) / H**2, beta[4] / H**2, alpha[2] / H**2]
    )


def table6(result: Reproduction) -> Table:
    """Table 6, and the same with a conversion that uses all seven betas."""
    rows = []
    wrong, right = printed_truth().physical, correct_truth().physical
    for p in LENGTHS:
        paper = printed()["table6"][f"p{p}"]
        alpha, beta = _last_printed("alpha", p), _last_printed("beta", p)
        name = "RLS" if p == 1 else f"MILS p = {p}"
        sources = (
            ("printed in Table 6", np.array(paper["estimate"]), paper["error"]),
            ("from the printed Tables 2-5", to_physical(alpha, beta), None),
            ("nearest record", _converted(result.nearest, p), None),
            ("13° sine", _converted(result.assumed, p), None),
            ("nearest record, all of beta used", _all_of_beta(result.nearest, p), None),
        )
        for source, values, error in sources:
            against = (float(relative_error(values, real)) for real in (wrong, right))
            rows.append((name, source, *(float(v) for v in values), error, *against))
    rows.append(("real value", "printed", *(float(v) for v in wrong), None, None, None))
    rows.append(("real value", "correct, from Table 1", *(float(v) for v in right), None, None, None))
    return Table(
        name="table_6",
        title="Table 6: hydrodynamic coefficients",
        columns=(
            "method",
            "source",
            *PHYSICAL,
            "e printed, %",
            "e against printed, %",
            "e against correct, %",
        ),
        rows=rows,
        formats=(LINES, LINES, *[".4f"] * 5, ".4f", ".4f", ".4f"),
        note="The printed a1 and b1 follow from beta1 and beta5 alone; the other five are not used.",
        marked=tuple(range(0, 20, 5)),
    )


def _last_printed(channel: str, p: int) -> Array:
    return next(block.values[-1] for block in printed_estimates(channel) if block.p == p)


def _converted(runs: dict[str, dict[int, Run]], p: int) -> Array:
    return to_physical(runs["alpha"][p].at_times[-1], runs["beta"][p].at_times[-1])


def _all_of_beta(runs: dict[str, dict[int, Run]], p: int) -> Array:
    alpha, beta = (as_printed(runs[channel][p].at_times[-1]) for channel in CHANNELS)
    found = physical_from_car(alpha.tolist(), beta.tolist(), printed()["table1"]["u0"], H)
    return np.array([getattr(found, name) for name in PHYSICAL])
