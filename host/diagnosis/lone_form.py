"""One form of unknown physics beside the leading effect.

Where that leaves little, what every vehicle has would only imitate it: a long search for a worse answer.
"""

from typing import TYPE_CHECKING

from host.catalogue.unknown import AS_OF_PLANE
from host.diagnosis.explanation import Explanation
from host.diagnosis.margins import LITTLE, MUCH, margin
from host.diagnosis.prospects import form_gains

if TYPE_CHECKING:
    from host.diagnosis.search import Search

PROMISING = 2  # forms beside a set that are fitted in earnest
FAIR_PART = 0.3  # of what a member was worth, that a form in its place must promise: predictions are local


def lone_form(search: "Search", leading: Explanation) -> Explanation | None:
    """A form beside the leading effect, or alone, that clearly betters it and leaves little; else None.

    The search does not remember it: what the catalogue can do is tried first.
    """
    search.on_progress("one form of unknown physics")
    parents = [leading, search.root]
    found = search.workers.results([(form_gains, (parent,)) for parent in parents])
    tasks = [
        search.growth(parent, name)
        for parent, gains in zip(parents, found, strict=True)
        for name in likely_forms(gains, margin(leading) + FAIR_PART * (parent.bic - leading.bic))
    ]
    best = min(search.workers.results(tasks), key=lambda e: e.bic, default=leading)
    if best.bic > leading.bic - margin(leading):
        return None
    left = search.fitter.excess(best.fit)
    return best if left < LITTLE or (left < MUCH and best.leaves_white) else None


def likely_forms(gains: dict[str, float], least: float, count: int = PROMISING) -> list[str]:
    """The forms predicted to gain most, more than `least`.

    Where a plane makes both, its force or its moment alone promises nearly as much: it joins them.
    """
    likely = sorted((name for name in gains if gains[name] > least), key=lambda name: -gains[name])[:count]
    of_plane = (AS_OF_PLANE[name] for name in likely if name in AS_OF_PLANE)
    return [*likely, *(name for name in of_plane if name in gains and name not in likely)]
