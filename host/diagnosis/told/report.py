"""The diagnosis as one self-contained HTML page."""

from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, select_autoescape

from host.catalogue import BY_NAME, structure_of
from host.catalogue.moments import SCANS
from host.diagnosis.against.comparison import Status, figure
from host.diagnosis.answer import Against, Answer
from host.diagnosis.diagnose import Diagnosis
from host.diagnosis.fits.setting import SURGE
from host.diagnosis.judge import NamedEffect
from host.diagnosis.proof.deviations import interval
from host.diagnosis.proof.scoring import Misfit
from host.diagnosis.search.unknown_physics import unknown_in
from host.diagnosis.told.pictures import (
    base_name,
    force_picture,
    layers_picture,
    proof_picture,
    runs_picture,
    separation_picture,
    slots_picture,
)
from host.recordings.recording import notes_of
from host.version import program_version

HEADLINES = {
    "no_mismatch": "No mismatch",
    "explained": "Explained",
    "partly_explained": "Explained in part",
    "unexplained": "Not explained",
}


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
        reading_notes=notes_of(found.recordings),
        version=program_version(),
        verdict=found.verdict,
        summary=summary(answer),
        effects=[_effect(effect, answer) for effect in found.effects],
        held_out=found.is_held_out,
        horizon=found.horizon,
        is_carried=found.has_sea and found.is_held_out and found.horizon is None,
        is_ranked_alone=found.is_ranked_alone,
        is_adrift=found.extended.fit.has_coloured_noise and found.is_held_out,
        proof=_proof(answer),
        remaining=found.remaining,
        region=location.region[:1].upper() + location.region[1:],
        spans=_spans(found),
        band=f"Its power lies between {location.band[0]:.3f} and {location.band[1]:.3f} Hz.",
        next_steps=next_steps(answer),
        headline=HEADLINES[found.verdict],
        base=base_name(answer),
        against=_against(answer),
        separations=[_sentence(one.sentence) for one in answer.separations],
        plots={
            "runs": runs_picture(answer),
            "proof": proof_picture(answer),
            "slots": slots_picture(found),
            "force": force_picture(found),
            "layers": layers_picture(found),
            "separation": separation_picture(answer.separations),
        },
    )
    path.write_text(page, encoding="utf-8")


def title(name: str) -> str:
    """An effect's name for people."""
    return name.replace("_", " ")


def summary(answer: Answer) -> str:
    """The answer in a sentence or two."""
    against = answer.against
    if against is None or against.kind == "model":
        return _told(answer, "Left out was")
    return _difference(against) + _told(answer, "Left out of the base equations was")


def _told(answer: Answer, left_out: str) -> str:
    """What the recording lacks in the base."""
    found = answer.found
    if found.verdict == "no_mismatch":
        lead = f"Nothing is missing: the {base_name(answer)} can reproduce this down to the sensors' noise."
        return lead + _unchanged(found)
    if not found.effects and found.verdict == "explained":
        return "The given model lacks no physics, but what it holds is not what the recording shows."
    if not found.effects and not unknown_in(found.extended):
        return "Simulation and recording differ, and none of the physics in the catalogue explains it."
    listed = _listed(
        [_dated(effect) for effect in found.effects] or ["a force of which only the form is known"]
    )
    before, after = found.base_misfit, found.extended_misfit
    gain = (
        f"depth error {before.depth_rmse_m:.3f} to {after.depth_rmse_m:.3f} m, pitch error "
        f"{np.degrees(before.pitch_rmse_rad):.2f} to {np.degrees(after.pitch_rmse_rad):.2f} deg"
    )
    where = "on stretches it never saw" if found.is_held_out else "on the recording itself"
    lead = {
        "explained": f"{left_out}: {listed}.",
        "partly_explained": f"Part of it is explained by {listed}.",
        "unexplained": f"The nearest of the catalogue, {listed}, does not explain it."
        if found.effects
        else f"None of the physics in the catalogue explains it, but {listed} comes near.",
    }[found.verdict]
    ahead = "" if found.horizon is None else f", foretold {found.horizon:.0f} s ahead"
    return f"{lead} With it, {gain} {where}{ahead}.{_unchanged(found)}"


def _difference(against: Against) -> str:
    """What a simulation has otherwise than the recording: that was the question."""
    if against.comparison.is_equal:
        return "The simulation holds what the recording shows. " if against.is_understood else ""
    verbs: dict[Status, str] = {"missing": "lacks", "superfluous": "has too much", "different": "differs in"}
    found = {verb: against.comparison.named(status) for status, verb in verbs.items()}
    said = [
        f"{verb} {_listed([title(e.name) for e in effects])}" for verb, effects in found.items() if effects
    ]
    if causes := against.comparison.causes:
        said.append(f"has {_listed([f'{one.ratio:.2g} times the {one.title}' for one in causes])}")
    return f"The simulation {'; it '.join(said) or 'has other coefficients'}. "


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _unchanged(found: Diagnosis) -> str:
    """That nothing changed where it was looked for, if so."""
    moments = [f"{alarm:.0f} s" for recording in found.recordings for alarm in recording.alarms]
    if not moments or any(effect.name in SCANS for effect in found.effects):
        return ""
    return f" Near {', '.join(moments)} nothing was found to have changed."


