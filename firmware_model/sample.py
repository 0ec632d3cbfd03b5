"""One instant of the vehicle's vertical plane on the fixed time grid."""

from dataclasses import dataclass
from math import nan


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """Depth, pitch and stern plane at one grid instant. NaN means "not measured".

    t_us        grid instant on the vehicle's clock, microseconds
    depth       m, positive down
    pitch       rad, positive nose up
    rudder      rad, stern plane; positive pitches the nose down
    speed       m/s through the water, along the body axis (optional)
    pitch_rate  rad/s (optional)
    """

    t_us: int
    depth: float = nan
    pitch: float = nan
    rudder: float = nan
    speed: float = nan
    pitch_rate: float = nan
