"""The verdict on an explanation, and the sentence that says what remains.

As catalogues can imitate, an explanation that leaves nothing is not yet a good one: several effects at once,
none of which every vehicle has, are less likely than one that the catalogue lacks; and so are large offsets
that cancel, of which only the curve of one (a weight along a pitched hull, c_w0 (cos theta - 1)) remains.
What the hull does late or twice passes for a short sea, too, if for one that is hardly likelier than others.
So do forces of no sea: what moves the water around a hull turns it as well as it pushes it.
And a hull that no water makes explains no part of what leaves something beside it.
"""

from math import hypot, inf, pi, sqrt
from typing import Literal

import numpy as np

from host.catalogue import BY_NAME, FAINT, ORDINARY
from host.catalogue.gravity import GRAVITY
from host.catalogue.kin import OFFSETS
from host.catalogue.nuisance import SPEED_CORRECTION
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.leftover import SEA_DOUBT, Leftover
from host.diagnosis.proof.minute import minute_in
from host.diagnosis.proof.scoring import Misfit
from host.diagnosis.search.unknown_physics import known_in, unknown_in
from host.dynamics.equations import NAMES, PARAMETERS
from host.identification.uncertainty import safe_inverse
from host.likelihood.valleys import UNDAMPED
from host.recordings.recording import Array

Verdict = Literal["no_mismatch", "explained", "partly_explained", "unexplained"]
WORSE = 2.0  # chi2 of held-out spans from which on an explanation must at least better the base there
MORE_THAN_NOISE = 1.1  # times it, as it would be said with one digit
MOST_RARE = 2  # effects at once that not every vehicle has
FAINT_WAVES = 30.0  # of BIC over all else: what a late hull imitates reaches about half of that
BY_SEA = " Random forces act as well (waves, current, turbulence); they are part of the noise model."
BY_SPEED = (
    " The errors of the measured speed lead a free run away from the recording, as small random forces "
    "would, most of all that of a hull which is unstable by itself; as such they are part of the noise model."
)
BY_PLANE = (
    " What the plane did between the rows, where it moved more often than it was recorded, leads a free run "
    "away from the recording, as random forces would; as such it is part of the noise model."
)
DRIFT = (
    ("pitch is off by {:.2g} deg", 180.0 / pi),
    ("depth is off by {:.2g} cm", 100.0),
    ("the water rises and sinks by {:.2g} cm/s", 100.0),
)
CORRECTED = " The model corrects the measured speed, which errs, by the surge equation (speed_correction)."
CANCELLED = 0.95  # of an offset by another: by chance both channels do so once in a thousand
NEARLY_CANCELLED = 0.85  # the same of one channel: by chance one in thirty
NO_COUPLING = 2.0  # times the forward speed: masses allow for less than one (host.diagnosis.fits.charges)
NO_MUNK = 6.0  # times what all of heave's damping would do at the plane
LEAST_LEVER = 1.0  # 1/m, of the plane's moment over its force: less is a plane amidships
LARGEST_SHARE = 4.0  # of what geometry gives, that bounds allow
CERTAIN = 3.0  # deviations of a Munk moment
HARDLY_TURNED = 0.01  # of the density of the moment that moving water has beside its force
STEEPEST, NO_SEA = 0.44, 2.0  # slope of a breaking wave; times that, so that no estimate is off so far
NEARLY = 1.0 - 1e-6  # of a bound: at it
DAMPINGS = {"a1": "heave_damping", "a2": "pitch_damping"}
SLIGHT_DAMPING = 0.02  # 1/s: an estimate as sure as that tells none from that of a slow hull
KNOWN = 1.0 / 3.0  # of it, is what a deviation may be there, if to end at a bound is to tell anything


