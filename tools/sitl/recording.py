"""A whole run at once, as fast as the machine goes: what was measured and what was true."""

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import Self

import numpy as np
import numpy.typing as npt

from tools.sitl.effects import Effects
from tools.sitl.plant import Plant, stream
from tools.sitl.scenario import Scenario
from tools.sitl.sensors import Instrument
from tools.sitl.strict import require

Table = dict[str, npt.NDArray[np.float64]]

COLUMNS = {
    "depth": "depth_m",
    "pitch": "pitch_rad",
    "rudder": "rudder_rad",
    "speed": "speed_mps",
    "pitch_rate": "pitch_rate_radps",
}
"""Channel to column of the project's text format."""

TRUTH_COLUMNS = {
    "t_s": "time_s",
    "depth": "depth_m",
    "pitch": "pitch_rad",
    "pitch_rate": "pitch_rate_radps",
    "heave": "heave_mps",
    "speed": "speed_mps",
    "command": "rudder_rad",
    "plane": "plane_rad",
    "water": "water_mps",
    "sensed_depth": "sensed_depth_m",
    "sensed_pitch": "sensed_pitch_rad",
}


def source_of(channel: str, rudder_is_measured: bool) -> str:
    """The field of `Instant` that a channel measures."""
    if channel == "rudder":
        return "plane" if rudder_is_measured else "command"
    return {"depth": "sensed_depth", "pitch": "sensed_pitch"}.get(channel, channel)


def sail(scenario: Scenario, seed: int) -> Table:
    """The truth at every integration step, by the columns of `TRUTH_COLUMNS`."""
    require(scenario.duration_s > 0.0, "duration_s", "be > 0 s without a link", scenario.duration_s)
    plant = Plant(scenario, seed)
    rows = [plant.now, *(plant.step() for _ in range(round(scenario.duration_s / scenario.step_s)))]
    return dict(zip(TRUTH_COLUMNS.values(), np.array(rows).T, strict=True))


def measure(scenario: Scenario, seed: int, truth: Table) -> Table:
    """What the instruments make of it: a row for each time at which any channel has a sample, else NaN."""
    channels = {}
    for name, column in COLUMNS.items():
        channel = getattr(scenario.sensors, name)
        instrument = Instrument(channel, stream(seed, name))
        times = instrument.times(scenario.duration_s)
        field = source_of(name, scenario.sensors.rudder_is_measured)
        true_times, true_values = truth["time_s"], truth[TRUTH_COLUMNS[field]]
        if name == "rudder":  # held between changes, not joined by lines
            behind = np.searchsorted(true_times, times - channel.latency_s + 1e-9, side="right") - 1
            seen = true_values[np.maximum(behind, 0)]
        else:
            seen = np.interp(times - channel.latency_s, true_times, true_values)
        values = instrument.says(seen)
        arrived = instrument.arrives(times)
        channels[column] = (times[arrived], values[arrived])
    stamps = np.unique(np.round(np.concatenate([times for times, _ in channels.values()]), 6))
    table = {"time_s": stamps}
    for column, (times, values) in channels.items():
        table[column] = np.full(len(stamps), np.nan)
        table[column][np.searchsorted(stamps, np.round(times, 6))] = values
    return table


def record(scenario: Scenario, seed: int) -> Table:
    """Measured channels of a run by the columns of the text format; NaN where nothing was measured."""
    return measure(scenario, seed, sail(scenario, seed))


def write_csv(path: Path, table: Table) -> None:
    """Writes a table as text, an unmeasured value as an empty cell."""
    with TextTable(path, list(table)) as file:
        for row in np.column_stack(list(table.values())).tolist():
            file.write(row)


def write_truth(path: Path, scenario: Scenario, truth: Table) -> None:
    """Writes the truth at each update of the command, with the effects at work as a last column of text."""
    every = round(scenario.excitation.update_s / scenario.step_s)
    with TextTable(path, [*truth, "effects"]) as file:
        for row in np.column_stack(list(truth.values()))[::every].tolist():
            file.write(row, describe(scenario.effects, row[0]))


class TextTable:
    """A CSV file that grows row by row and keeps what it has when the process is killed."""

    def __init__(self, path: Path, columns: list[str]) -> None:
        self.file = path.open("w", newline="", encoding="utf-8", buffering=1)
        self.writer = csv.writer(self.file)
        self.writer.writerow(columns)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def write(self, row: Iterable[float], *words: str) -> None:
        """One row: numbers (NaN gives an empty cell), then words."""
        self.writer.writerow(["" if value != value else f"{value:.9g}" for value in row] + list(words))

    def close(self) -> None:
        """Closes the file; may be called twice."""
        self.file.close()


def describe(effects: Effects, t_s: float) -> str:
    """The effects at work at a time, as "name=size unit; name=size unit"."""
    return "; ".join(f"{name}={size:g} {unit}" for name, (size, unit) in effects.at_work(t_s).items())
