"""The pictures of a diagnosis."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.ticker import NullFormatter

from host.catalogue import UNKNOWN
from host.catalogue.unknown import IN_LAYERS, terms_over_depth
from host.diagnosis.answer import Answer
from host.diagnosis.diagnose import Diagnosis
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.first_guess import smoothed_motion
from host.diagnosis.proof.foretold import foretold_errors
from host.diagnosis.proof.scoring import free_run_errors
from host.diagnosis.recordings.spans import divide
from host.diagnosis.separation import Separation
from host.identification.plots import MEASURED, MODEL, RUDDER, data_uri, line_through, plane_trace
from host.identification.uncertainty import covariance
from host.recordings.recording import Array, Recording

BASE_COLOUR, SIMULATION_COLOUR, BAND, JUDGING = "#dd8452", "#7b5ea7", "#e3edf4", "#f3f0e6"
DOUBT = "#f3d5cf"  # two deviations
BINS = 14


def base_name(answer: Answer) -> str:
    """What the base is called: equations fitted here, or the user's own model."""
    against = answer.against
    return "given model" if against is not None and against.kind == "model" else "base equations"


def runs_picture(answer: Answer) -> str:
    """Recording against base and extended model, and what each leaves; shaded what judges, dashed alarms."""
    found = answer.found
    recording = _longest(found)
    measured = np.vstack([recording.pitch, recording.depth])
    sides = [
        (name, colour, _errors(found, explanation, recording))
        for explanation, colour, name in (
            (found.base, BASE_COLOUR, base_name(answer)),
            (found.extended, MODEL, "extended model"),
        )
    ]
    figure, axes = plt.subplots(
        5, 1, figsize=(9.5, 8.6), sharex=True, gridspec_kw={"height_ratios": [3, 1.6, 3, 1.6, 1.2]}
    )
    rows = ((axes[0], axes[1], 1, 1.0, "depth, m"), (axes[2], axes[3], 0, np.degrees(1.0), "pitch, deg"))
    for main, rest, channel, scale, label in rows:
        main.plot(
            recording.time, scale * measured[channel], ".", color=MEASURED, markersize=2.5, label="measured"
        )
        if answer.against is not None:
            for k, one in enumerate(answer.against.recorded):
                values = scale * (one.pitch, one.depth)[channel]
                name = None if k else "simulation"
                main.plot(one.time, values, color=SIMULATION_COLOUR, linewidth=0.9, label=name)
        noise = 2.0 * scale * float(np.sqrt(found.floor[channel]))
        rest.axhspan(-noise, noise, color=BAND)
        for name, colour, errors in sides:
            run = scale * (measured[channel] - errors[channel])
            line_through(main, recording.time, run, color=colour, linewidth=1.2, label=name)
            line_through(rest, recording.time, scale * errors[channel], color=colour, linewidth=0.8)
        main.set_ylabel(label)
        rest.set_ylabel(f"left over,\n{label.split(', ')[1]}")
    if found.is_held_out:
        for span in divide([recording]).judging:
            for axis in axes:
                axis.axvspan(span.time[0], span.time[-1], color=JUDGING, zorder=-1)
    for alarm in recording.alarms:
        for axis in axes:
            axis.axvline(alarm, color="#444444", linestyle="--", linewidth=1.0, label="change looked for")
    axes[0].invert_yaxis()
    axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, ncols=4, markerscale=3)
    plane_trace(axes[4], recording)
    axes[4].set_xlabel("time, s")
    figure.align_ylabels()
    return data_uri(figure)


def _errors(found: Diagnosis, explanation: Explanation, recording: Recording) -> Array:
    """Of the free run, or of what is foretold where no free run is followed."""
    if found.horizon is None:
        return free_run_errors(explanation, recording)
    return foretold_errors(explanation, recording, found.horizon)


