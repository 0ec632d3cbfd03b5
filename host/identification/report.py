"""The identification report: one self-contained HTML page a person understands by looking."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, select_autoescape

from host.dynamics.equations import PARAMETERS
from host.identification.identifiability import MANOEUVRE
from host.identification.identify import Identification
from host.identification.model import UNITS
from host.identification.plots import free_run_plot, history_plot, overview_plot, whiteness_plot
from host.identification.predict import Prediction
from host.identification.verdict import verdict
from host.recordings.recording import Recording, notes_of

MOST_PLOTS = 4  # a folder of short dives would drown the reader


def write_report(result: Identification, path: Path) -> None:
    """Writes report.html."""
    found = verdict(result)
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=select_autoescape(["j2", "html"])
    )
    page = environment.get_template("report.html.j2").render(
        model=result.model,
        method=result.method,
        recordings=result.recordings,
        files=[file["name"] for file in result.model.provenance["recordings"]],
        duration=sum(recording.duration for recording in result.recordings),
        undetermined=result.undetermined,
        verdict=re.sub("`(.+?)`", r"<code>\1</code>", found.sentence),
        trusted=found.is_trusted,
        notes=result.notes,
        parameters=_parameters(result),
        advice=advice(result),
        scores=_scores(result),
        noise=_noise(result),
        plots=_plots(result),
        reading=_reading(result),
        reading_notes=notes_of(result.recordings),
    )
    path.write_text(page, encoding="utf-8")


def advice(result: Identification) -> list[str]:
    """One line for each manoeuvre that would show an open parameter."""
    lines: dict[str, list[str]] = {}
    for name in result.undetermined:
        lines.setdefault(MANOEUVRE[name], []).append(name)
    return [f"{', '.join(names)}: {manoeuvre}" for manoeuvre, names in lines.items()]


def unit_of(name: str, recordings: list[Recording]) -> str:
    """SI unit of a parameter; b1 and b2 are per unit of the actuator where that is no angle."""
    if all(recording.has_angle for recording in recordings):
        return UNITS[name]
    return {"b1": "m/s^2/actuator unit", "b2": "rad/s^2/actuator unit"}.get(name, UNITS[name])


def _parameters(result: Identification) -> list[dict[str, Any]]:
    rows = []
    for parameter in PARAMETERS:
        value, std = result.model.values[parameter.name], result.model.std[parameter.name]
        is_known = np.isfinite(value)
        rows.append(
            {
                "name": parameter.name,
                "meaning": parameter.meaning,
                "unit": unit_of(parameter.name, result.recordings),
                "value": f"{value:.4g}" if is_known else "not found",
                "std": _deviation(std, is_known),
                "interval": f"{value - 1.96 * std:.4g} to {value + 1.96 * std:.4g}"
                if 0.0 < std < np.inf
                else "",
                "open": parameter.name in result.undetermined,
            }
        )
    return rows


def _deviation(std: float, is_known: bool) -> str:
    if not is_known:
        return ""
    if std == 0.0:
        return "given"
    return f"{std:.2g}" if np.isfinite(std) else "unknown"


def _scores(result: Identification) -> list[dict[str, Any]]:
    groups: list[tuple[str, list[Prediction]]] = [
        ("held out", result.held_out or []),
        ("learnt from", result.predictions),
    ]
    return [
        {
            "name": f"{prediction.recording.name}, {kind}",
            "depth": _figure(prediction.score.depth_rmse_m, ".3f"),
            "pitch": _figure(np.degrees(prediction.score.pitch_rmse_rad), ".3f"),
            "depth_fit": _figure(prediction.score.depth_fit_percent, ".1f"),
            "pitch_fit": _figure(prediction.score.pitch_fit_percent, ".1f"),
            "samples": prediction.score.samples,
        }
        for kind, predictions in groups
        for prediction in predictions
    ]


def _figure(value: float, form: str) -> str:
    if not np.isfinite(value):
        return "diverged"
    return f"{value:{form}}" if abs(value) < 1e5 else f"{value:.1e}"


def _noise(result: Identification) -> str:
    noise = result.model.noise
    if not noise:
        return ""
    return f"pitch {np.degrees(noise['pitch_rad']):.3f} deg, depth {1000 * noise['depth_m']:.1f} mm"


def _plots(result: Identification) -> list[dict[str, str]]:
    plots = []
    for prediction in (result.held_out or [])[:1]:
        if np.isfinite(prediction.outputs).all():
            caption = f"{prediction.recording.name}: free run over the held-out part."
            plots.append({"uri": free_run_plot(prediction), "caption": caption})
    for prediction in result.predictions[:MOST_PLOTS]:
        if np.isfinite(prediction.outputs).all():
            caption = f"{prediction.recording.name}: free run over what it was learnt from."
            plots.append({"uri": free_run_plot(prediction), "caption": caption})
    if not plots:
        plots.append({"uri": overview_plot(result.recordings[0]), "caption": "The recording alone."})
    if result.fit is not None:
        caption = "Correlation of the innovations; inside the band nothing systematic is left over."
        plots.append(
            {
                "uri": whiteness_plot(result.fit.whitened[0], result.recordings[0].step),
                "caption": caption,
            }
        )
    if result.history:
        plots.append(
            {
                "uri": history_plot(result.history, result.model.values),
                "caption": "Estimates while the recursion converges.",
            }
        )
    return plots


def _reading(result: Identification) -> list[dict[str, Any]]:
    return [
        {
            "name": recording.name,
            "rows": recording.time.size,
            "step": f"{recording.step:.4g}",
            "pitch": f"{100 * np.isnan(recording.pitch).mean():.0f} %",
            "depth": f"{100 * np.isnan(recording.depth).mean():.0f} %",
            "counts": ", ".join(
                f"{name} {count}" for name, count in sorted(recording.counts.items()) if count
            ),
        }
        for recording in result.recordings
    ]
