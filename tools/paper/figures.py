"""The paper's Figures 1 to 8, and the figures of what it leaves open."""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.lines import Line2D

from firmware_model import car_from_physical
from host.identification.plots import MEASURED, MODEL, RUDDER, data_uri
from host.recordings.recording import Array
from tools.paper.equivalence import Equality
from tools.paper.lake import DEGREES, LENGTH, Lake
from tools.paper.lake_data import CHANNELS
from tools.paper.missing import DATA, PATTERNS, Study
from tools.paper.printed import as_printed, correct_truth, physical_truth, printed, printed_truth
from tools.paper.regression import respond
from tools.paper.reproduction import LENGTHS, Reproduction, Run, to_physical
from tools.paper.rudder import H, sine
from tools.paper.search import Search

COLOURS = {1: "#2c6e9b", 3: "#d98324", 5: "#7a5195", 8: "#2f855a"}
LABELS = {"w": "w, m/s", "q": "q, rad/s", "theta": "θ, deg"}


def _name(p: int) -> str:
    return "RLS" if p == 1 else f"MILS p = {p}"


def rudder_figure(result: Reproduction) -> str:
    """Figure 1."""
    run = result.assumed["alpha"][1]
    t = np.arange(run.record.rudder.size) * H
    figure, axis = plt.subplots(figsize=(9.5, 1.9))
    axis.plot(t, np.degrees(run.record.rudder), color=RUDDER, linewidth=1.2)
    axis.set(xlabel="time, s", ylabel="rudder, deg")
    return data_uri(figure)


def estimates_figure(runs: dict[int, Run], channel: str) -> str:
    """Figures 2 and 3: estimates over time; dashes are the correct values, dots the printed ones, circles "
    "the paper's."""
    right, wrong = getattr(correct_truth(), channel), getattr(printed_truth(), channel)
    n, letter = right.size, "α" if channel == "alpha" else "β"
    wide = n > 3
    until = float(runs[1].block.times[-1])
    figure, axes = plt.subplots(
        (n + 1) // 2 if wide else n, 2 if wide else 1, figsize=(9.5, 7.2 if wide else 5.4), sharex=True
    )
    for i, axis in enumerate(axes.flat):
        if i >= n:
            axis.axis("off")
            continue
        for p, run in runs.items():
            t = run.rows.k * H
            axis.plot(t, run.guarded[:, i], color=COLOURS[p], linewidth=1.1, label=_name(p))
            axis.plot(
                run.block.times,
                run.block.values[:, i],
                "o",
                color=COLOURS[p],
                markersize=3.5,
                markerfacecolor="white",
            )
        axis.axhline(right[i], color="black", linestyle="--", linewidth=0.9)
        axis.axhline(wrong[i], color="#c0392b", linestyle=":", linewidth=1.2)
        reach = np.concatenate([run.block.values[:, i] for run in runs.values()] + [[right[i], wrong[i]]])
        margin = 0.25 * float(np.ptp(reach)) + 1e-3
        axis.set(
            xlim=(0.0, 1.02 * until),
            ylim=(reach.min() - margin, reach.max() + margin),
            ylabel=f"{letter}{i + 1}",
        )
    axes.flat[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, ncols=4)
    for axis in axes.flat[-2 if wide else -1 :]:
        axis.set_xlabel("time, s")
    figure.align_ylabels()
    return data_uri(figure)


