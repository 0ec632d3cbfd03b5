"""The methods that the missing-data study compares; a further one is one more line in METHODS.

Each takes a recording with NaN where nothing was measured and gives the parameters (8,) in the order of
host.dynamics.equations.NAMES. Raises ValueError or LinAlgError where the data do not suffice.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from firmware_model import Mils, physical_from_car
from firmware_model.config import EstimatorConfig
from firmware_model.estimator import make_estimator
from firmware_model.sample import Sample
from host.dynamics.equations import NAMES
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.recordings.recording import Array, Recording
from tools.paper.printed import PHYSICAL, printed
from tools.paper.regression import Rows, rows_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """A name for the legend, a colour, and the identification."""

    name: str
    colour: str
    identify: Callable[[Recording], Array]


def least_squares(recording: Recording) -> Array:
    """Batch least squares on every complete CAR row."""
    found = []
    for rows in _rows(recording):
        count, n = rows.phi.shape
        if count <= n:
            raise ValueError(f"{recording.name}: {count} complete rows, {n + 1} are needed")
        theta = np.linalg.lstsq(rows.phi, rows.y, rcond=None)[0].astype(np.float64)
        found.append((theta, np.linalg.pinv(rows.phi.T @ rows.phi).astype(np.float64)))
    return _physical(found)


@dataclass(frozen=True, slots=True)
class Recursive:
    """RLS (p = 1) or MILS on the last p complete rows, as in the paper, without forgetting."""

    p: int

    def __call__(self, recording: Recording) -> Array:
        found = []
        for rows in _rows(recording):
            mils = Mils(rows.phi.shape[1], self.p)
            for phi, y in zip(rows.phi.tolist(), rows.y.tolist(), strict=True):
                mils.update(phi, y)
            found.append((np.array(mils.theta), mils.covariance))
        return _physical(found)


def live(recording: Recording) -> Array:
    """The noise-proof estimator of `mils run`, sample by sample, told a speed 20 % too low."""
    speed = 0.8 * float(printed()["table1"]["u0"])
    estimator = make_estimator(EstimatorConfig(step=recording.step, speed=speed))
    for time, depth, pitch, rudder in zip(
        recording.time.tolist(),
        recording.depth.tolist(),
        recording.pitch.tolist(),
        recording.rudder.tolist(),
        strict=True,
    ):
        estimator.update(Sample(t_us=round(1e6 * time), depth=depth, pitch=pitch, rudder=rudder))
    values = estimator.estimate().values
    found = [values[name] for name in (*PHYSICAL, "u0")]
    if not np.isfinite(found).all():
        raise ValueError("too little was learnt")
    return np.array([*found, 0.0, 0.0])


def maximum_likelihood(recording: Recording) -> Array:
    """`mils identify`: the continuous-time equations, nothing assumed about the speed.

    Output error, for no unknown forces act in these data.
    """
    return fit_maximum_likelihood([recording], noise_model="output_error").parameters[: len(NAMES)]


METHODS = (
    Method(name="batch LS on CAR rows", colour="#8d99a6", identify=least_squares),
    Method(name="RLS", colour="#2c6e9b", identify=Recursive(1)),
    Method(name="MILS p = 5", colour="#d98324", identify=Recursive(5)),
    Method(name="live, noise-proof", colour="#8e44ad", identify=live),
    Method(name="maximum likelihood", colour="#2f855a", identify=maximum_likelihood),
)


def _rows(recording: Recording) -> tuple[Rows, Rows]:
    # Depth integrates, so any datum will do; from the first value the rows are well conditioned.
    depth = recording.depth - recording.depth[np.isfinite(recording.depth)][0]
    return rows_of("alpha", recording.pitch, recording.rudder), rows_of("beta", depth, recording.rudder)


def _physical(found: list[tuple[Array, Array]]) -> Array:
    """Difference-equation coefficients with covariances, pitch then depth, to the continuous-time "
    "parameters."""
    (alpha, _), (beta, covariance) = found
    sign = np.array([-1.0] * 4 + [1.0] * 3)
    t = printed()["table1"]
    physical = physical_from_car(
        (alpha * [-1.0, -1.0, 1.0]).tolist(),
        (beta * sign).tolist(),
        t["u0"],
        t["h"],
        (covariance * np.outer(sign, sign)).tolist(),
    )
    values = [getattr(physical, name) for name in PHYSICAL]
    if not np.isfinite(values).all():
        raise ValueError("the coefficients do not convert")
    return np.array([*values, t["u0"], 0.0, 0.0])
