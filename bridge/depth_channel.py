"""Depth from the one pressure or height source of a vehicle that is worth most."""

from collections import Counter
from math import isfinite

from bridge.mavlink_map import MavlinkMap

# Raw pressure first: heights come from a filter that may use the formula of air. Instance 1 last of the
# pressures: on most vehicles it is the barometer inside the hull.
PREFERENCE = (
    "SCALED_PRESSURE2",
    "SCALED_PRESSURE3",
    "SCALED_PRESSURE",
    "LOCAL_POSITION_NED",
    "VFR_HUD",
    "AHRS2",
)
_DECIDE_US = 3_000_000  # ArduSub sends pressure at 2 Hz
_PLAUSIBLE_HPA = (300.0, 1.2e6)  # a mountain lake to 12 km of water; a hijacked instance says 0
_HIGHEST_AIR_HPA = 1085.0  # record at sea level: more than this is under water
STANDARD_SURFACE_HPA = 1013.25
_STEP_M, _STEP_MPS = 0.5, 4.0  # a jump that no vehicle makes: the barometer was zeroed again, or a bad sample


class DepthChannel:
    """Chooses the source, drops repeats, refuses nonsense and flags steps.

    `surface_pressure_hpa` None: the first pressure is taken as the surface if the atmosphere can have it (an
    error of 0.7 m at most), else the standard one, because a program started under water must not call that
    place the surface. An offset of depth is without effect on the identified dynamics.
    """

    def __init__(self, mapping: MavlinkMap, counts: Counter[str], notes: list[str]) -> None:
        self._map = mapping
        self._counts = counts
        self._notes = notes
        self.source: str | None = None if mapping.depth_source == "auto" else mapping.depth_source
        self._heard: Counter[str] = Counter()
        self._heard_since: int | None = None
        self._surface_hpa = mapping.surface_pressure_hpa
        self._pressure: tuple[float, int] | None = None
        self._depth: tuple[float, int] | None = None
        self._boot = 0

    def from_pressure(self, source: str, hpa: float, t_us: int, boot: int) -> float | None:
        """Depth (m) from an absolute pressure, or None."""
        if not self._is_usable(hpa, *_PLAUSIBLE_HPA) or not self._is_chosen(source, t_us):
            return None
        if self._pressure is not None:
            last, since = self._pressure
            if hpa == last and 0 <= t_us - since < 1e6 * self._map.repeat_hold_s:
                self._counts["refused.repeat"] += 1
                return None
        self._pressure = hpa, t_us
        if self._surface_hpa is None:
            self._surface_hpa = self._surface_from(hpa)
        depth = 100.0 * (hpa - self._surface_hpa) / (self._map.water_density * self._map.gravity)
        return self._flag_step(depth, t_us, boot)

    def from_height(self, source: str, up_m: float, t_us: int, boot: int) -> float | None:
        """Depth (m) from a height above the vehicle's own zero, or None."""
        if not self._is_usable(up_m, -12e3, 9e3) or not self._is_chosen(source, t_us):
            return None
        return self._flag_step(-up_m, t_us, boot)

    def _is_usable(self, value: float, low: float, high: float) -> bool:
        if not isfinite(value):
            self._counts["refused.non_finite"] += 1
        elif not low <= value <= high:
            self._counts["refused.range"] += 1
        else:
            return True
        return False

    def _is_chosen(self, source: str, t_us: int) -> bool:
        if self.source is None:
            self._heard[source] += 1
            if self._heard_since is None:
                self._heard_since = t_us
            if t_us - self._heard_since < _DECIDE_US:
                self._counts["refused.depth_undecided"] += 1
                return False
            self.source = min(self._heard, key=PREFERENCE.index)
            others = sorted(set(self._heard) - {self.source})
            rest = f" (also heard: {', '.join(others)})" if others else ""
            self._notes.append(f"depth_source auto chose {self.source}{rest}")
            self._counts[f"note.depth_source.{self.source}"] += 1
        return source == self.source

    def _surface_from(self, hpa: float) -> float:
        if hpa <= _HIGHEST_AIR_HPA:
            self._notes.append(f"surface_pressure_hpa taken from the first sample: {hpa:.2f}")
            self._counts["note.surface_from_first_sample"] += 1
            return hpa
        self._notes.append(
            f"the first pressure, {hpa:.2f} hPa, is under water: "
            f"surface_pressure_hpa {STANDARD_SURFACE_HPA} used"
        )
        self._counts["note.surface_standard"] += 1
        return STANDARD_SURFACE_HPA

    def _flag_step(self, depth: float, t_us: int, boot: int) -> float:
        if self._depth is not None and boot == self._boot:
            last, since = self._depth
            if abs(depth - last) > _STEP_M + _STEP_MPS * max(0, t_us - since) * 1e-6:
                self._counts["note.depth_step"] += 1
        self._depth, self._boot = (depth, t_us), boot
        return depth
