"""From the commanded to the acting plane angle."""

import casadi as ca

from host.catalogue.switching import after, limited
from host.dynamics.equations import Chain, Effect, Parameter

SLIGHT = 1e-12  # share of a sub-step, so that no part of it is empty
LEAST_MOVED = 1e-9  # rad, of a servo that moves
AT_REST = 1e-4  # rad: a plane that moves less in a sub-step counts as standing at its mean
NEVER = 1e-9  # of lift that does not fall: so far off it would keep a share


def _offset(c: Chain) -> None:
    c.plane = c.plane + c.p["rudder_zero"]


def _delay(c: Chain) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Commands come no closer than sub-steps are long: at most one gives way to the next in each."""
    commands = [c.command, *c.earlier]
    if "plane_before" in c.p:
        ages = [c.elapsed + (lag - 0.5) * c.interval for lag in range(len(commands))]
        commands = [
            ca.if_else(c.time < age, c.p["plane_before"], command)
            for age, command in zip(ages, commands, strict=True)
        ]
    first = latest = commands[-1]
    share = ca.SX(0)
    for lag in reversed(range(len(commands) - 1)):
        begins = (c.p["delay"] - lag * c.interval - c.elapsed) / c.substep
        has_come = begins < 1
        first = ca.if_else(has_come, commands[lag + 1], first)
        latest = ca.if_else(has_come, commands[lag], latest)
        share = ca.if_else(has_come, begins, share)
    return first, latest, ca.fmax(SLIGHT, ca.fmin(1 - SLIGHT, share))


def _saturation(c: Chain) -> None:
    c.command = limited(c.command, c.p["plane_limit"])


def _rate_limit(c: Chain, held: ca.SX, substep: ca.SX) -> tuple[ca.SX, ca.SX]:
    if "lag_time" in c.p:
        return c.plane, c.plane  # a servo has one rate, and its lag limits it already
    farthest = c.p["plane_rate"] * substep
    moved = limited(c.plane - held, farthest)
    share = ca.fmin(1, ca.fabs(c.plane - held) / farthest)  # of the sub-step that the plane is under way
    c.change = moved * share * (3 - 2 * share)
    return held + moved - moved * share / 2, held + moved


def _lag(c: Chain, held: ca.SX, substep: ca.SX) -> tuple[ca.SX, ca.SX]:
    """The mean over the sub-step, and the end: at the largest rate first where that is limited."""
    if "plane_rate" in c.p:
        return _hurried_lag(c, held, substep)
    time, away = c.p["lag_time"], held - c.plane
    left = ca.exp(-substep / time)
    end = c.plane + away * left
    moment = time**2 * (1 - left) - substep * time * (1 + left) / 2
    c.change = 12 * away * moment / substep**2
    return c.plane - time * (end - held) / substep, end


def _hurried_lag(c: Chain, held: ca.SX, substep: ca.SX) -> tuple[ca.SX, ca.SX]:
    time, rate, away = c.p["lag_time"], c.p["plane_rate"], c.plane - held
    hurried = ca.fmax(0, ca.fmin(substep, ca.fabs(away) / rate - time))
    moved = ca.sign(away) * rate * hurried
    left = ca.exp((hurried - substep) / time)
    behind = (away - moved) * time * (1 - left) - moved * hurried / 2 + away * hurried
    end = c.plane - (away - moved) * left
    c.change = end - held
    return c.plane - behind / substep, end


def _backlash(c: Chain, held: ca.SX, substep: ca.SX) -> tuple[ca.SX, ca.SX]:  # noqa: ARG001
    """Stays behind until the servo has crossed the play; goes along for the last share of a sub-step."""
    half = c.p["backlash"] / 2
    if c.path is None:
        c.change = ca.SX(0)
        moved = _kept_within(held, c.plane, half)
        return moved, moved
    begin, end = c.path
    first = _kept_within(held, begin, half)
    last = _kept_within(first, end, half)
    share = ca.fmin(1, ca.fabs(last - first) / ca.fmax(ca.fabs(end - begin), LEAST_MOVED))
    bent = c.plane - (begin + end) / 2  # the mean of a servo that does not move evenly
    c.change = (last - first) * share * (3 - 2 * share) + (c.change - (end - begin)) * share**2
    return first + (last - first) * share / 2 + bent * share**2, last


def _kept_within(plane: ca.SX, servo: ca.SX, half: ca.SX) -> ca.SX:
    return ca.fmax(servo - half, ca.fmin(servo + half, plane))


def _stall(c: Chain) -> None:
    """By its mean over the sub-step: the plane may pass the angle at which lift breaks within it."""
    begin, end = c.plane - c.change / 2, c.plane + c.change / 2
    is_moved = ca.fabs(c.change) > AT_REST
    mean = (_stalled_area(c.p, end) - _stalled_area(c.p, begin)) / ca.if_else(is_moved, c.change, 1)
    c.plane = ca.if_else(is_moved, mean, _stalled(c.p, c.plane))
    c.change = _stalled(c.p, end) - _stalled(c.p, begin)


def _stalled(p: dict[str, ca.SX], plane: ca.SX) -> ca.SX:
    """The angle at which the plane acts: as it stands, falling from the stall on, and never below a share."""
    size, angle = ca.fabs(plane), p["stall_angle"]
    falling = size - p["stall_loss"] * (size - angle)
    return ca.sign(plane) * ca.if_else(size < angle, size, ca.fmax(falling, p["stall_share"] * angle))


def _stalled_area(p: dict[str, ca.SX], plane: ca.SX) -> ca.SX:
    """The integral of that from 0."""
    size, angle, loss = ca.fabs(plane), p["stall_angle"], p["stall_loss"]
    last = angle * (1 + (1 - p["stall_share"]) / ca.fmax(loss - 1, NEVER))  # from here on a share is kept
    attached, beyond = ca.fmin(size, angle), ca.fmin(ca.fmax(size - angle, 0), last - angle)
    kept = p["stall_share"] * angle * ca.fmax(size - last, 0)
    return attached**2 / 2 + angle * beyond + (1 - loss) * beyond**2 / 2 + kept


def _effectiveness(c: Chain) -> None:
    share = 1 + c.p["effectiveness_step"] * after(c, c.p["effectiveness_time"])
    c.plane, c.change = c.plane * share, c.change * share


def _at_start(c: Chain) -> ca.SX:
    """Settled at the command; where the recording begins, at that before if it is known."""
    return ca.if_else(c.time > 0, c.command, c.p.get("plane_before", c.command))


EFFECTS = (
    Effect(
        name="rudder_offset",
        slot="actuator",
        parameters=(Parameter(name="rudder_zero", unit="rad", lower=-0.5, upper=0.5, meaning="zero error"),),
        sentence="The plane's zero is off: the commanded angle and the acting one differ by a constant.",
        equation="delta = servo + rudder_zero",
        manoeuvre="level flight with the planes at zero at two speeds",
        probes=((0.0,),),
        plane=_offset,
    ),
    Effect(
        name="actuator_delay",
        slot="actuator",
        parameters=(Parameter(name="delay", unit="s", lower=0, upper=1, meaning="dead time"),),
        sentence="The plane answers only after a dead time.",
        equation="delta(t) = command(t - delay)",
        manoeuvre="plane steps at a higher sampling rate",
        probes=((0.04,), (0.13,), (0.28,), (0.56,)),
        late=_delay,
        lags=True,
    ),
    Effect(
        name="actuator_saturation",
        slot="actuator",
        parameters=(Parameter(name="plane_limit", unit="rad", lower=0.005, upper=2, meaning="end stop"),),
        sentence="The plane meets its stops before the commanded angle.",
        equation="delta = command, at most plane_limit either way",
        manoeuvre="plane steps of increasing size up to the largest command",
        probes=((0.97,), (0.85,), (0.7,), (0.45,), (0.27,), (0.14,)),
        scales=("rudder",),
        sizes=(),
        command=_saturation,
    ),
    Effect(
        name="actuator_rate_limit",
        slot="actuator",
        parameters=(
            Parameter(name="plane_rate", unit="rad/s", lower=0.005, upper=100, meaning="largest rate"),
        ),
        sentence="The plane turns no faster than a fixed rate.",
        equation="|delta'| <= plane_rate, that of a lag included",
        manoeuvre="plane steps of different sizes: the time they take grows with the size",
        # Beside a lag it shows only just below the fastest that the lag asks for: no step may be too wide.
        probes=((0.3,), (0.55,), (1.0,), (1.75,), (3.0,), (6.0,), (15.0,)),
        scales=("rudder",),
        sizes=(),
        actuator=_rate_limit,
        state="rate_limited",
        initial=_at_start,
    ),
    Effect(
        name="actuator_lag",
        slot="actuator",
        parameters=(Parameter(name="lag_time", unit="s", lower=0.001, upper=10, meaning="time constant"),),
        sentence="The plane follows its command with a first-order lag.",
        equation="delta' = (command - delta)/lag_time",
        manoeuvre="plane steps of different sizes at a sampling interval below the lag",
        probes=((0.1,), (0.4,), (1.2,)),
        actuator=_lag,
        state="lagged",
        initial=_at_start,
        is_common=True,
    ),
    Effect(
        name="actuator_backlash",
        slot="actuator",
        parameters=(Parameter(name="backlash", unit="rad", lower=0, upper=0.6, meaning="play"),),
        sentence="There is play between the servo and the plane: it stays behind at every reversal.",
        equation="delta moves only when the command leaves a band of width backlash",
        manoeuvre="small plane reversals about several mean angles",
        probes=((0.01,), (0.05,), (0.2,), (0.4,)),
        scales=("rudder",),
        actuator=_backlash,
        state="slack",
        initial=_at_start,
    ),
    Effect(
        name="rudder_stall",
        slot="actuator",
        parameters=(
            Parameter(name="stall_angle", unit="rad", lower=0.005, upper=1.5, meaning="where lift breaks"),
            Parameter(name="stall_loss", unit="1", lower=0.5, upper=3, meaning="1: flat, more: falling lift"),
            Parameter(name="stall_share", unit="1", lower=0, upper=1, meaning="of the greatest lift, kept"),
        ),
        sentence="Beyond an angle the plane stalls: its lift no longer grows.",
        equation="beyond: |acting angle| = max(|delta| - stall_loss (|delta| - stall_angle), "
        "stall_share stall_angle)",
        manoeuvre="plane steps of increasing size beyond the stall angle",
        probes=((0.2, 1.2, 0.6), (0.45, 1.3, 0.6), (0.75, 1.6, 0.6)),
        scales=("rudder", "", ""),
        sizes=(),
        plane=_stall,
    ),
    Effect(
        name="rudder_effectiveness_change",
        slot="actuator",
        parameters=(
            Parameter(name="effectiveness_step", unit="1", lower=-1, upper=5, meaning="share lost or gained"),
            Parameter(name="effectiveness_time", unit="s", lower=0, upper=1e6, meaning="when it happened"),
        ),
        sentence="The plane's effect changed at one moment: a fin was damaged, fouled or lost.",
        equation="acting angle = delta (1 + effectiveness_step (t > effectiveness_time))",
        manoeuvre="the same plane steps before and after",
        probes=((0.0, 0.5),),
        scales=("", "duration"),
        plane=_effectiveness,
    ),
)
