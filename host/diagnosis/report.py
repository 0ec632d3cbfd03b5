"""The diagnosis as one self-contained HTML page."""

from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, select_autoescape
from matplotlib import pyplot as plt

from host.catalogue import BY_NAME
from host.diagnosis.answer import Answer
from host.diagnosis.diagnose import Diagnosis, NamedEffect
from host.diagnosis.first_guess import smoothed_motion
from host.diagnosis.scoring import Misfit, free_run_errors
from host.plots import MEASURED, MODEL, RUDDER, data_uri
from host.version import program_version

BASE_COLOUR = "#dd8452"


def write_report(answer: Answer, vehicle: str, path: Path) -> None:
    """Writes report.html."""
    found = answer.found
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=select_autoescape(["j2", "html"])
    )
    location = found.location
    page = environment.get_template("report.html.j2").render(
        vehicle=vehicle,
        files=list(dict.fromkeys(recording.name for recording in found.recordings)),
        duration=sum(recording.duration for recording in found.recordings),
        version=program_version(),
        verdict=found.verdict,
        summary=summary(answer),
        effects=[_effect(effect) for effect in found.effects],
        held_out=found.is_held_out,
        proof=_proof(found),
        remaining=found.remaining,
        region=location.region[:1].upper() + location.region[1:],
        spans=_spans(found),
        band=f"Its power lies between {location.band[0]:.3f} and {location.band[1]:.3f} Hz.",
        next_steps=next_steps(answer),
        plots={"runs": _runs_plot(found), "slots": _slots_plot(found), "force": _force_plot(found)},
    )
    path.write_text(page, encoding="utf-8")


def title(name: str) -> str:
    """An effect's name for people."""
    return name.replace("_", " ")


def summary(answer: Answer) -> str:
    """The answer in a sentence or two."""
    found, against = answer.found, answer.against
    base = "given model" if against is not None and against.kind == "model" else "base equations"
    if found.verdict == "no_mismatch":
        return f"Nothing is missing: the {base} can reproduce this recording down to the sensors' noise."
    if not found.effects and found.verdict == "explained":
        return "The given model lacks no physics, but what it holds is not what the recording shows."
    if not found.effects:
        return "Simulation and recording differ, and none of the physics in the catalogue explains it."
    names = [title(effect.name) for effect in found.effects]
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    before, after = found.base_misfit, found.extended_misfit
    gain = (
        f"depth error {before.depth_rmse_m:.3f} to {after.depth_rmse_m:.3f} m, pitch error "
        f"{np.degrees(before.pitch_rmse_rad):.2f} to {np.degrees(after.pitch_rmse_rad):.2f} deg"
    )
    where = "on stretches it never saw" if found.is_held_out else "on the recording itself"
    lead = {
        "explained": f"Left out was: {listed}.",
        "partly_explained": f"Part of it is explained by {listed}.",
        "unexplained": f"Not explained; the nearest of the catalogue are {listed}.",
    }[found.verdict]
    return f"{lead} With it, {gain} {where}."


def next_steps(answer: Answer) -> list[str]:
    """What a user should do with this answer."""
    found = answer.found
    steps = []
    if found.effects:
        steps.append(
            "Use extended_model.json for simulation and control design (mils simulate, mils predict)."
        )
    steps += [f"{one.sentence[:1].upper()}{one.sentence[1:]}." for one in answer.separations]
    if found.verdict == "no_mismatch":
        steps.append("Use the identified model; fly larger manoeuvres to learn where it ends.")
    if found.verdict in ("partly_explained", "unexplained"):
        steps.append(
            "Look at the missing force and moment below: when and in which motion it acts tells its cause."
        )
        steps.append(
            "Check the recording itself: plane zero and scale, sensor mounting, time stamps of the channels."
        )
    return steps


def _effect(effect: NamedEffect) -> dict[str, Any]:
    entry = BY_NAME[effect.name]
    return {
        "title": title(effect.name),
        "slot": entry.slot,
        "sentence": entry.sentence,
        "equation": entry.equation,
        "coefficients": [
            {
                "name": name,
                "value": f"{value:.4g}",
                "interval": f"{value - 1.96 * std:.4g} to {value + 1.96 * std:.4g}"
                if std > 0
                else "measured",
                "unit": unit,
            }
            for name, (value, std, unit) in effect.coefficients.items()
        ],
        "delta_bic": f"{effect.delta_bic:.0f}",
        "gain": f"{100 * max(effect.heldout_gain, 0.0):.0f} %",
        "twins": [title(name) for name in effect.twins],
        "manoeuvre": entry.manoeuvre,
    }


