"""What an update did. The numbers are part of the interface: saved states, frames and the C enum use them."""

from enum import IntEnum


class Status(IntEnum):
    """Result of one `update`. Only UPDATED changes the estimate; a REFUSED sample changes nothing at all."""

    UPDATED = 0
    WAITING = 1  # sample kept, but the regression row is not complete yet
    FROZEN = 2  # sample kept, learning switched off by the user
    NOT_EXCITED = 3  # sample kept, the signals carry no information
    CAPPED = 4  # updated without forgetting: the covariance had reached its cap
    REFUSED_NON_FINITE = 5
    REFUSED_STALE = 6  # time did not advance
    REFUSED_OFF_GRID = 7  # time is not a multiple of the step
    REFUSED_OUTLIER = 8
    FAULT_NUMERICAL = 9  # the step would have produced a non-finite state; the last good one is kept
