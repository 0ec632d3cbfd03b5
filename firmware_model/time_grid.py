"""The fixed time grid: which samples lie on it, and what was passed over."""

from firmware_model.status import Status

TOLERANCE = 0.1
"""Largest distance of a sample from the grid, in steps."""


class TimeGrid:
    """Begins at the first sample and goes on from each accepted one, so slow clocks do not drift off it.

    span  steps; after a longer gap the grid begins anew, at any phase
    """

    def __init__(self, step: float, span: int) -> None:
        self._step = step
        self._span = span
        self.missed = 0
        """Instants without a sample before the one checked last."""
        self.forget()

    def forget(self) -> None:
        """The next sample begins the grid anew."""
        self._t_us: int | None = None

    def check(self, t_us: int) -> Status | None:
        """REFUSED_STALE, REFUSED_OFF_GRID, or None for a sample that may be used."""
        self.missed = 0
        if self._t_us is None:
            return None
        if t_us <= self._t_us:
            return Status.REFUSED_STALE
        elapsed = (t_us - self._t_us) * 1e-6 / self._step
        instants = round(elapsed)
        if instants <= self._span and (abs(elapsed - instants) > TOLERANCE or instants == 0):
            return Status.REFUSED_OFF_GRID
        self.missed = instants - 1
        return None

    def accept(self, t_us: int) -> None:
        """Goes on from this sample."""
        self._t_us = t_us