def _proof(found: Diagnosis) -> list[dict[str, str]]:
    def row(name: str, misfit: Misfit) -> dict[str, str]:
        return {
            "name": name,
            "depth": f"{misfit.depth_rmse_m:.4g}",
            "pitch": f"{np.degrees(misfit.pitch_rmse_rad):.4g}",
            "chi2_depth": f"{misfit.chi2_depth:.3g}",
            "chi2_pitch": f"{misfit.chi2_pitch:.3g}",
        }

    floor = {
        "name": "sensor noise, the floor",
        "depth": f"{np.sqrt(found.floor[1]):.4g}",
        "pitch": f"{np.degrees(np.sqrt(found.floor[0])):.4g}",
        "chi2_depth": "1",
        "chi2_pitch": "1",
    }
    return [row("base equations", found.base_misfit), row("extended model", found.extended_misfit), floor]


def _spans(found: Diagnosis) -> str:
    spans = sorted(found.location.intervals, key=lambda span: -span[2])[:3]
    if not spans:
        return ""
    listed = "; ".join(f"{start:.0f} to {end:.0f} s ({100 * share:.0f} %)" for start, end, share in spans)
    return f"Most of it falls into {listed}."


def _runs_plot(found: Diagnosis) -> str:
    recording = max(found.recordings, key=lambda r: r.duration)
    measured = np.vstack([recording.pitch, recording.depth])
    figure, axes = plt.subplots(
        3, 1, figsize=(9.5, 6.6), sharex=True, gridspec_kw={"height_ratios": [3, 3, 1.2]}
    )
    rows = ((axes[0], 1, 1.0, "depth, m"), (axes[1], 0, np.degrees(1.0), "pitch, deg"))
    for axis, channel, scale, label in rows:
        axis.plot(
            recording.time, scale * measured[channel], ".", color=MEASURED, markersize=2.5, label="measured"
        )
        for explanation, colour, name in (
            (found.base, BASE_COLOUR, "base equations"),
            (found.extended, MODEL, "extended model"),
        ):
            run = measured[channel] - free_run_errors(explanation, recording)[channel]
            axis.plot(recording.time, scale * run, color=colour, linewidth=1.2, label=name)
        axis.set_ylabel(label)
    axes[0].invert_yaxis()
    axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, ncols=3, markerscale=3)
    axes[2].step(recording.time, np.degrees(recording.rudder), where="post", color=RUDDER, linewidth=0.9)
    axes[2].set_ylabel("plane, deg")
    axes[2].set_xlabel("time, s")
    figure.align_ylabels()
    return data_uri(figure)


def _slots_plot(found: Diagnosis) -> str:
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 2.9))
    slots = list(found.slots)
    left.barh(slots[::-1], [100 * found.slots[slot] for slot in slots][::-1], color=RUDDER)
    left.set_xlabel("share, %")
    best = [pair for pair in found.ranking if pair[1] > 0.0][:10][::-1]
    named = {effect.name for effect in found.effects}
    right.barh(
        [title(name) for name, _ in best],
        [gain for _, gain in best],
        color=[MODEL if name in named else MEASURED for name, _ in best],
    )
    right.set_xscale("log")
    right.set_xlabel("gain in the information criterion, alone (red: part of the answer)")
    figure.tight_layout()
    return data_uri(figure)


def _force_plot(found: Diagnosis) -> str:
    recording = max(found.recordings, key=lambda r: r.duration)
    speed = float(found.extended.fit.parameters[found.extended.fit.structure.names.index("u0")])
    motion = smoothed_motion(recording, speed)
    figure, axes = plt.subplots(2, 2, figsize=(9.5, 4.6), gridspec_kw={"width_ratios": [2.2, 1]})
    rows = (("heave, m/s^2", "heave velocity w, m/s", "w"), ("pitch, rad/s^2", "pitch rate q, rad/s", "q"))
    for (along, over), values, std, (label, state, key) in zip(
        axes, found.force.values, found.force.std, rows, strict=True
    ):
        along.fill_between(recording.time, values - 2 * std, values + 2 * std, color="#f3d5cf")
        along.plot(recording.time, values, color=MODEL, linewidth=0.9)
        along.set_ylabel(f"missing {label}")
        over.plot(motion[key], values, ".", color=MODEL, markersize=2, alpha=0.5)
        over.set_xlabel(state)
    axes[1][0].set_xlabel("time, s")
    figure.tight_layout()
    return data_uri(figure)
