"""The steps of a plane that nobody saw, and what it did with each at a given moment."""

import numpy as np
from numpy.typing import NDArray

from host.recordings.plane_between_rows import between_readings
from host.recordings.plane_readings import PlaneReadings
from host.recordings.recording import Array, Recording

NOTE = "the plane was not read in every row: when it stepped between its readings is estimated"
MOST_STEPS = 400  # whose moments are estimated: the largest
MOST_VALUES = 3_000_000  # of what each does to each row: of an hour at 10 Hz fewer steps


class UnseenSteps:
    """The largest steps between readings in the recordings of one vehicle, J of them.

    steps     the recording of each, and its place among the steps of that
    mean, variance  of their moments (J,), before anything is known of them
    rows      at how many instants each may have been; nan where at any
    are_doubtful  whether the plane may have been told to step where it was read
    """

    def __init__(self, recordings: list[Recording]) -> None:
        self.recordings = recordings
        sizes = {
            (i, k): size
            for i, one in enumerate(recordings)
            if one.plane is not None
            for k, size in enumerate(np.abs(np.diff(one.plane.angle))[one.plane.steps].tolist())
            if _inside(one.plane, one)[k]
        }
        most = min(MOST_STEPS, MOST_VALUES // sum(one.time.size for one in recordings))
        self.steps = sorted(sorted(sizes, key=lambda step: -sizes[step])[:most])
        self.are_doubtful = any(self._plane(i).is_doubtful for i, _ in self.steps)
        self.mean = np.array([self._plane(i).mean_moments[k] for i, k in self.steps])
        self.variance = np.array([self._plane(i).moment_variances[k] for i, k in self.steps])

        gaps = np.array([np.diff(self._plane(i).time)[self._plane(i).steps][k] for i, k in self.steps])
        paces = np.array([self._plane(i).pace for i, _ in self.steps])
        self.rows = np.rint(gaps / np.where(paces > 0.0, paces, np.nan))

    def on_rows(self, moments: Array) -> Array | None:
        """The nearest of moments (J,) at which there are rows; None where a step may be at any."""
        if not np.isfinite(self.rows).all():
            return None
        return np.asarray(np.clip(np.rint(moments * self.rows), 1.0, self.rows) / self.rows)

    def off(self, moments: Array) -> float:
        """-2 log of the prior of these moments (J,), but for a constant."""
        return float(np.sum((moments - self.mean) ** 2 / self.variance))

    def moved(self, moments: Array) -> list[Recording]:
        """The recordings with the plane stepping at these moments (J,)."""
        return [
            one
            if one.plane is None
            else between_readings(one, one.plane, self._all(i, moments), one.plane.pace > 0.0, NOTE)
            for i, one in enumerate(self.recordings)
        ]

    def angles(self, recording: int, run: Recording, moments: Array) -> Array:
        """The plane's mean angles in the rows of a run of a recording, rad, at these moments (J,)."""
        plane, ends = self._plane(recording), run.time + run.intervals
        return plane.means(run.time, ends, self._all(recording, moments), plane.pace > 0.0)

    def within(self, recording: int, run: Recording) -> list[int]:
        """Which of the J steps fall into a run of a recording."""
        if self.recordings[recording].plane is None:
            return []
        inside = _inside(self._plane(recording), run)
        return [j for j, (i, k) in enumerate(self.steps) if i == recording and inside[k]]

    def _all(self, recording: int, moments: Array) -> Array:
        whole = self._plane(recording).mean_moments
        for (i, k), moment in zip(self.steps, moments.tolist(), strict=True):
            if i == recording:
                whole[k] = moment
        return whole

    def _plane(self, recording: int) -> PlaneReadings:
        plane = self.recordings[recording].plane
        assert plane is not None
        return plane


def _inside(plane: PlaneReadings, run: Recording) -> NDArray[np.bool_]:
    """Which of a plane's steps fall into a run."""
    begins, ends = plane.time[plane.steps], plane.time[plane.steps + 1]
    return np.asarray((begins < run.time[-1]) & (ends > run.time[0]))