def proof_picture(answer: Answer) -> str:
    """Errors of the free runs before and after, beside the sensors' own noise."""
    found = answer.found
    before, after, floor = found.base_misfit, found.extended_misfit, np.sqrt(found.floor)
    figure, axes = plt.subplots(1, 2, figsize=(9.5, 1.5))
    sides = (
        ("depth, m rms", (before.depth_rmse_m, after.depth_rmse_m), float(floor[1])),
        (
            "pitch, deg rms",
            (np.degrees(before.pitch_rmse_rad), np.degrees(after.pitch_rmse_rad)),
            float(np.degrees(floor[0])),
        ),
    )
    for axis, (label, errors, noise) in zip(axes, sides, strict=True):
        bars = axis.barh(
            ["extended model", base_name(answer)], errors[::-1], color=[MODEL, BASE_COLOUR], height=0.6
        )
        axis.bar_label(bars, labels=[f"{error:.3g}" for error in errors[::-1]], padding=3)
        axis.axvline(noise, color="#444444", linestyle="--", linewidth=1.0)
        axis.set_xlim(0.0, 1.18 * max(*errors, noise))
        axis.locator_params(axis="x", nbins=5)
        axis.set_xlabel(f"{label} (dashed: sensor noise)")
        axis.grid(axis="y", visible=False)
        axis.set_axisbelow(True)
    figure.tight_layout()
    return data_uri(figure)


def slots_picture(found: Diagnosis) -> str:
    """Shares of the slots, and what each effect alone would gain; empty where there is nothing to share."""
    if not any(found.slots.values()):
        return ""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 2.9))
    slots = list(found.slots)
    left.barh(slots[::-1], [100 * found.slots[slot] for slot in slots][::-1], color=RUDDER)
    left.set_xlim(0.0, 100.0)
    left.set_xlabel("share of the mismatch, %")
    best = [pair for pair in found.ranking if pair[1] > 0.0][:10][::-1]
    named = {effect.name for effect in found.effects}
    right.barh(
        [name.replace("_", " ") for name, _ in best],
        [gain for _, gain in best],
        color=[MODEL if name in named else MEASURED for name, _ in best],
    )
    if best and best[-1][1] > 20.0 * best[0][1]:
        right.set_xscale("log")
        right.xaxis.set_minor_formatter(NullFormatter())
    alone = "gain in the information criterion, alone (red: in the answer)"
    right.set_xlabel(alone if found.is_ranked_alone else "loss in the information criterion without it")
    for axis in (left, right):
        axis.grid(axis="y", visible=False)
        axis.set_axisbelow(True)
    figure.tight_layout()
    return data_uri(figure)


def force_picture(found: Diagnosis) -> str:
    """The missing force and moment along the recording, and over the motion with the mean of each range."""
    recording = _longest(found)
    speed = float(found.extended.fit.parameters[found.extended.fit.structure.names.index("u0")])
    motion = smoothed_motion(recording, speed)
    figure, axes = plt.subplots(
        2, 3, figsize=(9.5, 4.8), gridspec_kw={"width_ratios": [2.4, 1, 1]}, sharey="row"
    )
    states = {
        "w": (1.0, "heave velocity, m/s"),
        "q": (np.degrees(1.0), "pitch rate, deg/s"),
        "theta": (np.degrees(1.0), "pitch, deg"),
    }
    rows = (("force, m/s^2", ("w", "q")), ("moment, rad/s^2", ("q", "theta")))
    for (along, *over), values, std, (label, keys) in zip(
        axes, found.force.values, found.force.std, rows, strict=True
    ):
        along.fill_between(recording.time, values - 2 * std, values + 2 * std, color=DOUBT, linewidth=0)
        along.plot(recording.time, values, color=MODEL, linewidth=0.9)
        along.axhline(0.0, color="#444444", linewidth=0.6)
        along.set_ylabel(f"missing {label}")
        reach = 1.3 * float(np.quantile(np.abs(values) + std, 0.995))
        along.set_ylim(-reach, reach)
        for axis, key in zip(over, keys, strict=True):
            scale, name = states[key]
            axis.plot(scale * motion[key], values, ".", color=MODEL, markersize=1.5, alpha=0.25)
            axis.plot(*_means(scale * motion[key], values), "o-", color="#222222", markersize=3)
            axis.set_xlabel(name)
    axes[1][0].set_xlabel("time, s")
    figure.tight_layout()
    return data_uri(figure)


