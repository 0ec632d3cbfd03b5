"""What every estimator of the vertical plane promises, and the one that a configuration asks for."""

from collections.abc import Mapping
from typing import Any, Protocol

from firmware_model.config import EstimatorConfig
from firmware_model.estimate import Estimate
from firmware_model.robust import RobustEstimator
from firmware_model.sample import Sample
from firmware_model.status import Status
from firmware_model.vertical_plane import VerticalPlaneEstimator


class Estimator(Protocol):
    """Takes samples one by one; of fixed size, and never raising once it is constructed."""

    config: EstimatorConfig

    def update(self, sample: Sample) -> Status:
        """Takes one sample; what is refused changes nothing but a count."""

    def estimate(self) -> Estimate:
        """What is believed now."""

    @property
    def is_frozen(self) -> bool:
        """Whether learning is switched off."""

    def freeze(self) -> None:
        """Stops learning."""

    def enable(self) -> None:
        """Learns again after `freeze`."""

    def forget_rows(self) -> None:
        """Joins nothing across this moment: the vehicle rebooted and its clock may start anew."""

    def reset(self) -> None:
        """Forgets everything."""

    def state(self) -> dict[str, Any]:
        """What was learnt, fit for JSON."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Goes on from a saved state. Raises ValueError, and changes nothing, if it does not fit."""


def make_estimator(config: EstimatorConfig) -> Estimator:
    """The estimator of `config.method`, with nothing learnt."""
    return RobustEstimator(config) if config.method == "robust" else VerticalPlaneEstimator(config)
