"""Which set of effects explains the recording: a beam search over sets, each refitted jointly.

Effects are never added one at a time for good: sets are carried side by side (host.diagnosis.search.beam),
every member of a set is re-estimated with the base whenever one joins, members that no longer pay are
dropped, and each member of the best set is exchanged for every other effect that might do its work. Each
effect is fitted alone; what it could gain beside others is predicted by one Gauss-Newton step from there, and
the promising ones are fitted.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from math import inf

from host.catalogue import DRIVE, named
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.absence import promises_more
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import LARGEST_SET, MUCH, ROUGH, SMALL
from host.diagnosis.fits.patience import is_over
from host.diagnosis.fits.prospects import gain
from host.diagnosis.fits.workers import Task, Workers
from host.diagnosis.search.beam import beam_search, grown
from host.diagnosis.search.candidates import candidates, other_changes
from host.diagnosis.search.exchange import exchanged, twins
from host.diagnosis.search.offset_choice import with_best_offsets, with_offsets_asked_again, with_one_offset
from host.diagnosis.search.outset import FAR_LESS, goes_on_from
from host.diagnosis.search.pruning import pruned
from host.diagnosis.search.rarity import told_by_the_usual
from host.diagnosis.search.together import completed, with_more
from host.diagnosis.search.whole_vehicle import whole, with_all_ordinary
from host.recordings.recording import Array

MOST_ROUNDS = 4
LOST = 10.0  # times the noise floor: forces as slight as this leave no stable hull so far away
FAR_LIKELIER = 2.0  # of BIC a sample: what no few effects more make up for
LIKELIER = 0.5  # the same, of forces beside which a search has come to its end

Progress = Callable[[str], None]


@dataclass(slots=True)
class Search:
    """Explanations of some recordings, each set fitted once, best start kept.

    base  the paper's equations alone, `root` the same with a free trim, from which all grows
    part  the search, over an excerpt of the recordings or without random forces, that this one goes on from
    alone  each effect alone, where these were fitted before
    rivals  sets that were fitted in an exchange
    joint   sets with all that every vehicle has
    steered  what a continuation found likeliest under forces; `at_sea` under the likeliest, once asked
    pushed  what was found beside drift, under forces that are likelier in its place
    asks_drift  whether something may drift beside white noise; `adrift` a set beside that, where it is plain
    is_second  it was all searched with the plane the other way, too, where no continuation helped
    outset  the root with all that every vehicle has, where that leaves nothing, or next to nothing
    instead  whether something else explains all, asked where a dozen effects leave much; `is_needless` if so
    """

    fitter: Fitter
    workers: Workers
    on_progress: Progress
    base: Explanation
    root: Explanation
    part: "Search | None" = None
    alone: tuple[Explanation, ...] = ()
    tried: dict[Names, Explanation] = field(default_factory=dict)
    rivals: set[Names] = field(default_factory=set)
    joint: set[Names] = field(default_factory=set)
    steered: Explanation | None = None
    at_sea: Explanation | None = None
    pushed: Explanation | None = None
    is_second: bool = False
    outset: Explanation | None = None
    instead: Callable[[], bool] = lambda: False
    is_needless: bool = False
    asks_drift: bool = False
    adrift: Explanation | None = None
    _shrunk: dict[Names, set[Names]] = field(default_factory=dict)  # those fitted from larger sets: which
    _polished: set[Names] = field(default_factory=set)  # those of them fitted to the end
    _completions: dict[tuple[Names, float], Explanation] = field(default_factory=dict)  # by set and BIC

    def run(self, also: list[Explanation] | None = None) -> Explanation:
        """The best explanation all of whose members pay for themselves; `also` are sets worth a look."""
        for explanation in (self.base, *(also or [])):
            self.remember(explanation)
        self.remember(self.root)
        if self.part is not None or any(len(e.names) > LARGEST_SET for e in also or []):
            self.on_progress("settling")
            found = self._settled(min(self.untrimmed, key=lambda e: e.bic))
            if self.part is None:
                return told_by_the_usual(self, whole(self, found))
            return self._with_what_a_part_hid(found)
        if self.outset is not None and goes_on_from(self, self.outset):
            found = self._concluded()
            if is_over() or min(e.bic for e in self.singles()) > found.bic + ROUGH:  # else many do one's work
                return found
            self.alone = self.alone_so_far()
        beam_search(self)
        if self.is_led_elsewhere:
            return min(self.untrimmed, key=lambda e: e.bic)
        return with_best_offsets(self) if self.is_needless else self._concluded()

    @property
    def untrimmed(self) -> list[Explanation]:
        """All that was tried without a free trim, which is no physics."""
        return [e for e in self.tried.values() if FREE_TRIM.name not in e.names]

    def run_from(self, joint: Explanation, is_all: bool = False) -> Explanation:
        """The best explanation from a set of many: with what else promises most, pruned and exchanged.

        is_all  nothing else promises anything, as was asked before
        """
        for explanation in (self.base, self.root, joint):
            self.remember(explanation)
        self.joint.add(joint.names)
        self.remember(pruned(self, joint if is_all else with_more(self, joint, least=0.0)))
        return self._concluded()

    def settle(self, best: Explanation) -> Explanation:
        """A set that was found elsewhere, pruned and exchanged here."""
        for explanation in (self.base, self.root, best):
            self.remember(explanation)
        self.on_progress("settling")
        return self._settled(best)

    def _concluded(self) -> Explanation:
        """The best set with offsets in the place of its free trim, settled, and what only then shows."""
        self.on_progress("settling")
        found = self._settled(with_best_offsets(self))
        if is_over():
            return found
        best = with_one_offset(self, told_by_the_usual(self, whole(self, completed(self, found))))
        return with_offsets_asked_again(self, best, best is not found)

    def _with_what_a_part_hid(self, found: Explanation) -> Explanation:
        """A set of few with what only all of the recordings show, settled again."""
        if len(found.names) > LARGEST_SET or found.fit.has_process_noise:
            return found
        more = with_more(self, found, least=0.0)
        return found if more is found else self._settled(more)

    def singles(self) -> list[Explanation]:
        """Each effect alone on top of the root; what else may change, where the likeliest is a change."""
        if self.alone:
            return [self.remember(explanation) for explanation in self.alone]
        found = grown(self, [self.remember(self.root)], 1)
        if tasks := [self.growth(self.root, name) for name in other_changes(self)]:
            found += [self.remember(explanation) for explanation in self.workers.results(tasks)]
        return found

    def alone_so_far(self) -> tuple[Explanation, ...]:
        """Each effect alone on top of the root, as far as these were fitted."""
        return tuple(e for e in self.tried.values() if FREE_TRIM.name in e.names and len(e.names) == 2)

    def without(self, best: Explanation, name: str) -> Explanation:
        """The set less one member."""
        return self.each_without(best, [name])[0]

    def each_without(self, best: Explanation, members: list[str]) -> list[Explanation]:
        """The set less each of these members; of a large one, what is far from it is fitted roughly."""
        sets = [best.names - {name} for name in members]
        self.shrink(
            best, [names for names in sets if names not in self.tried or self._falls_behind(names, best)]
        )
        limit = best.bic + (ROUGH if len(best.names) > LARGEST_SET else inf)
        self.polish([names for names in sets if names in self._shrunk and self.tried[names].bic < limit])
        return [self.tried[names] for names in sets]

    def without_all(self, best: Explanation, members: list[str]) -> Explanation:
        """The set less all of these members at once, fitted to the end."""
        (found,) = self.workers.results([(Fitter.shrunk, (best, *members))])
        self.polish([self.remember(found).names])
        return self.tried[found.names]

    def completion(self, explanation: Explanation) -> Explanation:
        """The set with all that every vehicle has; see host.diagnosis.search.whole_vehicle."""
        key = explanation.names, explanation.bic
        if key not in self._completions:
            (found,) = self.workers.results([(with_all_ordinary, (explanation,))])
            self._completions[key] = found.lean()
        return self._completions[key]

    def gain_alone(self, name: str) -> float:
        """What the effect alone takes off the BIC: of the root, of the base if an offset; -inf if untried."""
        if self.part is not None:
            return self.part.gain_alone(name)
        for start in (self.root, self.base):
            if start.names | {name} in self.tried:
                return start.bic - self.tried[start.names | {name}].bic
        return -inf

    def _alone(self, name: str) -> Explanation | None:
        if self.part is not None:
            return self.part._alone(name)
        return self.tried.get(frozenset({name, FREE_TRIM.name}), self.tried.get(frozenset({name})))

    def gains(
        self, parent: Explanation, is_thorough: bool = True, among: set[str] | None = None
    ) -> dict[str, float]:
        """Twice the log-likelihood each effect could gain on top of the parent, predicted."""
        others = [name for name in candidates(self, parent) if among is None or name in among]
        found = self.workers.results(
            [(gain, (parent, name, self.values(name), is_thorough)) for name in others]
        )
        return dict(zip(others, found, strict=True))

    def growth(self, parent: Explanation, name: str) -> Task:
        """The fit of a set with one effect, or form of unknown physics, more, unless it was made before."""
        known = self.fitter.at_first.get(parent.names | {name})
        if known is not None and parent.bic == self.fitter.root.bic:
            return _known, (known,)
        return Fitter.grown, (parent, name, self.values(name))

    def shrink(self, explanation: Explanation, smaller: Iterable[Names]) -> None:
        """Fits sets of one member less roughly, once; again from a larger set that foretells more."""
        new = [
            names for names in smaller if names not in self._shrunk or self._falls_behind(names, explanation)
        ]
        members = [next(iter(explanation.names - names)) for names in new]
        for found in self.workers.results([(Fitter.shrunk, (explanation, member)) for member in members]):
            self.remember(found)
        for names in new:
            self._shrunk.setdefault(names, set()).add(explanation.names)
            self._polished.discard(names)

    def _falls_behind(self, names: Names, larger: Explanation) -> bool:
        """Whether a set that is known should do better from a larger one, from which it was not fitted."""
        if larger.names in self._shrunk.get(names, ()):
            return False
        (member,) = larger.names - names
        return promises_more(larger.fit, named(member), self.tried[names].fit)

    def polish(self, sets: Iterable[Names]) -> None:
        """Fits sets to the end, once."""
        new = [names for names in sets if names not in self._polished]
        for found in self.workers.results([(Fitter.polished, (self.tried[names],)) for names in new]):
            self.remember(found)
        self._polished.update(new)

    def polished_near(self, rough: list[Explanation], bic: float) -> list[Explanation]:
        """Those of them that may come near this BIC, fitted to the end."""
        tasks: list[Task] = [(Fitter.polished, (e,)) for e in rough if e.bic < bic + ROUGH]
        return [self.remember(e) for e in self.workers.results(tasks)]

    def elsewhere(self, fitter: Fitter, workers: Workers) -> "Search":
        """A search with nothing tried yet, over other stretches."""
        return Search(fitter, workers, self.on_progress, fitter.base, fitter.root)

    def remember(self, explanation: Explanation) -> Explanation:
        """Keeps the better of two fits of one set."""
        known = self.tried.get(explanation.names)
        if known is None or explanation.bic < known.bic:
            self.tried[explanation.names] = explanation.lean()
        return self.tried[explanation.names]

    def across(self, explanations: list[Explanation]) -> list[Explanation]:
        """Each in its likeliest valley."""
        return [self.remember(e) for e in self.workers.results([(Fitter.across, (e,)) for e in explanations])]

    def values(self, name: str) -> list[Array]:
        """Where a fit of this effect alone ended: a better start than its probes."""
        alone = self._alone(name)
        if alone is None:
            return []
        fit = alone.fit
        own = [fit.structure.names.index(p.name) for p in named(name).parameters]
        return [fit.parameters[own]]

    def _settled(self, best: Explanation) -> Explanation:
        """Prunes and exchanges members of the set until neither helps, in the likeliest valley."""
        (best,) = self.across([best])
        settled: Names = frozenset()
        for _ in range(MOST_ROUNDS):
            best = pruned(self, best)
            if is_over():
                break
            if len(best.names) > LARGEST_SET and (self.part is not None or self.is_hopeless(best)):
                break  # exchanged there, or not worth the time
            rival = exchanged(self, best, settled)
            if rival is best:
                break
            settled = frozenset()
            if len(rival.names) > SMALL:  # once more only what had an equal before
                settled = rival.names - {name for name in best.names if twins(self, best, name)}
            best = rival
            if best.names == settled:
                break
        return best

    @property
    def follows_no_free_run(self) -> bool:
        """Whether slight forces let the equations follow a vehicle that they lose without: it is unstable."""
        return self.steered is not None and self._is_lost and self.fitter.are_slight(self.steered.fit.noise)

    @property
    def is_pushed_about(self) -> bool:
        """Whether no free run comes near the vehicle, where the equations follow it under random forces.

        It may be unstable as well; turns push it, or what is not in the equations at all. A fault of the
        plane's drive that explains most of what moves it does not: then the search goes on beside that.
        """
        is_so = self.pushed is not None and self._are_far_behind(self.pushed, LIKELIER)
        if self.steered is not None and self._is_lost:
            is_so |= self._are_far_behind(self.steered, FAR_LIKELIER)
        return is_so and self.fault_of_the_drive is None

    def _are_far_behind(self, one: Explanation, by: float) -> bool:
        """Whether all that was tried is less likely than one by so much of BIC a sample."""
        return one.bic < min(e.bic for e in self.tried.values()) - by * one.fit.samples

    @property
    def fault_of_the_drive(self) -> Explanation | None:
        """The likeliest set of few, where one keeps the plane back and far less is left than by the root."""
        few = (e for e in self.tried.values() if len(e.names - {FREE_TRIM.name}) <= LARGEST_SET)
        leading = min(few, key=lambda e: e.bic, default=self.root)
        most = FAR_LESS * self.fitter.excess(self.root.fit)
        is_one = leading.names & {*DRIVE} and self.fitter.excess(leading.fit) < most
        return leading if is_one else None

    @property
    def _is_lost(self) -> bool:
        """Whether all that every vehicle has, and what promised most beside it, leaves very much."""
        left = (self.fitter.excess(self.tried[names].fit) for names in self.joint)
        return min(left, default=0.0) > LOST

    @property
    def is_led_elsewhere(self) -> bool:
        """Whether no free run under white noise alone will tell."""
        return self.follows_no_free_run or self.is_pushed_about or self.adrift is not None

    def is_hopeless(self, best: Explanation) -> bool:
        """Whether much is left although all that every vehicle has was tried at once."""
        return bool(self.joint) and self.fitter.excess(best.fit) > MUCH


def _known(_: Fitter, explanation: Explanation) -> Explanation:
    return explanation
