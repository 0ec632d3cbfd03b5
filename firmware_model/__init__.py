"""The estimator as it runs on the vehicle. Imports nothing else of this project."""

from firmware_model.config import EstimatorConfig, MilsConfig, RobustConfig
from firmware_model.conversion import (
    Physical,
    car_from_physical,
    physical_from_car,
    physical_std_from_car,
    pitch_from_car,
)
from firmware_model.estimate import PARAMETERS, Estimate
from firmware_model.estimator import Estimator, make_estimator
from firmware_model.mils import Mils
from firmware_model.robust import RobustEstimator
from firmware_model.sample import Sample
from firmware_model.status import Status
from firmware_model.vertical_plane import VerticalPlaneEstimator

__all__ = [
    "PARAMETERS",
    "Estimate",
    "Estimator",
    "EstimatorConfig",
    "Mils",
    "MilsConfig",
    "Physical",
    "RobustConfig",
    "RobustEstimator",
    "Sample",
    "Status",
    "VerticalPlaneEstimator",
    "car_from_physical",
    "make_estimator",
    "physical_from_car",
    "physical_std_from_car",
    "pitch_from_car",
]