def verdict_on(
    best: Explanation,
    left: Leftover,
    before: Misfit,
    after: Misfit,
    waves: float = inf,
    foretells: bool = True,
    is_slight: bool = False,
    late: Names = frozenset(),
) -> Verdict:
    """Of an explanation, by what it leaves and how far it betters the base on held-out spans.

    waves      by how much of BIC those it was found among, if any, are likelier than no waves
    foretells  whether it foretells the next seconds there better than the base, if no free run can tell
    is_slight  what it leaves is a trace (host.diagnosis.proof.slight)
    late       what is no more than rows resolve (host.diagnosis.proof.minute)
    """
    if left.is_nothing and not best.names:
        return "no_mismatch"
    # Random forces spoil a free run whatever is known: it need not be better for knowing more.
    worst = max(before.chi2 * (SEA_DOUBT if best.fit.has_process_noise else 1.0), WORSE)
    if left.is_nothing and after.chi2 < WORSE and best.names == minute_in(best) | late:
        return "no_mismatch"
    if is_slight or (left.is_nothing and after.chi2 < worst and not unknown_in(best)):
        return "explained" if foretells and not _doubt(best, left, waves) else "partly_explained"
    # Among waves no free run is much better either: they are named by what they are worth.
    is_better = bool(known_in(best)) and (after.chi2 < 0.7 * before.chi2 or FAINT_WAVES < waves < inf)
    return "partly_explained" if is_better and not beyond_geometry_in(best) else "unexplained"


def rare_in(explanation: Explanation) -> list[str]:
    """The effects of a set that not every vehicle has, and that are no offset or detail of another effect."""
    usual = {*ORDINARY, *FAINT, *OFFSETS}
    rare = [BY_NAME[name] for name in known_in(explanation) if name not in usual]
    return [effect.name for effect in rare if not effect.is_common and not effect.changes]


def cancelling_in(explanation: Explanation) -> list[str]:
    """A zero error of the plane, a weight and a moment, where the first all but undoes the others.

    Or a zero error of pitch that a current all but undoes in how the vehicle rises, and a moment or the
    plane's zero error in what rights it. Or a weight and a current that all but undoes it, or nearly so
    beside a drag: together they are a drag to one side only.
    """
    fit = explanation.fit
    p = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    if explanation.names.issuperset(["net_buoyancy", "vertical_current"]):
        drag = [name for name in ("heave_quadratic_drag",) if name in explanation.names]
        larger, smaller = sorted((p["c_w0"], -p["a1"] * p["current"]), key=abs, reverse=True)
        if _cancel(larger, smaller, NEARLY_CANCELLED if drag else CANCELLED):
            return [*drag, "net_buoyancy", "vertical_current"]
    offsets = ["net_buoyancy", "rudder_offset", "trim_moment"]
    if explanation.names.issuperset(offsets):
        force, moment = p["b1"] * p["rudder_zero"], p["b2"] * p["rudder_zero"]
        if _cancel(p["c_w0"], force) and _cancel(p["c_q0"], moment):
            return offsets
    moments = {"rudder_offset": p["b2"] * p.get("rudder_zero", 0.0), "trim_moment": p.get("c_q0", 0.0)}
    turning = [name for name in moments if name in explanation.names]
    if turning and explanation.names.issuperset(["pitch_bias", "vertical_current"]):
        climb, righting = p["u0"] * p["pitch_zero"], -p["a3"] * p["pitch_zero"]
        turned = sum(moments.values())
        if _cancel(climb, p["current"], NEARLY_CANCELLED) and _cancel(righting, turned, NEARLY_CANCELLED):
            return ["pitch_bias", "vertical_current", *turning]
    return []


def _cancel(one: float, other: float, share: float = CANCELLED) -> bool:
    return abs(one + other) < (1.0 - share) * abs(one)


def beyond_bounds_in(explanation: Explanation) -> list[str]:
    """The effects with a size at the largest value its bounds allow, and known there; and the forward speed.

    It would be larger still if it could: what no vehicle has does the work of something else. Not asked of
    a share: the whole is natural, and in more than that another detail of the same geometry shows.
    """
    fit = explanation.fit
    names = fit.structure.names
    std = np.sqrt(np.diag(safe_inverse(fit.information)))  # a lean fit does not know how coloured it is
    effects = map(BY_NAME.__getitem__, known_in(explanation))
    sizes = [(effect.name, p) for effect in effects for p in effect.parameters if p.name in effect.size_names]
    sizes.append(("forward_speed", PARAMETERS[NAMES.index("u0")]))
    found: list[str] = []
    for owner, parameter in sizes:
        is_share = parameter.unit == "1" and parameter.lower >= 0.0 and parameter.upper <= LARGEST_SHARE
        if parameter.name not in names or is_share:
            continue
        k, largest = names.index(parameter.name), max(abs(parameter.lower), abs(parameter.upper))
        if fit.free[k] and abs(fit.parameters[k]) > NEARLY * largest and std[k] < KNOWN * largest:
            found.append(owner)
    return sorted({*found})


