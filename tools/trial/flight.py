"""What was flown, so that a simulator that lacks some of its physics can repeat it."""

from collections.abc import Collection
from dataclasses import dataclass

from tools.sitl.recording import Table
from tools.sitl.scenario import Scenario
from tools.trial.hidden import Hidden, Setting
from tools.trial.voyage import Array, sail


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """A drawn vehicle on its outing: all that acts on it, and what its plane was told, rad."""

    scenario: Scenario
    seed: int
    acting: tuple[Hidden, ...]
    setting: Setting
    commands: Array

    def simulated(self, lacking: Collection[str]) -> Table:
        """A simulator's output on the same commands: no noise, and without the effects of these names.

        Raises ScenarioError where the motion runs away without them.
        """
        acting = tuple(effect for effect in self.acting if effect.name not in lacking)
        voyage = sail(self.scenario, self.seed, acting, self.setting, self.commands)
        every = round(self.scenario.excitation.update_s / self.scenario.step_s)
        return {
            "time_s": voyage.table["time_s"][::every],
            "depth_m": voyage.depth,
            "pitch_rad": voyage.pitch,
            "rudder_rad": voyage.command,
        }
