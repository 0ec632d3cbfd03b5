"""Standard gravity."""

GRAVITY = 9.80665  # m/s^2
