"""Which offsets the free trim stands for: buoyancy, a trim moment, a zero error, a bias, a current."""

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from host.catalogue import named
from host.catalogue.kin import OFFSETS, measure_alike
from host.catalogue.moments import SCANS
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.margins import LARGEST_SET, LITTLE, NAMING_MARGIN, ROUGH, margin
from host.diagnosis.fits.trims import COMPRESSED, retrimmed
from host.diagnosis.fits.workers import Task
from host.diagnosis.search.exchange import exchanged
from host.diagnosis.search.pruning import pruned
from host.diagnosis.search.whole_vehicle import is_real

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

LEADING = 8  # sets with a free trim that are looked at
CONTENDERS = 3  # of them, for the first place
LIKELY = 2  # offsets that may stand alone
FAR_AWAY = 5.0  # times the range of depths that were seen
BENT_BY_A_ZERO = ("speed_loss", "actuator_saturation", "rudder_stall", "rudder_effectiveness_change")
"""What depends on the plane's angle as no constant force and moment do."""


def with_best_offsets(search: "Search") -> Explanation:
    """The leading sets with the free trim explained by as few of the offsets as will do."""
    free = [e for e in search.tried.values() if FREE_TRIM.name in e.names]
    free = sorted((e for e in free if not _has_idle_member(search, e)), key=lambda e: e.bic)
    polished = search.polished_near(free[:LEADING], free[0].bic)
    leading = min(polished, key=lambda e: e.bic)
    # Those that come close may sit in poorer valleys than it does.
    close = sorted((e for e in polished if e.bic < leading.bic + ROUGH), key=lambda e: e.bic)
    if len(close) > 1 and search.fitter.excess(leading.fit) < LITTLE:
        polished = search.across(close[:CONTENDERS]) + close[CONTENDERS:]
        leading = min(polished, key=lambda e: e.bic)
    polished = [e for e in polished if e.bic < leading.bic + 2.0 * NAMING_MARGIN]
    if len(leading.names) > LARGEST_SET:
        polished = [leading]
    explained = search.untrimmed
    for counts in ((0, 1), (2,)):
        ways = [frozenset(way) for count in counts for way in combinations(OFFSETS, count)]
        tasks = [(retrimmed, (e, way)) for e in polished for way in ways]
        found = [search.remember(e) for e in search.workers.results(tasks)]
        explained += search.polished_near(found, min(e.bic for e in [*explained, *found]))
        best = min(explained, key=lambda e: e.bic)
        if best.bic < leading.bic + margin(leading):
            break
    return best


def with_offsets_asked_again(search: "Search", best: Explanation, is_new: bool) -> Explanation:
    """The set with what shifts the steady state told as is likeliest, of a new set for all offsets."""
    best = with_lasting_offsets(search, with_likeliest_offsets(search, best) if is_new else best)
    return with_constant_buoyancy(search, best)


def with_likeliest_offsets(search: "Search", best: Explanation) -> Explanation:
    """The set with an offset exchanged for another, where that is likelier beside its other members.

    Beside others another may have been: a slow sensor in the place of a servo shifts the steady state, too.
    """
    mine, offsets = best.names & {*OFFSETS}, frozenset(OFFSETS)
    ways = {mine - {member} | {other} for member in mine for other in offsets - mine}
    tasks: list[Task] = [(retrimmed, (best, way)) for way in sorted(ways, key=sorted)]
    found = [search.remember(e) for e in search.workers.results(tasks)]
    return min([best, *search.polished_near(found, best.bic)], key=lambda e: e.bic)


