"""diagnosis.json and extended_model.json."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from host.catalogue import BY_NAME
from host.catalogue.nuisance import PLANE_BEFORE
from host.diagnosis.answer import Answer
from host.diagnosis.diagnose import Diagnosis
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.proof.scoring import Misfit
from host.dynamics.equations import NAMES
from host.identification.model import model_of, write_model
from host.vehicle import Vehicle

SCHEMA = 1


def write_diagnosis(answer: Answer, path: Path) -> None:
    """Writes diagnosis.json; figures that do not exist are null."""
    path.write_text(json.dumps(_finite(document(answer)), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def document(answer: Answer) -> dict[str, Any]:
    """The answer as plain values, by the names of the file format."""
    found, against = answer.found, answer.against
    location = found.location
    return {
        "schema": SCHEMA,
        "verdict": found.verdict,
        "base": _side(found.base, found.base_misfit),
        "location": {
            "slots": found.slots,
            "intervals_s": [list(span) for span in location.intervals],
            "region": location.region,
            "band_hz": list(location.band),
        },
        "effects": [
            {
                "name": effect.name,
                "slot": BY_NAME[effect.name].slot,
                "sentence": BY_NAME[effect.name].sentence,
                "equation": BY_NAME[effect.name].equation,
                "coefficients": {
                    name: {"value": value, "std": std, "unit": unit}
                    for name, (value, std, unit) in effect.coefficients.items()
                },
                "evidence": {"delta_bic": effect.delta_bic, "heldout_gain": effect.heldout_gain},
                "indistinguishable_from": effect.twins,
                "separating_manoeuvre": "; ".join(one.sentence for one in answer.separating(effect.name))
                or BY_NAME[effect.name].manoeuvre,
                "separation": [
                    {
                        "from": one.twin,
                        "manoeuvre": None if one.manoeuvre is None else one.manoeuvre.words,
                        "duration_s": None if one.manoeuvre is None else one.manoeuvre.duration,
                        "predicted_delta_chi2": one.predicted,
                        "confirmed_delta_bic": one.confirmed,
                        "sentence": one.sentence,
                    }
                    for one in answer.separating(effect.name)
                ],
            }
            for effect in found.effects
        ],
        "extended": _side(found.extended, found.extended_misfit),
        "remaining": {
            "chi2_depth": found.extended_misfit.chi2_depth,
            "chi2_pitch": found.extended_misfit.chi2_pitch,
            "sentence": found.remaining,
        },
        "noise_floor": {
            "pitch_rad": float(np.sqrt(found.floor[0])),
            "depth_m": float(np.sqrt(found.floor[1])),
        },
        "bic": found.bic,
        "ranked": "alone" if found.is_ranked_alone else "beside the others",
        "ranking": [{"name": name, "delta_bic": gain} for name, gain in found.ranking],
        "is_held_out": found.is_held_out,
        "horizon_s": found.horizon,
    } | ({against.kind: against.as_json()} if against is not None else {})


def _side(explanation: Explanation, misfit: Misfit) -> dict[str, Any]:
    values = dict(zip(explanation.fit.structure.names, explanation.fit.parameters.tolist(), strict=True))
    return {"parameters": {name: values[name] for name in NAMES}, "heldout": misfit.as_json()}


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def write_extended_model(found: Diagnosis, vehicle: Vehicle, path: Path) -> None:
    """Writes the base equations with the named effects as a model to simulate and predict with."""
    fit = found.extended.fit
    values = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    effects = [
        {
            "name": effect.name,
            "parameters": {
                p.name: {"value": values[p.name], "std": found.std[p.name], "unit": p.unit}
                for p in effect.parameters
            },
        }
        for effect in fit.structure.effects
        if effect is not PLANE_BEFORE  # which is of the recording, not of the vehicle
    ]
    model = model_of(
        found.recordings,
        vehicle.name,
        "diagnose",
        {name: values[name] for name in NAMES},
        {name: found.std[name] for name in NAMES},
        fit.noise,
        effects,
        fit.wander,
    )
    write_model(model, path)
