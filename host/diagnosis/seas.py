"""Searches under random forces: where the sea moves the vehicle, and where it does so with a wave's swing."""

from dataclasses import dataclass

import numpy as np

from host.catalogue import BY_NAME
from host.catalogue.environment import WAVE_PERIODS
from host.catalogue.unknown import SWINGING_MOMENT
from host.diagnosis.explanation import Explanation
from host.diagnosis.margins import NAMING_MARGIN
from host.diagnosis.sea_fits import as_filtered, with_regular_waves, with_sea, with_waves
from host.diagnosis.search import Search
from host.wave_forces import BROADEST

WAVES = "surface_waves"


@dataclass(frozen=True, slots=True, kw_only=True)
class Waves:
    """Surface waves that were named by their swing.

    delta_bic  what white random forces in their place lose
    fitted     what was found beside them, their band and height estimated with it
    model      the same with the regular wave nearest to them, to be simulated
    """

    delta_bic: float
    fitted: Explanation
    model: Explanation


def in_a_sea(calm: Search, best: Explanation) -> tuple[Search, Explanation]:
    """The search again with random forces, where these explain more than any set of effects alone.

    Each is charged for what it adds, so a set that leaves white noise needs no sea, and a sea needs no set.
    """
    fitter = calm.fitter
    calm.on_progress("random forces")
    root, also = with_sea(fitter, calm.root), with_sea(fitter, best)
    least = as_filtered(fitter, best).bic
    if min(root.bic, also.bic) > least - NAMING_MARGIN:
        return calm, best
    rough = Search(fitter, calm.workers, calm.on_progress, with_sea(fitter, calm.base), root, calm.part)
    found = rough.run([also])
    return (rough, found) if found.bic < least else (calm, best)


def among_waves(
    rough: Search, best: Explanation, calm: Explanation
) -> tuple[Search, Explanation, Waves | None]:
    """Where random forces that swing with a wave's period beat white ones: the search again among them.

    A filter that takes waves for white forces follows the measurements in the wrong band, and so hides what
    acts beside them. While sets are compared the waves stay as they were first found: beside the best set,
    or beside the named effects of that found without random forces, whichever is likelier.
    """
    fitter, swing = rough.fitter, best.names & {SWINGING_MOMENT.name, WAVES}
    if WAVES in best.names and not best.fit.has_process_noise:
        return rough, best, None  # regular ones
    if not (best.fit.has_process_noise or swing):
        return rough, best, None
    rough.on_progress("waves")
    # What swings in the band of waves may be the waves.
    plain = best
    for name in sorted(swing):
        plain = rough.without(plain, name)
    white = plain if plain.fit.has_process_noise else with_sea(fitter, plain)
    named = calm.names & BY_NAME.keys() - {WAVES}
    beside = [with_sea(fitter, fitter.reduced(calm, named))] if named - white.names else []
    first = min((with_waves(fitter, one) for one in (white, *beside)), key=lambda e: e.bic)
    period = 2.0 * np.pi / first.fit.waves[0]
    least = as_filtered(fitter, best).bic
    is_sea = WAVE_PERIODS[0] < period < WAVE_PERIODS[1] and first.fit.waves[1] < BROADEST
    if first.bic > least - NAMING_MARGIN or not is_sea:
        return rough, best, None
    base, root = (with_waves(fitter, one, first.fit) for one in (rough.base, rough.root))
    search = Search(fitter, rough.workers, rough.on_progress, base, root, rough.part)
    found = search.run([first])
    fitted = first if found.names == first.names else with_waves(fitter, found)
    model = with_regular_waves(fitter, fitted, white.fit)
    return search, found, Waves(delta_bic=least - first.bic, fitted=fitted, model=model)