def with_lasting_offsets(search: "Search", best: Explanation) -> Explanation:
    """The set with an offset in the place of a change of the same, where that is likelier.

    A change in the first seconds may be one: it made up for what else was lacking there when it was found.
    """
    pairs = [(change, offset) for change in sorted(best.names & {*SCANS}) for offset in OFFSETS]
    for change, offset in pairs:
        is_asked = change in best.names and offset not in best.names
        if not is_asked or not measure_alike(named(change), named(offset)):
            continue
        values = dict(zip(best.fit.structure.names, best.fit.parameters.tolist(), strict=True))
        size = np.array([values[named(change).parameters[0].name]])
        fewer = search.fitter.shrunk(best, change)
        lasting = search.fitter.polished(search.fitter.grown(fewer, offset, [size]))
        best = min(best, search.remember(lasting), key=lambda e: e.bic)
    return best


def with_constant_buoyancy(search: "Search", best: Explanation) -> Explanation:
    """The set with a net buoyancy in the place of one that changes with depth, unless that clearly pays.

    Neutral at a depth far from any that was seen, it changes little there and is most of all a constant
    force; which an exchange of one member beside many others no longer asks.
    """
    if COMPRESSED not in best.names or "net_buoyancy" in best.names:
        return best
    values = dict(zip(best.fit.structure.names, best.fit.parameters.tolist(), strict=True))
    depths = np.concatenate([recording.depth for recording in search.fitter.recordings])
    away = float(np.nanmean(depths)) - values["neutral_depth"]
    if abs(away) < FAR_AWAY * float(np.nanmax(depths) - np.nanmin(depths)):
        return best
    fewer = search.fitter.shrunk(best, COMPRESSED)
    size = np.array([values["c_wz"] * away])
    constant = search.fitter.polished(search.fitter.grown(fewer, "net_buoyancy", [size]))
    return min(best, search.remember(constant), key=lambda e: e.bic + margin(e) * (e is best))


def with_one_offset(search: "Search", best: Explanation) -> Explanation:
    """The set with one offset in place of two, where that is likelier.

    Two are free to follow what is lacking; a zero error of the plane, which pushes and turns at once, is not.
    Beside the one a real vehicle has all that each of them has, and few effects may be others.
    """
    if len(best.names & {*OFFSETS}) < 2 or search.root.fit.has_process_noise:
        return best
    has_all = is_real(best.names)
    if not has_all and len(best.names) > LARGEST_SET:
        return best
    search.on_progress("one offset in place of two")
    tasks: list[Task] = [(retrimmed, (best, frozenset({name}))) for name in OFFSETS]
    ones = [search.remember(one) for one in search.workers.results(tasks)]
    likely = sorted(ones, key=lambda e: e.bic)[:LIKELY]
    if has_all:
        found = [pruned(search, search.remember(search.completion(one))) for one in likely]
    else:
        near = search.polished_near(likely, best.bic)
        found = [exchanged(search, one, one.names & {*OFFSETS}) for one in near]
    return min([best, *found], key=lambda e: e.bic)


def with_offset(search: "Search", beam: list[Explanation]) -> list[Explanation]:
    """The beam, before it the best of its sets with an offset, if that explains more than the free trim.

    At a speed that changes no constant force does what a bias of the pitch sensor or a current does, and none
    what a zero error of the plane does to all that depends on its angle.
    """
    zero = search.remember(search.fitter.grown(search.base, "rudder_offset", []))
    tasks: list[Task] = [(retrimmed, (e, frozenset({name}))) for e in beam for name in OFFSETS]
    candidates = {effect.name for effect in search.fitter.candidates}
    tasks += [search.growth(zero, name) for name in BENT_BY_A_ZERO if name in candidates]
    best = min((search.remember(e) for e in search.workers.results(tasks)), key=lambda e: e.bic)
    return [best, *beam] if best.bic < beam[0].bic - margin(beam[0]) else beam


def _has_idle_member(search: "Search", explanation: Explanation) -> bool:
    """Whether a smaller set does better; if as well only, the free trim may do a part of the work."""
    return any(
        search.root.names <= names < explanation.names and smaller.bic < explanation.bic
        for names, smaller in search.tried.items()
    )
