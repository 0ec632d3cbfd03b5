"""Who is compared: the packages that are installed, and ours."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from host.identification.model import VehicleModel, read_model
from host.identification.predict import predict
from host.recordings.recording import Array, Recording
from host.vehicle import default_vehicle
from tools.compare.free_run import FreeRun, best_of

Teach = Callable[[list[Recording]], FreeRun]


@dataclass(frozen=True, slots=True, kw_only=True)
class Package:
    """Another identification package: its import name, and where the settings to try stand."""

    module: str
    learners: tuple[str, str]

    @property
    def is_installed(self) -> bool:
        return find_spec(self.module) is not None

    def teach(self, teaching: list[Recording]) -> FreeRun:
        """The best of its settings. Raises ValueError when none gives a model."""
        module, function = self.learners
        return best_of(getattr(import_module(module), function)(), teaching)


PACKAGES = {
    "PySINDy": Package(module="pysindy", learners=("tools.compare.sindy", "sindy_learners")),
    "SysIdentPy": Package(module="sysidentpy", learners=("tools.compare.narx", "narx_learners")),
    "SIPPY": Package(module="sippy_unipi", learners=("tools.compare.state_space", "sippy_learners")),
    "nfoursid": Package(module="nfoursid", learners=("tools.compare.state_space", "nfoursid_learners")),
}
LINEAR, EXTENDED = "linear model (ml)", "mils diagnose"


def installed() -> dict[str, Teach]:
    """The packages that can be compared here."""
    return {name: package.teach for name, package in PACKAGES.items() if package.is_installed}


def missing() -> str:
    """One line that says which are not, and how to get them; empty when all are."""
    absent = [name for name, package in PACKAGES.items() if not package.is_installed]
    if not absent:
        return ""
    return f"not compared, for they are not installed: {', '.join(absent)} (pip install '.[compare]')"


def linear_model(teaching: list[Recording]) -> FreeRun:
    """The base equations by maximum likelihood, as `mils identify` learns them."""
    from host.identification.identify import identify

    return run_of(identify(teaching, default_vehicle()).model)


def extended_model(teaching: list[Recording]) -> FreeRun:
    """The extended model that `mils diagnose` hands back."""
    from host.diagnosis.diagnose import diagnose
    from host.diagnosis.told.files import write_extended_model

    with TemporaryDirectory() as folder:
        path = Path(folder) / "extended_model.json"
        write_extended_model(diagnose(teaching), default_vehicle(), path)
        return run_of(read_model(path))


def run_of(model: VehicleModel) -> FreeRun:
    """Free runs of one of our models."""
    return partial(_outputs, model)


def _outputs(model: VehicleModel, recording: Recording) -> Array:
    with np.errstate(all="ignore"):
        return predict(model, recording).outputs
