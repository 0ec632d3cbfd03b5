"""Whether something outside the catalogue does better than the entries that imitate it together.

Few entries of a catalogue can follow nearly anything: drag and a current that cancels a buoyancy are the drag
on one side of a keel. What gives them away is that one form of unknown physics (host.catalogue.unknown)
explains the recording better, and with it some of them are no longer needed. For the same reason the set that
the search found grows further only in competition with these forms.
"""

import numpy as np

from host.catalogue import BY_NAME, UNKNOWN
from host.catalogue.unknown import IN_LAYERS, over_depth
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.margins import FEW, LARGEST_SET, LITTLE, NAMING_MARGIN, SMALL, margin
from host.diagnosis.fits.patience import is_over
from host.diagnosis.fits.prospects import form_gains
from host.diagnosis.search.exchange import exchanged
from host.diagnosis.search.lone_form import FAIR_PART, PROMISING, likely_forms
from host.diagnosis.search.pruning import pruned
from host.diagnosis.search.search import Search
from host.diagnosis.search.together import completed
from host.dynamics.equations import Effect

MOST_ROUNDS = 8
MOST_FORMS = 3  # of unknown physics beside many effects: more tell nothing of what acts
MOST_TOLD = 3  # coefficients that a sentence can hold


def with_unknown(search: Search, best: Explanation) -> Explanation:
    """The best explanation with forms of unknown physics in it, or more effects, if these pay."""
    search.on_progress("physics outside the catalogue")
    settled = best.names
    for _ in range(_rounds(search, best)):
        if is_over():
            break
        grown = _grown(search, best)
        # Of a large set each member costs a long fit to try without: that waits until all have joined.
        leaner = grown if _is_large(best) else (pruned(search, e) for e in grown)
        better = min(leaner, key=lambda e: e.bic, default=best)
        if better.bic > best.bic - margin(better):
            break
        best = better
        if _is_large(best) and len(_forms_in(best)) == MOST_FORMS:
            break
    if not _is_large(best):
        return best
    best = pruned(search, best)
    if is_over() or search.part is not None or search.is_hopeless(best) or _is_left_open(search, best):
        return best
    best = completed(search, best)
    return best if _forms_in(best) else exchanged(search, best, settled)


def _is_left_open(search: Search, best: Explanation) -> bool:
    """Whether a form of unknown physics is needed and is not enough: then no exchange makes names certain."""
    return bool(_forms_in(best)) and search.fitter.excess(best.fit) > LITTLE


def _rounds(search: Search, best: Explanation) -> int:
    """How often something more may join; a large set that leaves much cannot be named, only described."""
    if not _is_large(best):
        return MOST_ROUNDS
    if search.part is not None:
        return 1
    return FEW if search.is_hopeless(best) else MOST_ROUNDS


def unknown_in(explanation: Explanation) -> list[str]:
    """The forms of unknown physics in a set, in words: what acts, its equation, its coefficients if few."""
    fit = explanation.fit
    values = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    said = []
    for form in (UNKNOWN[name] for name in _forms_in(explanation)):
        listed = [f"{p.name} = {values[p.name]:.3g} {p.unit}" for p in form.parameters]
        told = f"; {', '.join(listed)}" if len(listed) <= MOST_TOLD else ""
        told += _over_depth(form, values) if form.name in IN_LAYERS else ""
        said.append(f"{form.sentence[:-1]} ({form.equation}{told}).")
    return said


def _over_depth(form: Effect, values: dict[str, float]) -> str:
    """Between what a form in layers goes, and at which depths: but for a constant, which others tell."""
    depths, sizes = over_depth(form.name, values)
    least, most = int(np.argmin(sizes)), int(np.argmax(sizes))
    unit = form.parameters[0].unit
    return (
        f"; from {sizes[least]:.3g} {unit} at {depths[least]:.3g} m to {sizes[most]:.3g} at "
        f"{depths[most]:.3g} m, changing most at {depths[np.argmax(np.abs(np.diff(sizes)))]:.3g} m"
    )


def without_unknown(search: Search, best: Explanation) -> Explanation:
    """The set less its forms of unknown physics."""
    for name in _forms_in(best):
        best = search.without(best, name)
    return best


def _forms_in(explanation: Explanation) -> list[str]:
    return sorted(explanation.names & UNKNOWN.keys())


def known_in(explanation: Explanation) -> list[str]:
    """The entries of the catalogue in a set."""
    return [name for name in BY_NAME if name in explanation.names]


def _is_large(explanation: Explanation) -> bool:
    return len(explanation.names) > LARGEST_SET


def _grown(search: Search, best: Explanation) -> list[Explanation]:
    """The set with a form more, beside all its members or in the place of one: the two best.

    And with another effect more, which with the free trim in its place may have promised nothing. In the
    place of one of many members a form says little.
    """
    parents = [best]
    if not _is_large(best):
        parents += search.each_without(best, sorted(best.names))
    found = search.workers.results([(form_gains, (parent,)) for parent in parents])
    chosen = {}
    for parent, gains in zip(parents, found, strict=True):
        # What a form gains where a member is gone must come near to what the member was worth.
        least = max(NAMING_MARGIN, FAIR_PART * (parent.bic - best.bic))
        for name in likely_forms(gains, least, PROMISING if len(best.names) <= SMALL else 1):
            chosen[parent.names | {name}] = parent, name
    gains = search.gains(best, is_thorough=not _is_large(best))
    for name in sorted(gains, key=lambda name: -gains[name])[:FEW]:
        if gains[name] > margin(best):
            chosen[best.names | {name}] = best, name
    grown = search.workers.results([search.growth(parent, name) for parent, name in chosen.values()])
    polished = search.polished_near(grown, min((e.bic for e in grown), default=0.0))
    count = 2 if len(best.names) <= SMALL else 1
    return sorted(polished, key=lambda e: e.bic)[:count]
