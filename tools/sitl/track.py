"""The truth on demand, for instruments and messages that keep their own times."""

from collections import deque
from collections.abc import Callable

from tools.sitl.plant import Instant, Plant
from tools.sitl.recording import source_of
from tools.sitl.scenario import Scenario

_HELD = {"command", "plane"}


class Track:
    """Runs the plant as far as it is asked and remembers the last seconds."""

    def __init__(
        self, scenario: Scenario, seed: int, watch: Callable[[Instant], None] = lambda _: None
    ) -> None:
        sensors = scenario.sensors
        channels = (sensors.depth, sensors.pitch, sensors.rudder, sensors.speed, sensors.pitch_rate)
        memory_s = max(channel.latency_s + 1.0 / channel.rate_hz for channel in channels)
        self.plant = Plant(scenario, seed)
        self.step_s = scenario.step_s
        self.instants: deque[Instant] = deque([self.plant.now], maxlen=int(memory_s / scenario.step_s) + 3)
        self.rudder_is_measured = sensors.rudder_is_measured
        self.watch = watch
        watch(self.plant.now)

    @property
    def now(self) -> Instant:
        """The furthest instant so far."""
        return self.instants[-1]

    def advance(self, t_s: float) -> None:
        """Runs the plant to the first grid instant at or after `t_s`."""
        while self.now.t_s < t_s - 1e-9:
            self.instants.append(self.plant.step())
            self.watch(self.now)

    def value(self, channel: str, t_s: float) -> float:
        """What a perfect instrument on `channel` reads at `t_s`, which is not later than `now`."""
        field = source_of(channel, self.rudder_is_measured)
        place = (t_s - self.instants[0].t_s) / self.step_s
        before = min(max(int(place + 1e-6), 0), len(self.instants) - 1)
        value: float = getattr(self.instants[before], field)
        share = place - before
        if field in _HELD or share < 1e-6 or before + 1 == len(self.instants):
            return value
        after: float = getattr(self.instants[before + 1], field)
        return value + share * (after - value)
