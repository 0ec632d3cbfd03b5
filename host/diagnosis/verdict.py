"""The verdict on an explanation, and the sentence that says what remains.

As catalogues can imitate, an explanation that leaves nothing is not yet a good one: several effects at once,
none of which every vehicle has, are less likely than one that the catalogue lacks.
"""

from typing import Literal

from host.catalogue import BY_NAME, ORDINARY
from host.catalogue.kin import OFFSETS
from host.diagnosis.explanation import Explanation
from host.diagnosis.leftover import SEA_DOUBT, Leftover
from host.diagnosis.scoring import Misfit
from host.diagnosis.unknown_physics import known_in, unknown_in

Verdict = Literal["no_mismatch", "explained", "partly_explained", "unexplained"]
WORSE = 2.0  # chi2 of held-out spans from which on an explanation must at least better the base there
MOST_RARE = 2  # effects at once that not every vehicle has


def verdict_on(best: Explanation, left: Leftover, before: Misfit, after: Misfit) -> Verdict:
    """Of an explanation, by what it leaves and how far it betters the base on held-out spans."""
    if left.is_nothing and not best.names:
        return "no_mismatch"
    # Random forces spoil a free run whatever is known: it need not be better for knowing more.
    worst = max(before.chi2 * (SEA_DOUBT if best.fit.has_process_noise else 1.0), WORSE)
    if left.is_nothing and after.chi2 < worst and not unknown_in(best):
        return "explained" if len(rare_in(best)) <= MOST_RARE else "partly_explained"
    return "partly_explained" if known_in(best) and after.chi2 < 0.7 * before.chi2 else "unexplained"


def rare_in(explanation: Explanation) -> list[str]:
    """The effects of a set that not every vehicle has, and that are no offset."""
    usual = {*ORDINARY, *OFFSETS}
    return [name for name in known_in(explanation) if name not in usual and not BY_NAME[name].is_common]


def remaining(verdict: Verdict, best: Explanation, left: Leftover, after: Misfit) -> str:
    """What the explanation leaves, in words."""
    sea = (
        " Random forces act as well (waves, current, turbulence); they are part of the noise model."
        * best.fit.has_process_noise
    )
    if verdict == "no_mismatch":
        return "Nothing is missing from the base model on this recording." + sea
    forms = "".join(f" {sentence}" for sentence in unknown_in(best))
    worst = "depth" if after.chi2_depth > after.chi2_pitch else "pitch"
    size = max(after.chi2_depth, after.chi2_pitch) ** 0.5
    if verdict == "explained" and sea:
        return sea.strip()
    if verdict == "explained" and after.chi2 > WORSE:
        return (
            "Where it was learnt, what is left is as small as the sensors' own noise; on stretches that were "
            f"held out {worst} is off by {size:.1f} times it: a coefficient is not known well enough yet."
        )
    if verdict == "explained":
        return "What is left is as small as the sensors' own noise."
    if forms and left.is_nothing:
        return f"Physics is at work that the catalogue does not hold.{forms}" + sea
    if left.is_nothing and after.chi2 < WORSE and len(rare_in(best)) > MOST_RARE:
        listed = ", ".join(name.replace("_", " ") for name in rare_in(best))
        return (
            f"Nothing else is left, but {listed} seldom act at once: together they may imitate physics "
            "that the catalogue does not hold." + sea
        )
    if left.is_smooth:
        kind = "it depends on the motion, so it is physics and no sea, but none that is known here"
    elif left.is_nothing:
        kind = "what was learnt does not hold on the stretches that were held out"
    elif left.is_no_sea:
        kind = "it acts like noise, but too weakly for a sea: physics left out that comes and goes"
    elif left.is_coloured:
        kind = "it does not follow the motion: a disturbance with a rhythm or a drift of its own"
    else:
        kind = "it is as rough as sensor noise, but larger than these sensors show elsewhere"
    is_part = verdict == "partly_explained"
    begin = "Most is explained, but" if is_part else "None of the physics in the catalogue explains this:"
    return (
        f"{begin} {worst} is still off by {size:.1f} times its sensor noise in a free run; {kind}.{forms}"
        + sea
    )
