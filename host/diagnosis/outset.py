"""All that every vehicle has, fitted before any effect is tried alone.

The base equations bend so far to what a real vehicle has beside them that of its effects none alone says
much, and the search that begins with each takes longest. All at once take no longer than two of them: where
they leave nothing, it only has to be found which of them pay; where next to nothing, what acts beside them.
What they hardly touch is no hull's: then something may have changed under way.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from host.catalogue import ALONG_THE_HULL, FAINT, ORDINARY
from host.catalogue.moments import SCANS
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.explanation import Explanation, Names
from host.diagnosis.fitter import Fitter
from host.diagnosis.margins import LITTLE, MUCH
from host.diagnosis.pruning import pruned
from host.diagnosis.starts import begun_beside, guess
from host.diagnosis.together import with_more
from host.diagnosis.whole_vehicle import all_beside, ended, is_real
from host.diagnosis.workers import Workers
from host.gauss_newton import Point

if TYPE_CHECKING:
    from host.diagnosis.search import Search

FAR_LESS = 0.1  # of what the root leaves
LOST = 20.0  # times the noise floor: no hull leaves so much by what it is, but by what happens to it
LEADING = 3  # changes, beside which all the rest is tried


def at_the_outset(fitter: Fitter, jobs: int = 1) -> Explanation | None:
    """The root with all that every vehicle has, where it leaves much and they white noise, or far less.

    Where they lead nowhere, beside a change at one moment, if that leaves little. None where none do.
    """
    left = fitter.excess(fitter.root.fit)
    if left < MUCH:
        return None
    best = fitter.root
    names = frozenset({FREE_TRIM.name, *ORDINARY, *FAINT, ALONG_THE_HULL})
    names |= {*fitter.tools_beside(names)}
    for start in _starts(fitter, names):
        found = ended(fitter, start, names)
        if fitter.excess(found.fit) < MUCH and found.leaves_white:
            return found
        best = min(best, found, key=lambda e: e.bic)
        if fitter.excess(found.fit) > LOST:
            best = min(best, _beside_a_change(fitter, jobs), key=lambda e: e.bic)
            return best if fitter.excess(best.fit) < MUCH else None
    return fitter.polished(best) if fitter.excess(best.fit) < FAR_LESS * left else None


def _beside_a_change(fitter: Fitter, jobs: int) -> Explanation:
    """The likeliest change at one moment with all that every vehicle has."""
    with Workers(fitter, jobs) as workers:
        alone = workers.results([(Fitter.grown, (fitter.root, name, [])) for name in SCANS])
        leading = sorted(alone, key=lambda e: e.bic)[:LEADING]
        found: list[Explanation] = workers.results([(all_beside, (one,)) for one in leading])
    return min(found, key=lambda e: e.bic)


def goes_on_from(search: "Search", joint: Explanation) -> bool:
    """Whether many of a set of many pay, or of what else promises to beside them: then no search need begin.

    What pays is remembered. Of few, each alone tells more; and where something is left, a leading effect may.
    """
    search.on_progress("what every vehicle has")
    search.joint.add(joint.names)
    joint = with_more(search, search.remember(joint), least=0.0)
    is_all = joint.leaves_white or search.fitter.excess(joint.fit) < LITTLE
    if is_all and is_real(pruned(search, joint).names):
        return True
    search.joint.clear()  # beside what the search finds they are tried again
    return False


def _starts(fitter: Fitter, names: Names) -> Iterator[Point]:
    """Beside the root and a linear hull, where what joins hardly acts, and by what a regression says."""
    root, linear = (
        begun_beside(fitter, Point(fit.structure, fit.parameters, fit.initial, fit.levels), names)
        for fit in (fitter.root.fit, fitter.linear.fit)
    )
    yield from (root, linear)
    yield guess(fitter, root, names)