def _dated(effect: NamedEffect) -> str:
    """Its title, and the moment of what came at one."""
    if effect.name not in SCANS or not effect.coefficients:
        return title(effect.name)
    (name,) = structure_of((effect.name,)).moments
    moment, _, unit = effect.coefficients[name]
    return f"{title(effect.name)} (at {moment:.0f} {unit})"


def next_steps(answer: Answer) -> list[str]:
    """What a user should do with this answer."""
    found = answer.found
    steps = []
    if found.effects and found.verdict != "unexplained":
        steps.append(
            "Use extended_model.json for simulation and control design (mils simulate, mils predict)."
        )
    steps += [_sentence(one.sentence) for one in answer.separations]
    if answer.against is not None and not answer.against.comparison.is_equal:
        kind = answer.against.kind
        steps.append(f"Change the {kind} as listed above, and set it against another recording.")
    if found.verdict == "no_mismatch":
        steps.append("Use the identified model; fly larger manoeuvres to learn where it ends.")
    if found.verdict in ("partly_explained", "unexplained"):
        steps.append(
            "Look at the missing force and moment above: when and in which motion it acts tells its cause."
        )
        steps.append(
            "Check the recording itself: plane zero and scale, sensor mounting, time stamps of the channels."
        )
    return steps


def _effect(effect: NamedEffect, answer: Answer) -> dict[str, Any]:
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
                "interval": "{:.4g} to {:.4g}".format(*interval(entry, name, value, std)),
                "unit": unit,
            }
            for name, (value, std, unit) in effect.coefficients.items()
            if std > 0.0
        ],
        "delta_bic": f"{effect.delta_bic:.0f}",
        "gain": f"{100 * effect.heldout_gain:.0f} %" if effect.heldout_gain > 0.0 else "",
        "twins": [title(name) for name in effect.twins],
        "manoeuvres": [_sentence(one.sentence) for one in answer.separating(effect.name)],
    }


def _against(answer: Answer) -> dict[str, Any] | None:
    """What differs from the user's own model or simulation: sentences, and a table of both sides."""
    against = answer.against
    if against is None:
        return None
    # A speed that was measured stands for the equation that would give it.
    is_measured = answer.found.recordings[0].has_speed
    held = {"recorded": SURGE if is_measured else {}}
    held["given"] = held["recorded"] if against.kind == "simulation" else {}
    rows = [
        {
            "name": f"{title(effect.name)}: {key}",
            "status": effect.status,
            "recorded": _figure(effect.recorded.get(key), held["recorded"].get(key)),
            "given": _figure(effect.given.get(key), held["given"].get(key)),
        }
        for effect in against.comparison.effects
        for key in effect.recorded or effect.given
    ]
    rows += [
        {
            "name": one.name,
            "status": "different" if one.is_different else "same",
            "recorded": _figure(one.recorded),
            "given": _figure(one.given),
        }
        for one in against.comparison.parameters
    ]
    return {"kind": against.kind, "name": against.name, "sentences": against.sentences, "rows": rows}


def _figure(value: tuple[float, float] | None, held: float | None = None) -> str:
    if value is None:
        return "none"
    return "measured" if value == (held, 0.0) else figure(*value)


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}."


def _proof(answer: Answer) -> list[dict[str, str]]:
    def row(name: str, misfit: Misfit) -> dict[str, str]:
        return {
            "name": name,
            "depth": f"{misfit.depth_rmse_m:.4g}",
            "pitch": f"{np.degrees(misfit.pitch_rmse_rad):.4g}",
            "chi2_depth": f"{misfit.chi2_depth:.3g}",
            "chi2_pitch": f"{misfit.chi2_pitch:.3g}",
        }

    found = answer.found
    floor = {
        "name": "sensor noise, the floor",
        "depth": f"{np.sqrt(found.floor[1]):.4g}",
        "pitch": f"{np.degrees(np.sqrt(found.floor[0])):.4g}",
        "chi2_depth": "1",
        "chi2_pitch": "1",
    }
    return [row(base_name(answer), found.base_misfit), row("extended model", found.extended_misfit), floor]


def _spans(found: Diagnosis) -> str:
    spans = sorted(found.location.intervals, key=lambda span: -span[2])[:3]
    if not spans:
        return ""
    listed = "; ".join(f"{start:.0f} to {end:.0f} s ({100 * share:.0f} %)" for start, end, share in spans)
    return f"Most of it falls into {listed}."
