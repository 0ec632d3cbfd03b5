"""Which effects may join a set."""

from typing import TYPE_CHECKING

from host.catalogue import CHANGES
from host.catalogue.kin import OFFSETS
from host.catalogue.moments import SCANS
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.explanation import Explanation
from host.dynamics.equations import Effect

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search


def eligible(search: "Search") -> tuple[Effect, ...]:
    """The catalogue, and all that may change at one moment: after an alarm, or where a change shows."""
    known = search.fitter.candidates
    if not _shows_a_change(search):
        return known
    return known + tuple(effect for effect in CHANGES if effect not in known)


def other_changes(search: "Search") -> list[str]:
    """What else may change at one moment where a change shows, and was not tried alone."""
    if not _shows_a_change(search):
        return []
    return [change.name for change in CHANGES if search.root.names | {change.name} not in search.tried]


def _shows_a_change(search: "Search") -> bool:
    """Whether a change at one moment is in the likeliest set so far.

    At first a lost ballast, or a plane that turns the vehicle less; it may stand for another that came then.
    """
    likeliest = min(search.tried.values(), key=lambda e: e.bic, default=search.root)
    return bool(likeliest.names & SCANS.keys())


def candidates(search: "Search", parent: Explanation) -> list[str]:
    """What may join a set: the offsets only once the free trim, which does their work, has gone.

    What changes other terms joins these; and what is no physics, where it matters (Fitter.tools_beside).
    """
    barred = {*parent.names, *(OFFSETS if FREE_TRIM.name in parent.names else ())}
    names = [
        effect.name
        for effect in eligible(search)
        if effect.name not in barred and (not effect.changes or parent.names & {*effect.changes})
    ]
    return names + [name for name in search.fitter.tools_beside(parent.names) if name not in parent.names]