def undamped_in(explanation: Explanation) -> list[str]:
    """The dampings of a hull that end at none, where they are known: something else does their work."""
    fit = explanation.fit
    std = np.sqrt(np.diag(safe_inverse(fit.information)))
    found = []
    for name, damping in DAMPINGS.items():
        k = NAMES.index(name)
        if fit.free[k] and fit.parameters[k] > UNDAMPED and std[k] < SLIGHT_DAMPING:
            found.append(damping)
    return found


def beyond_geometry_in(explanation: Explanation) -> list[str]:
    """A coupling of pitch rate into heave, or a Munk moment, beyond what any hull makes of its water.

    c_wq / u0 is a ratio of masses. At the plane's lever all of heave's damping would turn the hull by
    |c_qw| = |a1 b2 / b1|; published hulls have 0.1 to 0.9 of that, drawn ones up to 1.7.
    """
    fit = explanation.fit
    p = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    lever = max(abs(p["b2"]) / max(abs(p["b1"]), 1e-9), LEAST_LEVER)
    sizes = {
        "heave_pitch_rate_coupling": abs(p.get("c_wq", 0.0)) / (NO_COUPLING * max(p["u0"], 1e-3)),
        "munk_moment": abs(p.get("c_qw", 0.0)) / (NO_MUNK * abs(p["a1"]) * lever),
    }
    return [name for name, size in sizes.items() if name in explanation.names and size > 1.0]


def breaking_in(explanation: Explanation) -> list[str]:
    """Waves so steep that they would have broken: their water is faster at the surface than 0.44 g / omega.

    A swing as small as a sensor's noise, far down, would be that of a sea that nobody sails.
    """
    if "surface_waves" not in explanation.names:
        return []
    fit = explanation.fit
    p = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    if "wave_period" not in p:  # many waves, of which no amplitude is estimated
        return []
    most = STEEPEST * GRAVITY * p["wave_period"] / (2.0 * pi)
    return ["surface_waves"] if hypot(p["wave_sine"], p["wave_cosine"]) > NO_SEA * most else []


def is_pushed_but_not_turned(explanation: Explanation) -> bool:
    """Whether the random forces are no moving water's: they shake heave alone, of a hull with a Munk moment.

    Water that moves by v pushes it by -a1 v and turns it by -c_qw v, so that the densities of force and
    moment are as a1^2 to c_qw^2. Not asked of waves, whose swing tells what they are.
    """
    fit = explanation.fit
    names = fit.structure.names
    if not fit.has_process_noise or fit.waves.any() or "c_qw" not in names:
        return False
    k = names.index("c_qw")
    std = float(np.sqrt(np.diag(safe_inverse(fit.information))[k]))
    munk, a1 = float(fit.parameters[k]), float(fit.parameters[names.index("a1")])
    force, moment = fit.noise[2:4].tolist()
    return abs(munk) > CERTAIN * std and moment < HARDLY_TURNED * force * (munk / a1) ** 2


def _doubt(explanation: Explanation, left: Leftover, waves: float) -> str:
    """Why a set that leaves nothing may yet be none that acts; empty where nothing speaks against it."""
    if waves < FAINT_WAVES:
        return "waves are hardly likelier than physics that the catalogue does not hold."
    if not left.is_of_what_drives and is_pushed_but_not_turned(explanation):
        return (
            "the random forces push the hull and do not turn it, as moving water would with that Munk "
            "moment: they may stand for physics that the catalogue does not hold."
        )
    rare = rare_in(explanation)
    reasons = (
        (rare if len(rare) > MOST_RARE else [], "seldom act at once: together"),
        (cancelling_in(explanation), "cancel: together"),
        (beyond_bounds_in(explanation), "would have to be larger than on any vehicle:"),
        (undamped_in(explanation), "would have to be next to nothing, as it is on no hull:"),
        (beyond_geometry_in(explanation), "would have to be larger than on any hull:"),
        (breaking_in(explanation), "would have broken:"),
    )
    for names, why in reasons:
        if names:
            listed = ", ".join(name.replace("_", " ") for name in names)
            return f"{listed} {why} they may imitate physics that the catalogue does not hold."
    return ""


