"""Which set of effects explains the recording: a beam search over sets, each refitted jointly.

Effects are never added one at a time for good: sets are carried side by side, every member of a set is
re-estimated with the base whenever one joins, and members that no longer pay are dropped. What an effect
could gain is first predicted by one Gauss-Newton step from each of its probes; the promising ones are fitted.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import log

import numpy as np

from host.catalogue import CATALOGUE, structure_of
from host.diagnosis.first_guess import accelerations, first_guess
from host.diagnosis.noise_floor import noise_floor
from host.equations import NAMES, Effect
from host.fit import Fit
from host.gauss_newton import GaussNewton, Point
from host.maximum_likelihood import RUNAWAY, annealed, fit_maximum_likelihood, output_error, residuals_at
from host.propagate import LONGEST_SUBSTEP, Inputs, inputs_of, longest_substep
from host.recording import Array, Recording

HELD = {"heave_offset": 0.0, "pitch_offset": 0.0}  # in a diagnosis a trim offset is an effect with a name
NAMING_MARGIN = 12.0  # of BIC, beyond which an effect pays; holds false naming down over the whole catalogue
RARITY = 4.0  # of BIC, odds of 7 to 1 against what not every vehicle has: decides between exact twins
BEAM = 4
PROMISING = 6
LARGEST_SET = 5
# Enough to rank sets; those that count are polished.
FIRST_ITERATIONS, MOST_ITERATIONS, TOLERANCE = 3, 12, 0.5

Names = frozenset[str]
Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Explanation:
    """A set of effects, fitted jointly with the base."""

    names: Names
    fit: Fit
    bic: float


class Search:
    """Explanations of some recordings, each set fitted once."""

    def __init__(
        self,
        recordings: list[Recording],
        on_progress: Progress = lambda _: None,
        known: Explanation | None = None,
    ) -> None:
        """`known`: an explanation of other stretches of the same vehicle, for fits to start from."""
        self.recordings = recordings
        self.on_progress = on_progress
        self.tried: dict[Names, Explanation] = {}
        held = dict(HELD)
        if recordings[0].has_speed:
            held["u0"] = float(np.mean([r.speed.mean() for r in recordings]))
            # Where the speed is measured its loss is data, and there is nothing in it to estimate.
            held |= {"speed_time": 1.0, "c_ud": 0.0}
        self._held = held
        self._floor = noise_floor(recordings)
        self.accelerations = accelerations(recordings)
        self._scale = {
            "": 1.0,
            "speed": 1.0,
            "rudder": float(max(np.abs(r.rudder).max() for r in recordings)) or 1.0,
            "duration": float(recordings[-1].time[-1]),
            "depth": float(np.nanmean(np.concatenate([r.depth for r in recordings]))),
        }
        self._inputs: dict[Names, list[Inputs]] = {}
        self._longest_substep = LONGEST_SUBSTEP
        self._gains: dict[tuple[Names, str], list[tuple[float, Array]]] = {}
        if known is not None:
            self._scale["speed"] = float(known.fit.parameters[NAMES.index("u0")])
            return
        on_progress("base model")
        base = {name: value for name, value in held.items() if name in NAMES}
        fit = fit_maximum_likelihood(recordings, held=base, noise_model="output_error")
        self.base = self._remember(frozenset(), fit)
        self._scale["speed"] = float(fit.parameters[fit.structure.names.index("u0")])
        self._longest_substep = longest_substep(fit.parameters)

    def run(self) -> list[Explanation]:
        """All explanations tried, best first."""
        beam = [self.base]
        for size in range(1, LARGEST_SET + 1):
            grown: dict[Names, Explanation] = {}
            for number, parent in enumerate(beam):
                for effect in self._promising(parent, len(CATALOGUE) if size == 1 else PROMISING):
                    name = " + ".join(sorted(parent.names | {effect.name}))
                    self.on_progress(f"{size} effect{'s' * (size > 1)}, {number + 1}/{len(beam)}: {name}")
                    child = self.extended(parent, effect)
                    grown[child.names] = child
            best_before = min(e.bic for e in beam)
            beam = sorted(grown.values(), key=lambda e: e.bic)[:BEAM]
            if not beam or beam[0].bic > best_before - NAMING_MARGIN:
                break
        return sorted(self.tried.values(), key=lambda e: e.bic)

    def simplest(self) -> Explanation:
        """The best explanation all of whose members pay for themselves."""
        for explanation in sorted(self.tried.values(), key=lambda e: e.bic)[:BEAM]:
            self.polished(explanation)
        best = min(self.tried.values(), key=lambda e: e.bic)
        pruned = True
        while pruned and best.names:
            pruned = False
            for name in sorted(best.names):
                smaller = self.polished(self.without(best, name))
                if smaller.bic < best.bic + NAMING_MARGIN:
                    best, pruned = smaller, True
                    break
        return best

    def extended(self, parent: Explanation, effect: Effect) -> Explanation:
        """The parent's set with one effect more, from the effect's best probes."""
        names = parent.names | {effect.name}
        if names in self.tried:
            return self.tried[names]
        _, probe = max(self._probed(parent, effect), key=lambda probed: probed[0])
        start = self._start(names, parent, effect.name, probe)
        point = Point(structure_of(names), start, parent.fit.initial, parent.fit.noise)
        return self._remember(names, self._fit(names, [point, self._guess(names, parent, start)]))

    def without(self, explanation: Explanation, name: str) -> Explanation:
        """The same set without one of its effects."""
        names = explanation.names - {name}
        start = self._start(names, explanation)
        fit = explanation.fit
        point = Point(structure_of(names), start, fit.initial, fit.noise)
        return self._remember(names, self._fit(names, [point, self._guess(names, explanation, start)]))

    def swapped(self, explanation: Explanation, out: str, into: Effect) -> Explanation:
        """One effect in the place of another."""
        return self.extended(self.without(explanation, out), into)

    def gains(self, parent: Explanation) -> dict[str, float]:
        """Twice the log-likelihood each effect could gain on top of the parent, predicted."""
        return {
            effect.name: max(gain for gain, _ in self._probed(parent, effect))
            for effect in CATALOGUE
            if effect.name not in parent.names
        }

    def free_parameters(self, names: Names) -> int:
        """How many coefficients the set adds to the base."""
        return sum(
            parameter.name not in self._held
            for effect in structure_of(names).effects
            for parameter in effect.parameters
        )

    def _promising(self, parent: Explanation, most: int) -> list[Effect]:
        """Effects to fit in earnest: those predicted to gain most, and those every vehicle has.

        The prediction is local. A base bent far from the truth hides what the common effects, which trade
        against its own coefficients, would gain once all of them are free; so these are always tried.
        """
        gains = self.gains(parent)
        order = sorted(gains, key=lambda name: -gains[name])
        worth = {name for name in order[:most] if gains[name] > NAMING_MARGIN}
        return [
            effect
            for effect in CATALOGUE
            if effect.name in gains and (effect.is_common or effect.name in worth)
        ]

    def _probed(self, parent: Explanation, effect: Effect) -> list[tuple[float, Array]]:
        """Predicted gain and values of each probe of an effect: one Gauss-Newton step from there."""
        if (parent.names, effect.name) in self._gains:
            return self._gains[parent.names, effect.name]
        names = parent.names | {effect.name}
        structure = structure_of(names)
        inputs = self._inputs_for(names)
        free = np.array([name not in self._held for name in structure.names])
        before = sum(float(np.nansum(e**2)) for e in parent.fit.whitened)
        probed = []
        for probe in self._probes(effect):
            point = Point(
                structure,
                self._start(names, parent, effect.name, probe),
                parent.fit.initial,
                parent.fit.noise,
            )
            with np.errstate(over="ignore", invalid="ignore"):
                white = residuals_at(point, inputs)
                runs_away = not all(np.abs(S).max() < RUNAWAY for _, S in white)
                cost = sum(float(np.sum(e**2)) for e, _ in white)
            left = np.inf if runs_away else GaussNewton(white, point, free).predicted_cost(cost)
            probed.append((before - left, probe))
        self._gains[parent.names, effect.name] = probed
        return probed

    def _probes(self, effect: Effect) -> list[Array]:
        scales = np.array([self._scale[scale] for scale in effect.scales or ("",) * len(effect.parameters)])
        return [np.array(probe) * scales for probe in effect.probes]

    def _guess(self, names: Names, parent: Explanation, start: Array) -> Point:
        """The rough values of regression where it gives some, `start` elsewhere, moved into their valley."""
        structure, inputs = structure_of(names), self._inputs_for(names)
        rough = first_guess(self.recordings, self._scale["speed"], names)
        rough = {name: value for name, value in rough.items() if name not in self._held}
        values = np.array([rough.get(name, own) for name, own in zip(structure.names, start, strict=True)])
        noise = np.array([*self._floor, 0.0, 0.0])
        point = Point(structure, values, parent.fit.initial, noise)
        free = np.array([name not in self._held for name in structure.names])
        return annealed(point, inputs, free, self.accelerations)

    def _start(
        self, names: Names, parent: Explanation, added: str | None = None, probe: Array | None = None
    ) -> Array:
        known = dict(zip(parent.fit.structure.names, parent.fit.parameters, strict=True))
        if added is not None and probe is not None:
            effect = next(effect for effect in CATALOGUE if effect.name == added)
            known |= {p.name: value for p, value in zip(effect.parameters, probe, strict=True)}
        known |= {name: value for name, value in self._held.items() if name in known}
        return np.array([known[name] for name in structure_of(names).names])

    def _fit(self, names: Names, starts: list[Point]) -> Fit:
        """Goes a few steps from every start and on from the best."""
        structure, inputs = structure_of(names), self._inputs_for(names)
        free = np.array([name not in self._held for name in structure.names])
        fits = [output_error(start, inputs, free, FIRST_ITERATIONS, TOLERANCE) for start in starts]
        best = max(fits, key=lambda fit: fit.log_likelihood)
        on = Point(structure, best.parameters, best.initial, best.noise)
        return best if best.converged else output_error(on, inputs, free, MOST_ITERATIONS, TOLERANCE)

    def refitted(self, explanation: Explanation) -> Explanation:
        """A set fitted to other stretches, fitted to these."""
        structure, values = structure_of(explanation.names), explanation.fit.parameters.copy()
        for name, value in self._held.items():
            if name in structure.names:
                values[structure.names.index(name)] = value
        initial = [
            np.array([0.0, 0.0, _first(recording.pitch), _first(recording.depth)])
            for recording in self.recordings
        ]
        noise = np.array([*self._floor, 0.0, 0.0])
        start = Point(structure, values, initial, noise)
        free = np.array([name not in self._held for name in structure.names])
        inputs = self._inputs_for(explanation.names)
        starts = [start, annealed(start, inputs, free, self.accelerations)]
        return self.polished(self._remember(explanation.names, self._fit(explanation.names, starts)))

    def polished(self, explanation: Explanation) -> Explanation:
        """The same set, its fit carried on until nothing more is gained."""
        fit = explanation.fit
        start = Point(fit.structure, fit.parameters, fit.initial, fit.noise)
        return self._remember(
            explanation.names, output_error(start, self._inputs_for(explanation.names), fit.free)
        )

    def _inputs_for(self, names: Names) -> list[Inputs]:
        if names not in self._inputs:
            structure = structure_of(names)
            self._inputs[names] = [
                inputs_of(recording, structure, self._longest_substep) for recording in self.recordings
            ]
        return self._inputs[names]

    def _remember(self, names: Names, fit: Fit) -> Explanation:
        rare = sum(not effect.is_common for effect in structure_of(names).effects)
        bic = -2.0 * fit.log_likelihood + self.free_parameters(names) * log(fit.samples) + RARITY * rare
        if names not in self.tried or bic < self.tried[names].bic:
            self.tried[names] = Explanation(names, fit, bic)
        return self.tried[names]


def _first(values: Array) -> float:
    return float(values[np.isfinite(values)][0])
