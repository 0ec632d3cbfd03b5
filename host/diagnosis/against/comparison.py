"""Another side's physics (a model, a simulator) against what a recording shows, effect by effect.

Twins would make the two look different where they agree, so the recording is first told in the other side's
words (host.diagnosis.against.other_side). What is left of the difference is tested by likelihood ratio: how
much worse the recording is met when an effect's coefficients are held at the other side's values and all else
is free. Where all of the other side as it stands loses no more than the freedom of our coefficients is worth,
nothing differs, whatever we would call it.
"""

from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from scipy.stats import chi2

from host.catalogue import named
from host.diagnosis.against.causes import CAUSES, Cause, causes
from host.diagnosis.against.other_side import TOOLS, Side, Value, at_speed, in_words_of, side_of, there
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import NAMING_MARGIN
from host.diagnosis.fits.setting import SURGE
from host.dynamics.equations import NAMES, PARAMETERS

SIGNIFICANCE = 1e-3  # chance that one of two equal coefficients is called different
OPEN = 1e3  # deviations beyond this many times the value say that the motion tells nothing of it
NOTHING_KNOWN: Mapping[str, float] = MappingProxyType({})
Status = Literal["missing", "superfluous", "different", "same"]


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectDifference:
    """One effect on both sides; `recorded` or `given` is empty where that side lacks it.

    status    "missing" in the other side, "superfluous" there, held there with a "different" coefficient, or
              the "same" as far as the recording can tell
    evidence  2 log-likelihood (BIC for "missing") that the recording loses if the other side is right
    """

    name: str
    status: Status
    recorded: dict[str, Value]
    given: dict[str, Value]
    evidence: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterDifference:
    """One coefficient of the base equations on both sides."""

    name: str
    recorded: Value
    given: Value
    is_different: bool

    @property
    def deviations(self) -> float:
        """The difference over its standard deviation."""
        spread = float(np.hypot(self.recorded[1], self.given[1]))
        return abs(self.recorded[0] - self.given[0]) / max(spread, 1e-300)


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The differences, strongest evidence first."""

    effects: list[EffectDifference]
    parameters: list[ParameterDifference]

    def named(self, *status: Status) -> list[EffectDifference]:
        return [effect for effect in self.effects if effect.status in status]

    @property
    def causes(self) -> list[Cause]:
        """What may make the different coefficients of the base equations so, at the same speed."""
        different = {parameter.name for parameter in self.parameters if parameter.is_different}
        if not different or "u0" in different:
            return []
        pairs = {one.name: (one.recorded, one.given) for one in self.parameters if one.name != "u0"}
        return [cause for cause in causes(pairs) if different & CAUSES[cause.name].keys()]

    @property
    def is_equal(self) -> bool:
        differs = [parameter for parameter in self.parameters if parameter.is_different]
        return not differs and not self.named("missing", "superfluous", "different")


def compare(
    fitter: Fitter,
    own: Explanation,
    other: Side,
    std: Mapping[str, float] = NOTHING_KNOWN,
    untold: Names = frozenset(),
) -> Comparison:
    """Sets the explanation of the fitter's recordings against the other side.

    Where forces follow a measured speed, both are told at the recordings' own.

    std     the least deviations of our coefficients: those that know of what else every vehicle has, too
            little to be named, which the other side may hold
    untold  effects of which nothing is known on the other side: they are no difference
    """
    # A speed taken as it was measured says nothing of what changes it.
    not_estimated = (
        SURGE if all(other.values.get(name) == (value, 0.0) for name, value in SURGE.items()) else {}
    )
    is_speed_told = fitter.recordings[0].has_speed and other.values["u0"][0] > 0.0
    if is_speed_told and "speed_loss" in own.names | other.names:
        other = at_speed(other, fitter.held["u0"])
    other = replace(other, names=other.names - TOOLS)
    as_they_are = _as_they_are(fitter, own, other)
    is_met = _lost(own, as_they_are) < chi2.isf(SIGNIFICANCE, int(fitter.free(own.names).sum()))
    joint = fitter.polished(as_they_are) if is_met else in_words_of(fitter, own, other)
    free = fitter.free(joint.names)
    is_free = dict(zip(joint.fit.structure.names, free.tolist(), strict=True))
    plain = side_of(joint).values
    recorded = {key: (value, max(least, std.get(key, 0.0))) for key, (value, least) in plain.items()}
    effects = []
    for name in joint.names - TOOLS - untold:
        mine = {parameter.name: recorded[parameter.name] for parameter in named(name).parameters}
        worth = fitter.polished(fitter.shrunk(joint, name)).bic - joint.bic
        if name not in other.names:
            effects.append(
                EffectDifference(name=name, status="missing", recorded=mine, given={}, evidence=worth)
            )
            continue
        given = other.of(name)
        compared = [key for key in given if is_free[key] and key not in not_estimated]
        cost = _cost(fitter, joint, {key: given[key] for key in compared})
        cost /= _doubt(plain, mine, given, compared)
        status: Status = "same"
        if cost > chi2.isf(SIGNIFICANCE, max(len(compared), 1)) and not is_met:
            status = "different" if worth > NAMING_MARGIN else "superfluous"
        kept = {} if status == "superfluous" else mine
        effects.append(EffectDifference(name=name, status=status, recorded=kept, given=given, evidence=cost))
    limit = float(np.sqrt(chi2.isf(SIGNIFICANCE, 1)))
    parameters = []
    for name in NAMES:
        if is_free[name]:
            pair = ParameterDifference(
                name=name, recorded=recorded[name], given=other.values[name], is_different=False
            )
            parameters.append(replace(pair, is_different=pair.deviations > limit and not is_met))
    return Comparison(effects=sorted(effects, key=lambda effect: -effect.evidence), parameters=parameters)


def _as_they_are(fitter: Fitter, own: Explanation, other: Side) -> Explanation:
    """The other side on our recordings, its coefficients as they are there."""
    strict, start = copy(fitter), there(fitter, own, other)
    strict.held = {name: value for name, (value, _) in other.values.items()} | fitter.held
    return strict.explained(start.structure.effect_names, strict.fitted([start]))


def _lost(likelier: Explanation, other: Explanation) -> float:
    """2 log-likelihood."""
    return 2.0 * (likelier.fit.log_likelihood - other.fit.log_likelihood)


def _cost(fitter: Fitter, joint: Explanation, held: dict[str, Value]) -> float:
    """2 log-likelihood lost when some coefficients are held, all others free."""
    strict = copy(fitter)
    strict.held = fitter.held | {name: value for name, (value, _) in held.items()}
    parameters = joint.fit.parameters.copy()
    for name, (value, _) in held.items():
        parameters[joint.fit.structure.names.index(name)] = value
    start = Explanation(joint.names, replace(joint.fit, parameters=parameters), joint.bic)
    return max(_lost(joint, strict.polished(start)), 0.0)


def _doubt(
    plain: dict[str, Value], mine: dict[str, Value], given: dict[str, Value], names: Iterable[str]
) -> float:
    """By how much more uncertain both sides are than the likelihood of the recording says, in variances."""
    ratios = [(mine[name][1] ** 2 + given[name][1] ** 2) / max(plain[name][1], 1e-150) ** 2 for name in names]
    return float(np.mean(ratios)) if ratios else 1.0


def as_json(found: Comparison, given: str) -> dict[str, Any]:
    """The differences as plain values; the other side under the key `given`."""
    units = {p.name: p.unit for p in PARAMETERS}

    def values(side: dict[str, Value], name: str) -> dict[str, Any] | None:
        unit = {p.name: p.unit for p in named(name).parameters}
        return {k: {"value": v, "std": s, "unit": unit[k]} for k, (v, s) in side.items()} or None

    return {
        "effects": [
            {
                "name": effect.name,
                "status": effect.status,
                "recording": values(effect.recorded, effect.name),
                given: values(effect.given, effect.name),
                "evidence": effect.evidence,
            }
            for effect in found.effects
        ],
        "parameters": [
            {
                "name": one.name,
                "unit": units[one.name],
                "recording": {"value": one.recorded[0], "std": one.recorded[1]},
                given: {"value": one.given[0], "std": one.given[1]},
                "is_different": one.is_different,
            }
            for one in found.parameters
        ],
        "causes": [{"name": one.name, "ratio": one.ratio, "std": one.std} for one in found.causes],
    }


def sentences(found: Comparison, given: str) -> list[str]:
    """What differs, a sentence each; `given` is what the other side is called."""
    said = []
    for effect in found.effects:
        title = effect.name.replace("_", " ")
        unit = {p.name: p.unit for p in named(effect.name).parameters}
        if effect.status == "missing":
            # What has no deviation was held: of a speed that was measured there is nothing to estimate.
            listed = ", ".join(_said(k, v, s, unit[k]) for k, (v, s) in effect.recorded.items() if s > 0.0)
            said.append(f"{title} is missing from the {given}{': ' * bool(listed)}{listed}.")
        elif effect.status == "superfluous":
            listed = ", ".join(_said(k, v, s, unit[k]) for k, (v, s) in effect.given.items())
            said.append(f"{title} is too much in the {given} ({listed}): the recording shows none of it.")
        elif effect.status == "different":
            pairs = ", ".join(
                f"{_said(k, *effect.given[k], unit[k])} instead of {figure(*effect.recorded[k])}"
                for k in effect.given
            )
            said.append(f"{title} is in the {given}, but with {pairs}.")
    units = {p.name: p.unit for p in PARAMETERS}
    for one in found.parameters:
        if one.is_different:
            said.append(
                f"{_said(one.name, *one.given, units[one.name])} in the {given}, but "
                f"{figure(*one.recorded)} in the recording."
            )
    for cause in found.causes:
        times = figure(cause.ratio, cause.std)
        said.append(
            f"That is as if the {given} had {times} times the {cause.title} that the recording shows."
        )
    return said or [f"The {given} holds the physics that the recording shows, with the same coefficients."]


def _said(name: str, value: float, std: float, unit: str) -> str:
    return f"{name} = {figure(value, std)}" + f" {unit}" * (unit != "1")


def figure(value: float, std: float) -> str:
    """A coefficient with its deviation, where it has one; "open" where that says it may be anything."""
    if std > OPEN * max(abs(value), 1.0):
        return f"{value:.4g} (open)"
    return f"{value:.4g} +- {std:.2g}" if std > 0.0 else f"{value:.4g}"
