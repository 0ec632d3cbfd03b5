"""Pictures for reports, each returned as a PNG data URI so that a report is one file."""

import base64
from io import BytesIO
from typing import Any

import matplotlib
import numpy as np

from host.identification.predict import Prediction
from host.noise.whiteness import autocovariance
from host.recordings.recording import Array, Recording

matplotlib.use("Agg")
from matplotlib import pyplot as plt

MEASURED, MODEL, RUDDER, RESIDUAL = "#9aa5b1", "#c0392b", "#2c6e9b", "#444444"
plt.rcParams.update(
    {
        "font.size": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.color": "#e8ebee",
        "axes.edgecolor": "#9aa5b1",
        "figure.dpi": 110,
        "savefig.bbox": "tight",
    }
)


def data_uri(figure: Any) -> str:
    """The figure as an embeddable PNG; the figure is closed."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png")
    plt.close(figure)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def line_through(axis: Any, time: Array, values: Array, **style: Any) -> None:
    """A line through the values that are known: of a slow sensor no two rows side by side are."""
    known = np.isfinite(values)
    axis.plot(time[known], values[known], **style)


def free_run_plot(prediction: Prediction) -> str:
    """Depth, pitch and rudder over time: what was measured against the free run, and what is left over."""
    recording, (pitch, depth) = prediction.recording, prediction.outputs
    figure, axes = plt.subplots(
        5, 1, figsize=(9.5, 8.2), sharex=True, gridspec_kw={"height_ratios": [3, 1.1, 3, 1.1, 1.3]}
    )
    channels = [
        (recording.depth, depth, "depth, m"),
        (np.degrees(recording.pitch), np.degrees(pitch), "pitch, deg"),
    ]
    for row, (measured, simulated, label) in enumerate(channels):
        main, rest = axes[2 * row], axes[2 * row + 1]
        main.plot(recording.time, measured, ".", color=MEASURED, markersize=2.5, label="measured")
        main.plot(recording.time, simulated, color=MODEL, linewidth=1.2, label="free run of the model")
        main.set_ylabel(label)
        line_through(rest, recording.time, measured - simulated, color=RESIDUAL, linewidth=0.6)
        rest.set_ylabel("left over")
    axes[0].invert_yaxis()
    axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, ncols=2, markerscale=3)
    plane_trace(axes[4], recording)
    axes[4].set_xlabel("time, s")
    figure.align_ylabels()
    return data_uri(figure)


def plane_trace(axis: Any, recording: Recording) -> None:
    """The plane in degrees, or another actuator as it was recorded."""
    angle = np.degrees(recording.rudder) if recording.has_angle else recording.rudder
    axis.step(recording.time, angle, where="post", color=RUDDER, linewidth=0.9)
    axis.set_ylabel("plane, deg" if recording.has_angle else "actuator,\nas recorded")


def whiteness_plot(innovations: Array, step: float) -> str:
    """Autocorrelation of the innovations with the band that white noise keeps to in 95 of 100 lags."""
    lags = min(100, innovations.shape[1] // 4)
    figure, axes = plt.subplots(1, 2, figsize=(9.5, 2.2), sharey=True)
    for axis, values, label in zip(axes, innovations, ("pitch", "depth"), strict=True):
        if np.isfinite(values).sum() < 3:
            continue
        covariance, pairs = autocovariance(values, lags)
        if not covariance[0] > 0.0:
            continue
        band = 1.96 / np.sqrt(np.maximum(pairs, 1.0))
        seconds = np.arange(1, lags + 1) * step
        axis.fill_between(seconds, -band[1:], band[1:], color="#e3edf4")
        axis.vlines(seconds, 0.0, covariance[1:] / covariance[0], color=RUDDER, linewidth=1.0)
        axis.set_title(f"{label}: correlation of what is left over", fontsize=9)
        axis.set_xlabel("lag, s")
    return data_uri(figure)


def history_plot(history: dict[str, Array], final: dict[str, float]) -> str:
    """Estimates of a recursive method while they converge."""
    figure, axes = plt.subplots(len(history), 1, figsize=(9.5, 1.25 * len(history)), sharex=True)
    for axis, (name, values) in zip(axes, history.items(), strict=True):
        axis.plot(values, color=MODEL, linewidth=1.0)
        axis.set_ylabel(name)
        if np.isfinite(final[name]):
            spread = 2.0 * abs(final[name]) + 1e-3
            axis.set_ylim(final[name] - spread, final[name] + spread)
    axes[-1].set_xlabel("samples")
    return data_uri(figure)


def overview_plot(recording: Recording) -> str:
    """The recording alone, for a recording that no model could be free-run on."""
    figure, axes = plt.subplots(3, 1, figsize=(9.5, 4.5), sharex=True)
    axes[0].plot(recording.time, recording.depth, ".", color=MEASURED, markersize=2.5)
    axes[0].invert_yaxis()
    axes[1].plot(recording.time, np.degrees(recording.pitch), ".", color=MEASURED, markersize=2.5)
    axes[0].set_ylabel("depth, m")
    axes[1].set_ylabel("pitch, deg")
    plane_trace(axes[2], recording)
    axes[2].set_xlabel("time, s")
    return data_uri(figure)
