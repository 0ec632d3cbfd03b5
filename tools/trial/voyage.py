"""Runs of the plant: with what is hidden, on its own program or on given commands."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tools.sitl.excitation import Commander, make_law
from tools.sitl.plant import Plant, stream
from tools.sitl.recording import TRUTH_COLUMNS, Table
from tools.sitl.scenario import Scenario
from tools.trial.hidden import Hidden, Setting, switched
from tools.trial.outside import ForcedBody

Array = npt.NDArray[np.float64]


class Replayed(Commander):
    """Gives back recorded commands, so that another vehicle can repeat the run without its autopilot."""

    def __init__(self, scenario: Scenario, commands: Array) -> None:
        law = make_law(replace(scenario.excitation, program="none"), 0.0, Path(), stream(0, ""))
        super().__init__(scenario.excitation, law)
        self.commands = commands

    def command(self, t_s: float, depth: float, pitch: float, pitch_rate: float) -> float:  # noqa: ARG002
        row = round(t_s / self.excitation.update_s)
        return float(self.commands[min(row, len(self.commands) - 1)])


@dataclass(frozen=True, slots=True, kw_only=True)
class Voyage:
    """A noise-free run at the instants that are recorded; `table` is that of every integration step."""

    table: Table
    command: Array  # rad
    speed: Array  # m/s
    pitch: Array  # rad, as a perfect instrument would read it
    depth: Array  # m, likewise


def sail(
    scenario: Scenario,
    seed: int,
    hidden: tuple[Hidden, ...],
    setting: Setting,
    commands: Array | None = None,
) -> Voyage:
    """One run. Raises ScenarioError when the motion runs away."""
    scenario = replace(scenario, effects=switched(hidden, setting))
    plant = Plant(scenario, seed)
    for effect in hidden:
        foreign = effect.foreign(setting)
        if foreign is not None:
            plant.body = ForcedBody(plant.body, foreign)
    if commands is not None:
        plant.commander = Replayed(scenario, commands)
    rows = [plant.now, *(plant.step() for _ in range(round(scenario.duration_s / scenario.step_s)))]
    table = dict(zip(TRUTH_COLUMNS.values(), np.array(rows).T, strict=True))
    every = round(scenario.excitation.update_s / scenario.step_s)
    return Voyage(
        table=table,
        command=table["rudder_rad"][::every],
        speed=table["speed_mps"][::every],
        pitch=table["sensed_pitch_rad"][::every],
        depth=table["sensed_depth_m"][::every],
    )
