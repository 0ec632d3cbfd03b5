"""The one sentence that answers "can I trust this model?", from free runs against the sensors' own noise."""

from dataclasses import dataclass

import numpy as np

from host.identification.identify import Identification
from host.identification.predict import Prediction
from host.noise.noise_floor import noise_floor
from host.recordings.recording import Array

TRUSTED_FIT = 80.0  # %, of a free run: below it the values are a description, not a law
RUNAWAY_FIT = -1e4  # %
TRUSTED_CHI2 = 10.0  # above it, three times the sensors' noise, something is left to explain
CHANNELS = ("pitch", "depth")


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The sentence, and whether the model may be used as it stands."""

    sentence: str
    is_trusted: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeRuns:
    """Several free runs as one, pitch and depth (2,); NaN for a channel that was not measured or never moved.

    fit   100 (1 - |y - yhat|/|y - mean y|), %, the mean taken of each recording by itself
    chi2  mean squared error over the variance of the sensors' noise
    """

    fit: Array
    chi2: Array


def free_runs(predictions: list[Prediction]) -> FreeRuns:
    """Pools the errors of all predictions."""
    squares, spread, count = np.zeros(2), np.zeros(2), np.zeros(2)
    for prediction in predictions:
        measured = np.array([prediction.recording.pitch, prediction.recording.depth])
        present = np.isfinite(measured)
        with np.errstate(over="ignore", invalid="ignore"):
            errors = np.where(present, measured - prediction.outputs, 0.0)
            squares += np.sum(np.nan_to_num(errors, nan=np.inf) ** 2, axis=1)
        count += present.sum(axis=1)
        for i, y in enumerate(measured):
            spread[i] += y[present[i]].size * np.var(y[present[i]]) if present[i].any() else 0.0
    floor = noise_floor([prediction.recording for prediction in predictions])
    moved = (count > 0.0) & (spread > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return FreeRuns(
            fit=np.where(moved, 100.0 * (1.0 - np.sqrt(squares / spread)), np.nan),
            chi2=np.where(moved, squares / count / floor, np.nan),
        )


def verdict(result: Identification) -> Verdict:
    """What is known of the coefficients, and how far the free run of the model can be believed."""
    known = _known(result)
    scored = result.held_out if result.held_out is not None else result.predictions
    if not scored:
        return Verdict(
            sentence=f"{known}. No stretch could be run freely to check the model.", is_trusted=False
        )
    found = free_runs(scored)
    seen = "data it never saw" if result.held_out is not None else "the data it was learnt from"
    bent = any(note.startswith(("At the edge", "The search stopped")) for note in result.notes)
    if bent or np.any(found.fit < TRUSTED_FIT):
        return Verdict(
            sentence=f"{known}. The linear model does not carry this vehicle: running freely over {seen}, "
            f"{_misses(found)}. `mils diagnose` says what is missing.",
            is_trusted=False,
        )
    shares = [
        f"{fit:.1f} % of the {name}"
        for name, fit in zip(CHANNELS, found.fit, strict=True)
        if not np.isnan(fit)
    ]
    if not shares:
        return Verdict(sentence=f"{known}. Nothing moves in the stretches that judge.", is_trusted=False)
    sentence = f"{known}. Running freely over {seen}, the model reproduces {_listed(shares)} motion"
    if not np.any(found.chi2 > TRUSTED_CHI2):
        return Verdict(sentence=f"{sentence}.", is_trusted=not result.undetermined)
    left = _listed(
        [
            f"in {name} {chi2**0.5:.1f}"
            for name, chi2 in zip(CHANNELS, found.chi2, strict=True)
            if chi2 > TRUSTED_CHI2
        ]
    )
    return Verdict(
        sentence=f"{sentence}, but what it leaves is {left} times the sensors' noise: "
        "`mils diagnose` tells whether physics is missing or the sea was rough.",
        is_trusted=False,
    )


def _known(result: Identification) -> str:
    if result.undetermined:
        return (
            f"This recording does not tell {_listed(result.undetermined)}: "
            "another manoeuvre is needed before those values mean anything"
        )
    return (
        "The regression gave all five coefficients" if result.fit is None else "All parameters are determined"
    )


def _misses(found: FreeRuns) -> str:
    """How much of each channel's motion is missed."""
    away = [name for name, fit in zip(CHANNELS, found.fit, strict=True) if fit < RUNAWAY_FIT]
    missed = [
        f"{100.0 - fit:.0f} % of the {name}"
        for name, fit in zip(CHANNELS, found.fit, strict=True)
        if fit >= RUNAWAY_FIT
    ]
    parts = [f"it misses {_listed(missed)} motion"] if missed else []
    parts += [f"its {_listed(away)} runs away"] if away else []
    return _listed(parts) if parts else "there is no motion to judge by"


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