def motion_figure(result: Reproduction, channel: str) -> str:
    """Figures 4 and 5: pitch or depth under the sine, simulated with the coefficients of Table 6."""
    rudder = sine(np.radians(printed()["table7"]["largest_angle_deg"]), 200.0)
    t = np.arange(rudder.size) * H
    true = respond(getattr(correct_truth(), channel), rudder)
    scale, label = (180.0 / np.pi, "pitch, deg") if channel == "alpha" else (1.0, "depth, m")
    figure, (main, rest) = plt.subplots(
        2, 1, figsize=(9.5, 3.8), sharex=True, gridspec_kw={"height_ratios": [2.2, 1]}
    )
    main.plot(t, scale * true, color=MEASURED, linewidth=3.0, label="true")
    for p in LENGTHS:
        both = [result.nearest[name][p].at_times[-1] for name in ("alpha", "beta")]
        values = dict(zip(physical_truth(), to_physical(*both).tolist(), strict=True))
        car = car_from_physical(**values, u0=printed()["table1"]["u0"], h=H)
        with np.errstate(all="ignore"):
            found = respond(as_printed(np.array(car[0 if channel == "alpha" else 1])), rudder)
        main.plot(t, scale * found, color=COLOURS[p], linewidth=1.0, label=_name(p))
        rest.plot(t, scale * (found - true), color=COLOURS[p], linewidth=0.9)
    main.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, ncols=5)
    main.set_ylabel(label)
    rest.set(xlabel="time, s", ylabel="error")
    if channel == "beta":
        main.invert_yaxis()
    figure.align_ylabels()
    return data_uri(figure)


def search_figure(searches: dict[str, list[Search]]) -> str:
    """How far each kind of record stays from the printed estimates, over its amplitude."""
    figure, axes = plt.subplots(1, 2, figsize=(9.5, 3.4), sharey=True)
    palette = ["#2c6e9b", "#8d99a6", "#d98324", "#7a5195", "#2f855a", "#c0392b"]
    for axis, (channel, each) in zip(axes, searches.items(), strict=True):
        for colour, one in zip(palette, each, strict=False):
            label = one.kind.split(" (")[0]
            axis.semilogx(one.amplitudes, one.distances, color=colour, linewidth=1.4, label=label)
        axis.set(
            title="Tables 2, 3 (pitch)" if channel == "alpha" else "Tables 4, 5 (depth)",
            xlabel="rudder amplitude",
            ylim=(0, 105),
        )
        axis.axvline(
            np.radians(printed()["table7"]["largest_angle_deg"]), color="black", linestyle=":", linewidth=0.9
        )
    axes[0].set_ylabel("distance from the printed\nestimates, % of norm")
    figure.legend(
        *axes[0].get_legend_handles_labels(),
        loc="upper center",
        bbox_to_anchor=(0.5, -0.02),
        frameon=False,
        ncols=2,
    )
    return data_uri(figure)


def equality_figure(found: Equality) -> str:
    """MILS lies on RLS with the weaker prior."""
    figure, axis = plt.subplots(figsize=(9.5, 2.9))
    axis.loglog(found.time, found.rls, color=COLOURS[1], label="RLS, prior p0")
    axis.loglog(
        found.time,
        found.mils,
        color=COLOURS[5],
        linewidth=3.5,
        alpha=0.45,
        label=f"MILS p = {found.p}, prior p0",
    )
    axis.loglog(
        found.time,
        found.rls_weaker_prior,
        color="black",
        linewidth=1.0,
        linestyle="--",
        label=f"RLS, prior {found.p} p0",
    )
    axis.set(xlabel="time, s", ylabel="error, %")
    axis.legend(frameon=False)
    return data_uri(figure)


def cleaning_figure(found: Lake) -> str:
    """Figure 6: before and after."""
    data, span = found.learnt, slice(0, 800)
    figure, axes = plt.subplots(3, 1, figsize=(9.5, 5.2), sharex=True)
    for axis, name in zip(axes, CHANNELS, strict=True):
        axis.plot(
            data.time[span],
            DEGREES[name] * data.logged[name][span],
            ".",
            color=MEASURED,
            markersize=2.5,
            label="as logged",
        )
        axis.plot(
            data.time[span],
            DEGREES[name] * data.cleaned[name][span],
            color=MODEL,
            linewidth=1.1,
            label="cleaned and low-passed",
        )
        axis.set_ylabel(LABELS[name])
    axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, ncols=2, markerscale=3)
    axes[-1].set_xlabel("time, s")
    figure.align_ylabels()
    return data_uri(figure)