def remaining(verdict: Verdict, best: Explanation, left: Leftover, after: Misfit, waves: float = inf) -> str:
    """What the explanation leaves, in words, and what the model does about the sensors."""
    corrected = CORRECTED * (SPEED_CORRECTION.name in best.names)
    trace = _trace(best, left) * (verdict == "explained")
    return _remaining(verdict, best, left, after, waves) + trace + corrected


def _trace(best: Explanation, left: Leftover) -> str:
    """What an explanation tells of, though it does not hang on it."""
    if told := unknown_in(best):
        return f" A trace is left of physics that the catalogue does not hold. {' '.join(told)}"
    return (
        "" if left.is_nothing else " A trace is left of physics that is not known here, too little to name."
    )


def _remaining(verdict: Verdict, best: Explanation, left: Leftover, after: Misfit, waves: float) -> str:
    forces = BY_PLANE if left.is_by_plane else BY_SPEED if left.is_by_speed else BY_SEA
    sea = forces * best.fit.has_process_noise + _drift(best.fit.wander)
    if verdict == "no_mismatch":
        return "Nothing is missing from the base model on this recording." + sea
    forms = "".join(f" {sentence}" for sentence in unknown_in(best))
    worst = "depth" if after.chi2_depth > after.chi2_pitch else "pitch"
    size = max(after.chi2_depth, after.chi2_pitch) ** 0.5
    if verdict == "explained" and sea:
        is_astray = best.fit.has_process_noise and not left.is_of_what_drives and after.chi2 > WORSE
        astray = (
            f" They lead a free run over what was held out astray, {worst} by {size:.1f} times its noise."
        )
        return (sea + astray * is_astray).strip()
    if verdict == "explained" and after.chi2 > WORSE:
        return (
            "Where it was learnt, what is left is as small as the sensors' own noise; on stretches that were "
            f"held out {worst} is off by {size:.1f} times it: a coefficient is not known well enough yet."
        )
    if verdict == "explained":
        return "What is left is as small as the sensors' own noise."
    if forms and left.is_nothing:
        return f"Physics is at work that the catalogue does not hold.{forms}" + sea
    # Among random forces a free run is astray whatever is known, so that tells nothing.
    is_near = after.chi2 < WORSE or waves < inf or best.fit.has_process_noise
    if left.is_nothing and is_near and (doubt := _doubt(best, left, waves)):
        return f"Nothing else is left, but {doubt}" + sea
    if left.is_smooth:
        kind = "it depends on the motion, so it is physics and no sea, but none that is known here"
    elif left.is_nothing:
        kind = "what was learnt does not hold on the stretches that were held out"
    elif left.is_no_sea:
        kind = (
            "it acts like noise, but too weakly for a sea: physics left out that comes and goes "
            "(turns, say: --leave-out START-END)"
        )
    elif left.is_coloured:
        kind = "it does not follow the motion: a disturbance with a rhythm or a drift of its own"
    else:
        kind = "it is as rough as sensor noise, but larger than these sensors show elsewhere"
    is_part = verdict == "partly_explained"
    begin = "Most is explained, but" if is_part else "None of the physics in the catalogue explains this:"
    run = "a few seconds ahead" if left.is_of_what_drives or left.is_no_sea else "in a free run"
    off = (
        f"{size:.1f} times its sensor noise"
        if size >= MORE_THAN_NOISE
        else "hardly more than its sensor noise"
    )
    if forms:
        begin = f"Physics is at work that the catalogue does not hold.{forms} Beside it"
    return f"{begin} {worst} is still off by {off} {run}; {kind}." + sea


def _drift(wander: Array) -> str:
    """What drifts, in words."""
    told = [
        words.format(sqrt(variance) * scale) + f" for {time:.2g} s"
        for (words, scale), (variance, time) in zip(DRIFT, wander.tolist(), strict=True)
        if variance > 0.0
    ]
    if not told:
        return ""
    return f" Beside the sensors' white noise {' and '.join(told)} or so at a time: part of the noise model."
