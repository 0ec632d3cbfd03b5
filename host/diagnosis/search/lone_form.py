"""One form of unknown physics beside the leading effect, or beside the one that it goes with.

Where that leaves little, what every vehicle has would only imitate it: a long search for a worse answer.
"""

from typing import TYPE_CHECKING

from host.catalogue import UNKNOWN
from host.catalogue.unknown import AS_OF_PLANE
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.margins import LITTLE, MUCH, NAMING_MARGIN, margin
from host.diagnosis.fits.prospects import form_gains
from host.diagnosis.fits.workers import Task

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

PROMISING = 2  # forms beside a set that are fitted in earnest
FAIR_PART = 0.3  # of what a member was worth, that a form in its place must promise: predictions are local
HOPELESS = 5.0  # times the noise floor, that a form beside one effect leaves: another is not enough, either
ONE_SIDED = {"heave_quadratic_drag": "unknown_force_w_w", "pitch_quadratic_damping": "unknown_moment_q_q"}
"""Entries that are half of a drag which differs up and down, and the forms that are the other half."""


def lone_form(search: "Search", leading: Explanation) -> Explanation | None:
    """A form beside at most one effect that clearly betters the leading one and leaves little; else None.

    The search does not remember what it finds: what the catalogue can do is tried first.
    """
    search.on_progress("one form of unknown physics")
    parents = [leading, search.root]
    found = search.workers.results([(form_gains, (parent,)) for parent in parents])
    tasks = [
        search.growth(parent, name)
        for parent, gains in zip(parents, found, strict=True)
        for name in likely_forms(gains, max(NAMING_MARGIN, FAIR_PART * (parent.bic - leading.bic)))
    ]
    grown = search.workers.results(tasks)
    # Of a swing that bends the base a step foretells little; those that were fitted at the outset are known.
    known = [one for one in search.fitter.at_first.values() if one.names & UNKNOWN.keys()]
    best: Explanation = min([leading, *grown, *known], key=lambda e: e.bic)
    if _is_enough(search, best, leading):
        return best
    if search.fitter.excess(best.fit) > HOPELESS:
        return None
    tasks = [task for e in grown for task in _with_one_more(search, e)]
    alone = {name: search.tried.get(search.root.names | {name}) for name in ONE_SIDED}
    tasks += [search.growth(e, ONE_SIDED[name]) for name, e in alone.items() if e is not None]
    best = min([leading, *search.workers.results(tasks)], key=lambda e: e.bic)
    # Of several entries that act at once two members leave little, too, but nothing white.
    return best if best.leaves_white and _is_enough(search, best, leading) else None


def _is_enough(search: "Search", explanation: Explanation, leading: Explanation) -> bool:
    left = search.fitter.excess(explanation.fit)
    is_better = bool(explanation.bic < leading.bic - margin(leading))
    return is_better and (left < LITTLE or (left < MUCH and explanation.leaves_white))


def _with_one_more(search: "Search", form: Explanation) -> list[Task]:
    """The set with one of the most promising entries of the catalogue more."""
    gains = search.gains(form)
    promising = sorted(gains, key=lambda name: -gains[name])[:PROMISING]
    return [search.growth(form, name) for name in promising]


def likely_forms(gains: dict[str, float], least: float, count: int = PROMISING) -> list[str]:
    """The forms predicted to gain most, more than `least`.

    Where a plane makes both, its force or its moment alone promises nearly as much: it joins them.
    """
    likely = sorted((name for name in gains if gains[name] > least), key=lambda name: -gains[name])[:count]
    of_plane = (AS_OF_PLANE[name] for name in likely if name in AS_OF_PLANE)
    return [*likely, *(name for name in of_plane if name in gains and name not in likely)]
