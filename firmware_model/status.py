"""What an update did. The numbers are part of the interface: saved states, frames and the C enum use them."""

from enum import IntEnum


class Status(IntEnum):
    """Result of one `update`. What is REFUSED changes nothing: the sample, where not said otherwise."""

    UPDATED = 0
    WAITING = 1  # sample kept, but it completes nothing that could be learnt from
    FROZEN = 2  # sample kept, learning switched off by the user
    NOT_EXCITED = 3  # sample kept, the signals carry no information
    CAPPED = 4  # updated without forgetting: the covariance had reached its cap
    REFUSED_NON_FINITE = 5
    REFUSED_STALE = 6  # time did not advance
    REFUSED_OFF_GRID = 7  # time is not a multiple of the step
    REFUSED_OUTLIER = 8  # the CAR rows refuse the sample, the noise-proof estimator the value that is far off
    FAULT_NUMERICAL = 9  # the step would have produced a non-finite state; the last good one is kept
    RESTARTED = 10  # updated; the vehicle's states began anew after a gap or a jump, the parameters are kept
    AT_BOUND = 11  # updated; a parameter was held at the bound of what a stable vehicle can be
