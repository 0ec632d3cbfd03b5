"""One output of the vehicle with its rows, its estimator and its outlier gate."""

import math

from firmware_model.car import CarRow
from firmware_model.delta import DeltaCoordinates
from firmware_model.mils import Mils
from firmware_model.status import Status

SETTLING_ROWS_PER_PARAMETER = 10
"""Rows to learn, for each parameter, before innovations can tell an outlier."""


class Channel:
    """Takes the outputs one by one: `face` the new one; if it is accepted, `learn` it and `push` it.

    gate        an innovation above `gate` of its standard deviations is an outlier, inf for never
    limit       after so many outliers in a row the model is wrong: they are accepted until one fits
    resolution  of the output; innovations within the gate times this are no outliers, whatever the noise
    """

    def __init__(
        self,
        row: CarRow,
        mils: Mils,
        *,
        gate: float,
        limit: int,
        resolution: float,
        coordinates: DeltaCoordinates | None = None,
    ) -> None:
        self.row = row
        self.mils = mils
        self.coordinates = coordinates
        self.is_ready = False
        """Whether the output faced last completes a row."""
        self._gate = gate
        self._limit = limit
        self._resolution = resolution
        self._outliers = 0
        self._regressor = row.phi if coordinates is None else coordinates.row
        self._target = math.nan

    def face(self, output: float) -> bool:
        """Forms the row that the output completes, if any; True if the output is an outlier."""
        self.is_ready = self.row.is_complete and math.isfinite(output)
        if not self.is_ready:
            return False
        self._target = output
        if self.coordinates is not None:
            if not math.isfinite(self.coordinates.reference):
                self.coordinates.reference = output
            self.coordinates.transform(self.row.phi)
            self._target = output + self.row.phi[0]
        if self.mils.updates < SETTLING_ROWS_PER_PARAMETER * self.mils.n or self._gate == math.inf:
            return False
        innovation = abs(self._target - self.mils.predict(self._regressor))
        spread = max(self.mils.innovation_std(self._regressor), self._resolution)
        if innovation <= self._gate * spread:
            self._outliers = 0
            return False
        if self._outliers >= self._limit:
            return False
        self._outliers += 1
        return True

    def learn(self) -> Status:
        """One step with the row formed last; WAITING if there is none. Comes before `push`."""
        if not self.is_ready:
            return Status.WAITING
        status = self.mils.update(self._regressor, self._target)
        return Status.FAULT_NUMERICAL if status is Status.REFUSED_NON_FINITE else status

    def push(self, output: float, rudder: float) -> None:
        """Takes the values of one instant into the rows, NaN where there is none."""
        self.row.push(output, rudder)

    def forget_rows(self) -> None:
        """Starts the rows afresh, as after a gap longer than they are."""
        self.row.clear()
        self.is_ready = False
        self._outliers = 0
        if self.coordinates is not None:
            self.coordinates.reference = math.nan
