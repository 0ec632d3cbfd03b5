"""The diagnosis set against a model that the user holds, as it is, in place of a base fitted here."""

from dataclasses import replace

import numpy as np

from host.catalogue import BY_NAME, named
from host.diagnosis.against.comparison import Comparison, EffectDifference, compare
from host.diagnosis.against.other_side import Side
from host.diagnosis.answer import Against, Answer
from host.diagnosis.diagnose import Diagnosis
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.sea_fits import levels
from host.diagnosis.judge import SLOTS, NamedEffect
from host.diagnosis.proof.locate import locate
from host.diagnosis.proof.scoring import Misfit, free_run_errors, misfit
from host.diagnosis.proof.unknown_force import UnknownForce, unknown_force
from host.diagnosis.recordings.spans import divide
from host.dynamics.equations import NAMES, Slot
from host.dynamics.propagate import begun_at, inputs_of
from host.identification.model import VehicleModel
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.recordings.recording import Array, Recording

TRIMS = {"heave_offset": ("net_buoyancy", "c_w0"), "pitch_offset": ("trim_moment", "c_q0")}
SLOT_OF: dict[str, Slot] = {
    "a1": "heave", "b1": "heave", "a2": "pitch", "a3": "pitch", "b2": "pitch", "u0": "kinematics",
}  # fmt: skip


def against_model(found: Diagnosis, model: VehicleModel, name: str) -> Answer:
    """Puts a model in the place of the fitted base: errors, location and unknown force then refer to it.

    Effects that it holds already are named only where their coefficient differs significantly. `name` is
    the model file's.
    """
    recordings = found.recordings
    base = _as_it_is(model, recordings)
    fitter = Fitter(recordings, known=found.extended)
    if found.horizon is not None:  # it is foretold from where a filter is, with forces of its own
        base = _among_forces(base, fitter)
    comparison = compare(fitter, found.extended, _side(model), found.std)
    known = {effect.name: effect for effect in found.effects}
    effects = [_named(one, known) for one in comparison.named("missing", "different") if one.name in BY_NAME]
    longest = max(recordings, key=lambda recording: recording.duration)
    errors = free_run_errors(base, longest)
    verdict = found.verdict
    if verdict in ("no_mismatch", "explained"):
        verdict = "no_mismatch" if comparison.is_equal else "explained"
    described = replace(
        found,
        verdict=verdict,
        base=base,
        base_misfit=_misfit(model, base, found),
        effects=effects,
        slots=_slots(comparison) or found.slots,
        location=locate(longest, errors, found.floor, model.values["u0"]),
        force=_force_beside(model, longest, errors, found.floor, fitter.accelerations),
    )
    return Answer(found=described, against=Against(kind="model", name=name, comparison=comparison))


def _misfit(model: VehicleModel, base: Explanation, found: Diagnosis) -> Misfit:
    """Where random forces act a filter carries it into each stretch, as it does what was found.

    Else a model that knew none of the recording starts anew with each stretch.
    """
    spans = divide(found.recordings)
    if not found.has_sea or found.horizon is not None:
        return misfit(base, replace(spans, unseen=[]), found.floor, found.horizon)
    taught = Fitter(spans.teaching, known=found.extended)
    return misfit(_among_forces(_as_it_is(model, spans.teaching), taught), spans, found.floor)


def _among_forces(base: Explanation, fitter: Fitter) -> Explanation:
    return replace(base, fit=replace(base.fit, noise=levels(fitter, base.names, base.fit)))


def _as_it_is(model: VehicleModel, recordings: list[Recording]) -> Explanation:
    """The model as an explanation of the recordings of which nothing is fitted."""
    structure, values = model.structure, model.parameters
    nothing = np.zeros(values.size, dtype=bool)
    initial = [
        begun_at(*(values[np.isfinite(values)][0] for values in (r.pitch, r.depth))) for r in recordings
    ]
    start = Point(structure, values, initial, np.zeros(4))
    inputs = [inputs_of(recording, structure) for recording in recordings]
    with np.errstate(over="ignore", invalid="ignore"):
        fit = output_error(start, inputs, nothing, most_iterations=0)
    return Explanation(structure.effect_names, fit, float("nan"))


def _side(model: VehicleModel) -> Side:
    """The model's physics in the words of a diagnosis, where a trim offset is an effect."""
    values = {name: (model.values[name], _deviation(model.std[name])) for name in NAMES}
    names = {str(effect["name"]) for effect in model.effects}
    for effect in model.effects:
        for name, entry in effect["parameters"].items():
            values[name] = float(entry["value"]), _deviation(entry.get("std"))
    for offset, (effect_name, coefficient) in TRIMS.items():
        value, std = values[offset]
        if value != 0.0:
            before, spread = values.get(coefficient, (0.0, 0.0))
            values[coefficient] = before + value, float(np.hypot(spread, std))
            names.add(effect_name)
        values[offset] = 0.0, 0.0
    return Side(names=frozenset(names), values=values)


def _deviation(std: float | None) -> float:
    return float(std) if std is not None and np.isfinite(std) else 0.0


def _named(one: EffectDifference, known: dict[str, NamedEffect]) -> NamedEffect:
    before = known.get(one.name)
    units = {p.name: p.unit for p in named(one.name).parameters}
    return NamedEffect(
        name=one.name,
        coefficients={name: (value, std, units[name]) for name, (value, std) in one.recorded.items()},
        delta_bic=one.evidence,
        heldout_gain=before.heldout_gain if before is not None else float("nan"),
        twins=before.twins if before is not None else [],
    )


def _slots(comparison: Comparison) -> dict[Slot, float]:
    """Shares of the evidence, of effects and base coefficients together; empty where nothing differs."""
    shares: dict[Slot, float] = dict.fromkeys(SLOTS, 0.0)
    for effect in comparison.named("missing", "different", "superfluous"):
        shares[named(effect.name).slot] += min(max(effect.evidence, 0.0), 1e9)
    for parameter in comparison.parameters:
        if parameter.is_different:
            shares[SLOT_OF[parameter.name]] += min(parameter.deviations**2, 1e9)
    total = sum(shares.values())
    return {slot: share / total for slot, share in shares.items()} if total > 0.0 else {}


def _force_beside(
    model: VehicleModel,
    recording: Recording,
    errors: Array,
    floor: Array,
    accelerations: tuple[float, float],
) -> UnknownForce:
    """What must have acted beside all of the model's own terms, effects included.

    The errors of its free run obey the linear equations, driven by nothing but the force it lacks.
    """
    pitch, depth = errors
    deviation = replace(recording, pitch=pitch, depth=depth, rudder=np.zeros_like(recording.rudder))
    return unknown_force(deviation, {name: model.values[name] for name in NAMES}, floor, accelerations)