def layers_picture(found: Diagnosis) -> str:
    """What acts over the depth by the forms in layers, two deviations of it, and how long it was there."""
    fit = found.extended.fit
    forms = sorted(found.extended.names & IN_LAYERS)
    if not forms:
        return ""
    spread = covariance(fit)
    values = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    dwelt = np.concatenate([recording.depth for recording in found.recordings])
    dwelt = dwelt[np.isfinite(dwelt)]
    figure, axes = plt.subplots(
        1, len(forms) + 1, figsize=(9.5, 3.4), sharey=True, width_ratios=[*(2.4 for _ in forms), 1.0]
    )
    for axis, form in zip(axes, (UNKNOWN[name] for name in forms), strict=False):
        depths, terms = terms_over_depth(form.name, values)
        own = [fit.structure.names.index(share.name) for share in form.parameters[: terms.shape[1]]]
        sizes, std = terms @ fit.parameters[own], np.sqrt(np.sum(terms @ spread[np.ix_(own, own)] * terms, 1))
        axis.fill_betweenx(depths, sizes - 2 * std, sizes + 2 * std, color=DOUBT, linewidth=0)
        axis.plot(sizes, depths, color=MODEL, linewidth=1.2)
        reach = max(np.ptp(sizes), 1e-9)
        axis.set_xlim(sizes.min() - 0.4 * reach, sizes.max() + 0.4 * reach)
        what = form.name.removeprefix("unknown_").removesuffix("_in_layers")
        axis.set_xlabel(f"{what} but for a constant, {form.parameters[0].unit}")
    axes[-1].hist(dwelt, bins=30, orientation="horizontal", color=MEASURED)
    axes[-1].set_xlabel("rows read there")
    axes[0].set_ylabel("depth, m")
    axes[0].set_ylim(dwelt.max(), dwelt.min())
    figure.tight_layout()
    return data_uri(figure)


def separation_picture(separations: Iterable[Separation]) -> str:
    """The plane movement to fly, and what then stands between the two explanations, over sensor noise."""
    flown = [one for one in separations if one.manoeuvre is not None and one.difference.size]
    if not flown:
        return ""
    figure, axes = plt.subplots(2, len(flown), figsize=(9.5, 3.4), squeeze=False, sharex="col")
    for (above, below), one in zip(axes.T, flown, strict=True):
        assert one.manoeuvre is not None
        rows = min(one.manoeuvre.rudder.size, one.difference.shape[1], round(120.0 / one.manoeuvre.step))
        time = np.arange(rows) * one.manoeuvre.step
        above.step(time, np.degrees(one.manoeuvre.rudder[:rows]), where="post", color=RUDDER, linewidth=0.9)
        above.set_title(
            f"{one.effect.replace('_', ' ')}\nor {one.twin.replace('_', ' ')}: {one.manoeuvre.name}",
            fontsize=9,
        )
        for values, colour, name in zip(one.difference, (MODEL, "#222222"), ("pitch", "depth"), strict=True):
            below.plot(time, values[:rows], color=colour, linewidth=1.0, label=name)
        below.axhspan(-1.0, 1.0, color=BAND, zorder=-1)
        below.set_xlabel("time, s")
    axes[0][0].set_ylabel("plane, deg")
    axes[1][0].set_ylabel("difference,\nin sensor noise")
    axes[1][0].legend(frameon=False, ncols=2)
    figure.tight_layout()
    return data_uri(figure)


def _longest(found: Diagnosis) -> Recording:
    return max(found.recordings, key=lambda recording: recording.duration)


def _means(over: Array, values: Array) -> tuple[Any, Any]:
    """Means of `values` in ranges of `over` that hold enough to be worth a mean."""
    edges = np.linspace(over.min(), over.max(), BINS + 1)
    index = np.clip(np.digitize(over, edges) - 1, 0, BINS - 1)
    counts = np.bincount(index, minlength=BINS)
    enough = counts >= max(5, 0.005 * over.size)
    sums = np.bincount(index, weights=values, minlength=BINS)
    middles = 0.5 * (edges[1:] + edges[:-1])
    return middles[enough], sums[enough] / counts[enough]
