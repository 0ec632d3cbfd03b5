"""One diagnosis against its answer."""

from dataclasses import dataclass, field
from math import isfinite, sqrt
from typing import Any

import numpy as np

from tools.trial.answers import Answer
from tools.trial.coefficients import lifted

LARGEST_CLASS = 3
PROPORTIONAL_TO_SPEED = ("c_wq", "c_qw")
NOTHING = "nothing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Coefficient:
    """One estimated coefficient beside the plant's own."""

    recording: str
    name: str
    value: float
    std: float
    truth: float

    @property
    def is_covered(self) -> bool:
        """Whether the 95 % interval holds the truth."""
        return abs(self.value - self.truth) <= 1.96 * self.std

    @property
    def error(self) -> float:
        """Relative to the truth."""
        return abs(self.value - self.truth) / abs(self.truth)


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """What was hidden, what was said, and how that compares. None where a question does not apply.

    named         what was named but for what every real vehicle has, where this one has it
    first         the effect named first of those, or "nothing"
    is_first      the (or one) hidden effect was named first
    is_in_class   it was, or stands in the class of at most three that the first one is said to belong to
    are_named     all that is hidden was named
    are_in_class  all that is hidden was named or stands in the class of one that was
    is_exact      all that is hidden was named and nothing else
    is_slot_right the largest share lies in a slot of what is hidden; None beside what every vehicle has
    admits        the verdict says that something stays unexplained
    over_floor    held-out free-run error over the noise that no model can foresee; `base_over_floor` before
    over_truth    the same over what the true structure reaches in the same spans
    truth_lead    by how much the true structure's BIC is better than what was said: above 0 the search missed
                  it, below 0 no likelihood could have chosen it
    """

    recording: str
    case: str
    hidden: list[str]
    misfits: dict[str, float]
    verdict: str
    named: list[str]
    first: str
    is_first: bool | None = None
    is_in_class: bool | None = None
    are_named: bool | None = None
    are_in_class: bool | None = None
    is_exact: bool = False
    is_slot_right: bool | None = None
    admits: bool = False
    over_floor: float | None = None
    base_over_floor: float | None = None
    over_truth: float | None = None
    truth_lead: float | None = None
    effect_coefficients: list[Coefficient] = field(default_factory=list)
    base_coefficients: list[Coefficient] = field(default_factory=list)
    rows: int = 0
    seconds: float = 0.0
    memory_mb: float = 0.0

    @property
    def has_failed(self) -> bool:
        """The command gave no diagnosis."""
        return self.verdict == "failed"

    @property
    def weakest_misfit(self) -> float:
        """Of what is hidden, the least visible."""
        return min(self.misfits.values(), default=0.0)


def names_just(diagnosis: dict[str, Any] | None, answer: Answer) -> bool:
    """Whether a diagnosis names all that is hidden and nothing that the vehicle has not."""
    return diagnosis is not None and set(_named(diagnosis, answer)) == set(answer.hidden)


def _named(diagnosis: dict[str, Any], answer: Answer) -> list[str]:
    return [effect["name"] for effect in diagnosis["effects"] if effect["name"] not in answer.usual]


def judge(
    answer: Answer,
    recorded: dict[str, Any],
    diagnosis: dict[str, Any] | None,
    model: dict[str, Any] | None = None,
    true_heldout: dict[str, Any] | None = None,
    seconds: float = 0.0,
    memory_mb: float = 0.0,
) -> Judged:
    """Compares one diagnosis.json with its answer.

    recorded      columns of the recording: time_s, pitch_rad, depth_m as arrays, NaN where not measured
    model         extended_model.json, for the deviations of the base coefficients
    true_heldout  held-out errors of a fit that was told what is hidden; not needed where just that was named
    """
    effects = [] if diagnosis is None else diagnosis["effects"]
    named = [] if diagnosis is None else _named(diagnosis, answer)
    classes = {effect["name"]: {effect["name"], *effect["indistinguishable_from"]} for effect in effects}
    stated = {name: members for name, members in classes.items() if len(members) <= LARGEST_CLASS}
    hidden, first = set(answer.hidden), named[0] if named else NOTHING
    is_known = answer.case in ("one", "two")
    is_exact = names_just(diagnosis, answer) and answer.case != "outside"
    verdict = "failed" if diagnosis is None else str(diagnosis["verdict"])
    slots = {} if diagnosis is None else diagnosis["location"]["slots"]
    reached = named + [name for members in stated.values() for name in members]
    return Judged(
        recording=answer.name,
        case=answer.case,
        hidden=answer.hidden,
        misfits=answer.misfits,
        verdict=verdict,
        named=named,
        first=first,
        is_first=first in hidden if is_known else None,
        is_in_class=bool(hidden & ({first} | stated.get(first, set()))) if is_known else None,
        are_named=hidden <= set(named) if is_known else None,
        are_in_class=hidden <= set(reached) if is_known else None,
        is_exact=is_exact,
        is_slot_right=_top(slots) in answer.slots if answer.hidden and not answer.usual else None,
        admits=verdict in ("partly_explained", "unexplained"),
        over_floor=_over_floor(answer, recorded, diagnosis, "extended"),
        base_over_floor=_over_floor(answer, recorded, diagnosis, "base"),
        over_truth=1.0 if is_exact else _over_truth(diagnosis, true_heldout),
        truth_lead=0.0 if is_exact else _truth_lead(answer, diagnosis, true_heldout),
        effect_coefficients=_effect_coefficients(answer, effects) if is_exact else [],
        base_coefficients=_base_coefficients(answer, model) if is_exact else [],
        rows=len(recorded["time_s"]),
        seconds=seconds,
        memory_mb=memory_mb,
    )