def lake_parameters_figure(found: Lake) -> str:
    """Figure 7: theta1 and theta2 over time."""
    labels = ("θ1: w'", "θ1: w", "θ1: q", "θ1: Mδ δ", "θ2: q'", "θ2: w", "θ2: q", "θ2: Zδ δ")
    figure, axes = plt.subplots(4, 2, figsize=(9.5, 5.6), sharex=True)
    for p, colour in ((1, COLOURS[1]), (LENGTH, COLOURS[8])):
        model = found.models[p]
        table = np.hstack([model.theta1, model.theta2])
        for i, label in enumerate(labels):
            axis = axes[i % 4, i // 4]
            axis.plot(model.time, table[:, i], color=colour, linewidth=1.6 if p == 1 else 0.9, label=_name(p))
            axis.set_ylabel(label)
            late = table[table.shape[0] // 20 :, i]
            margin = 0.3 * float(np.ptp(late)) + 1e-6
            axis.set_ylim(late.min() - margin, late.max() + margin)
    axes[0, 0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, ncols=2)
    for axis in axes[-1]:
        axis.set_xlabel("time, s")
    figure.align_ylabels()
    return data_uri(figure)


def lake_flight_figure(found: Lake) -> str:
    """Figure 8: the free run over the held-out trial."""
    data = found.held_out
    figure, axes = plt.subplots(
        4, 1, figsize=(9.5, 6.2), sharex=True, gridspec_kw={"height_ratios": [2, 2, 2, 1]}
    )
    for axis, name in zip(axes, CHANNELS, strict=False):
        axis.plot(
            data.time,
            DEGREES[name] * data.cleaned[name],
            color=MEASURED,
            linewidth=2.4,
            label="recorded, cleaned",
        )
        for p, colour in ((1, COLOURS[1]), (LENGTH, COLOURS[8])):
            axis.plot(
                data.time,
                DEGREES[name] * found.flights[p][name],
                color=colour,
                linewidth=1.0,
                label=f"free run, {_name(p)}",
            )
        axis.set_ylabel(LABELS[name])
    axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, ncols=3)
    axes[3].step(data.time, np.degrees(data.rudder), where="post", color=RUDDER, linewidth=0.9)
    axes[3].set(ylabel="rudder, deg", xlabel="time, s")
    figure.align_ylabels()
    return data_uri(figure)


def missing_figure(found: Study) -> str:
    """Parameter error and held-out depth error over the share missing, for each kind of data."""
    figure, axes = plt.subplots(2, len(DATA), figsize=(9.8, 5.4), sharex=True)
    shares = 100.0 * np.array(found.shares)
    for d, data in enumerate(DATA):
        for row, (values, label) in enumerate(
            ((found.parameters, "parameter error, %"), (found.depth, "held-out depth error, %"))
        ):
            axis = axes[row, d]
            for m, method in enumerate(found.methods):
                for p, style in enumerate(("-", "--")):
                    middle = _median(values[d, p, :, m])
                    axis.semilogy(
                        shares,
                        middle,
                        style,
                        marker="o",
                        markersize=3,
                        color=method.colour,
                        linewidth=1.3,
                    )
            axis.set_ylim(1e-4, 2e3)
            if row == 0:
                axis.set_title(data, fontsize=9)
            else:
                axis.set_xlabel("missing, %")
            if d == 0:
                axis.set_ylabel(label)
    keys = [Line2D([], [], color=m.colour, marker="o", markersize=3, label=m.name) for m in found.methods]
    keys.append(Line2D([], [], color="k", linestyle="-", linewidth=1.3, label=PATTERNS[0]))
    keys.append(Line2D([], [], color="k", linestyle="--", linewidth=1.3, label=PATTERNS[1]))
    figure.legend(handles=keys, loc="upper center", bbox_to_anchor=(0.5, 0.01), frameon=False, ncols=4)
    figure.tight_layout()
    return data_uri(figure)


def _median(values: Array) -> Array:
    middle = np.median(values, axis=-1)
    return np.where(np.isfinite(middle), np.maximum(middle, 1.2e-4), np.nan)
