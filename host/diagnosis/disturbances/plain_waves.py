"""Surface waves that are plain to see, before anything has been searched for."""

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import LINEAR, Fitter
from host.diagnosis.fits.margins import LITTLE, NAMING_MARGIN
from host.diagnosis.fits.sea_fits import as_filtered, roughly_with_waves, with_sea, with_waves
from host.diagnosis.fits.starts import begun_from
from host.likelihood.waves import MOST_STEPS, is_sea

MOSTLY = 0.7  # of what waves explain: of true ones a linear hull explains at most 0.4, of false ones 0.9
PARTLY = 0.2  # of what waves gain over white forces: of false ones 0.3 and more, of plain ones at most 0.02
NARROW = 0.26  # band of a fully developed sea; of true ones 0.03 to 0.17 was found beside a linear hull
SOME_STEPS = 8


def plain_waves(fitter: Fitter) -> Explanation | None:
    """The root among waves, where these are plain to see: likelier than white forces, and than none.

    Beside the root alone, unless the water would have to follow the plane; or beside a linear hull, of which
    a slow plane or an autopilot hides them. What such a hull does without forces is asked of broad ones.
    """
    root = fitter.root
    if fitter.excess(root.fit) < LITTLE:
        return None
    sea, calm = with_sea(fitter, root), as_filtered(fitter, root).bic
    least, gain, is_narrow = min(sea.bic, calm), NAMING_MARGIN, False
    if roughly_with_waves(fitter, sea).bic < least - NAMING_MARGIN:
        waves = with_waves(fitter, sea)
        if is_sea(waves.fit) and not _follow_the_plane(fitter, sea, waves):
            return waves
        gain = least - waves.bic
        is_narrow = is_sea(waves.fit) and waves.fit.waves[1] < NARROW
    if sea.bic > calm - NAMING_MARGIN or (not is_narrow and _does_a_linear_hull(fitter, calm - sea.bic)):
        return None
    beside = _beside_hull(fitter, _linear_in(fitter, sea), gain)
    return None if beside is None else with_waves(fitter, sea, beside.fit)


def whole_in_waves(fitter: Fitter, waves: Explanation, whole: Explanation) -> Explanation | None:
    """All that every vehicle has among waves that are likeliest beside it; None if something is left.

    Waves that are estimated beside the root alone are too broad: they do the work of what it lacks, and so
    hide what is slight.

    waves  the root among waves, where all of it must pay
    whole  the same without waves, which must be far less likely
    """
    held = fitter.explained(whole.names, fitter.carried_on(begun_from(fitter, waves, whole.names)))
    if held.bic > waves.bic - NAMING_MARGIN:
        return None
    found = with_waves(fitter, held)
    is_likelier = found.bic < as_filtered(fitter, whole).bic - NAMING_MARGIN
    return found if is_likelier and is_sea(found.fit) and found.leaves_white else None


def _follow_the_plane(fitter: Fitter, sea: Explanation, waves: Explanation) -> bool:
    """Whether what passes for waves is mostly what the plane does to any hull, or in part to one in a sea.

    Of a hull that is unstable only a filter tells that: no free run follows its linear part alone. A plane
    that follows narrow waves, as an autopilot's does, tells of these, too: among them the hull gains nothing.
    """
    hull = _linear_in(fitter, sea)
    if sea.bic - hull.bic > PARTLY * (sea.bic - waves.bic):
        is_broad = waves.fit.waves[1] > NARROW
        return is_broad or not waves.bic < with_waves(fitter, hull).bic < hull.bic - NAMING_MARGIN
    return _does_a_linear_hull(fitter, as_filtered(fitter, fitter.root).bic - waves.bic)


def _does_a_linear_hull(fitter: Fitter, gain: float) -> bool:
    """Whether a linear hull gains most of this much BIC without any forces."""
    calm, hull = (as_filtered(fitter, one).bic for one in (fitter.root, fitter.linear))
    return calm - hull > MOSTLY * gain


def _linear_in(fitter: Fitter, sea: Explanation) -> Explanation:
    """A linear hull among the white forces of a sea."""
    hull = sea
    for name in LINEAR:
        hull = fitter.grown(hull, name, [])
    return hull


def _beside_hull(fitter: Fitter, hull: Explanation, gain: float) -> Explanation | None:
    """A hull among waves, where these gain more BIC beside it than alone; what passes for waves less.

    A few steps show whether their band is narrow: of what the hull lacks, it is as broad as may be.
    """
    for steps in (SOME_STEPS, MOST_STEPS):
        beside = with_waves(fitter, hull, most_steps=steps)
        if not (is_sea(beside.fit) and beside.fit.waves[1] < NARROW):
            return None
    return beside if hull.bic - beside.bic > gain else None