def _top(slots: dict[str, float]) -> str:
    return max(slots, key=lambda slot: slots[slot]) if any(slots.values()) else NOTHING


def _over_floor(
    answer: Answer, recorded: dict[str, Any], diagnosis: dict[str, Any] | None, side: str
) -> float | None:
    """Both channels' held-out mean squares over those of the noise in the same spans, then the root.

    Where diagnosis.json does not say which spans it held out, the noise of the whole recording stands in;
    where a logger filled rows between readings, which is no noise, the instruments' own deviations do.
    """
    if diagnosis is None:
        return None
    heldout = diagnosis[side]["heldout"]
    floor = answer.floor
    times = np.asarray(recorded["time_s"])
    rows = np.round(times / floor.step_s).astype(int) if floor.rows is None else np.array(floor.rows)
    inside = np.ones(len(times), dtype=bool)
    spans = heldout.get("spans_s")
    if spans:
        inside = np.any([(times >= begin) & (times <= end) for begin, end in spans], axis=0)
    shares = []
    for truth, column, key, noise in (
        (floor.pitch_rad, "pitch_rad", "pitch_rmse_rad", floor.pitch_noise_rad),
        (floor.depth_m, "depth_m", "depth_rmse_m", floor.depth_noise_m),
    ):
        off = np.asarray(recorded[column])[inside] - np.asarray(truth)[rows[inside]]
        if heldout.get(key) is None or not np.isfinite(off).any():
            return None
        least = float(np.nanmean(off**2)) if floor.rows is None else noise**2
        shares.append(heldout[key] ** 2 / least)
    return sqrt(sum(shares) / 2)


def _over_truth(diagnosis: dict[str, Any] | None, true: dict[str, Any] | None) -> float | None:
    if diagnosis is None or true is None:
        return None
    found = diagnosis["extended"]["heldout"]
    channels = [(found[key], true[key]) for key in ("pitch_rmse_rad", "depth_rmse_m")]
    if any(error is None or reached is None for error, reached in channels):
        return None
    return sqrt(sum((error / reached) ** 2 for error, reached in channels) / 2)


def _truth_lead(
    answer: Answer, diagnosis: dict[str, Any] | None, true: dict[str, Any] | None
) -> float | None:
    """None beside waves: a fit that is told of them has one regular wave, and no likelihood of the others."""
    if (
        "surface_waves" in answer.hidden
        or diagnosis is None
        or true is None
        or diagnosis.get("bic") is None
        or true.get("bic") is None
    ):
        return None
    return float(diagnosis["bic"] - true["bic"])


def _effect_coefficients(answer: Answer, effects: list[dict[str, Any]]) -> list[Coefficient]:
    slows = "speed_loss" in (*answer.hidden, *answer.usual)
    found = []
    for effect in effects:
        for name, truth in answer.coefficients.get(effect["name"], {}).items():
            if slows and name in PROPORTIONAL_TO_SPEED:
                continue  # as of the base coefficients
            found += _coefficient(answer, name, truth, effect["coefficients"].get(name))
    return found


def _base_coefficients(answer: Answer, model: dict[str, Any] | None) -> list[Coefficient]:
    # With a varying speed these vary too, and which speed they belong to is a matter of words.
    if model is None or "speed_loss" in (*answer.hidden, *answer.usual):
        return []
    base = answer.base
    if "net_buoyancy" in answer.sizes:
        base = lifted(base, answer.sizes["net_buoyancy"], float(answer.outing["mass_kg"]))
    found = []
    for name, truth in base.items():
        if name != "u0" or not answer.outing["has_speed"]:
            found += _coefficient(answer, name, truth, model["parameters"].get(name))
    return found


def _coefficient(
    answer: Answer, name: str, truth: float, estimate: dict[str, Any] | None
) -> list[Coefficient]:
    if estimate is None or estimate["value"] is None or estimate["std"] is None:
        return []
    if not isfinite(estimate["std"]) or estimate["std"] <= 0.0:
        return []
    return [
        Coefficient(
            recording=answer.name, name=name, value=estimate["value"], std=estimate["std"], truth=truth
        )
    ]
