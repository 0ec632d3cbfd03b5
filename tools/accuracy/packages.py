"""Every method and the other packages that are installed, learnt from one dive, run freely over another."""

import warnings
from collections.abc import Callable
from multiprocessing import get_context

import numpy as np

from host.dynamics.equations import NAMES as PARAMETER_NAMES
from host.identification.model import VehicleModel
from host.recordings.recording import Recording
from tools.accuracy.dive import Array, Case, fly
from tools.accuracy.methods import COMPARED, METHODS, recording_of
from tools.compare.free_run import FreeRun
from tools.compare.held_out import HeldOut, held_out, median_of
from tools.compare.methods import Teach, installed, run_of

FIRST_SEED = 5000
JUDGING = 1_000_000  # added to the seed of the dive that teaches


def measure_packages(dives: int, workers: int, on_progress: Callable[[str], None]) -> list[HeldOut]:
    """Medians over the dives of the first case; our methods first, then the packages."""
    names = [*COMPARED, *installed()]
    lines = []
    with get_context("spawn").Pool(workers) as pool:
        for name in names:
            jobs = [(name, FIRST_SEED + dive) for dive in range(dives)]
            lines.append(median_of(pool.map(_one, jobs, chunksize=1)))
            on_progress(f"held-out free run, {name}: {dives} dives")
    return lines


def _one(job: tuple[str, int]) -> HeldOut:
    name, seed = job
    warnings.simplefilter("ignore")  # the packages warn at every setting that does not suit
    case = Case()
    other = recording_of(fly(case, JUDGING + seed))
    floor = np.array([case.pitch_noise**2, case.depth_noise**2])
    teach = _ours(name, seed) if name in METHODS else installed()[name]
    return held_out(name, teach, [recording_of(fly(case, seed))], [other], floor)


def _ours(name: str, seed: int) -> Teach:
    """One of our methods on the dive itself; it gives coefficients, from which the equations run."""

    def teach(_: list[Recording]) -> FreeRun:
        dive = fly(Case(), seed)
        with np.errstate(all="ignore"):
            values, _std = METHODS[name](dive)
        known = np.where(np.isfinite(values), values, dive.case.vehicle)
        if not np.isfinite(values[:5]).all():
            raise ValueError(f"{name} gave no coefficients")
        return run_of(_model(known, name))

    return teach


def _model(values: Array, name: str) -> VehicleModel:
    """Trims are zero in these dives."""
    return VehicleModel(
        vehicle="Table 1",
        step=Case().step,
        values=dict(zip(PARAMETER_NAMES, [*values.tolist(), 0.0, 0.0], strict=True)),
        std=dict.fromkeys(PARAMETER_NAMES, 0.0),
        noise={},
        valid_range={},
        provenance={"method": name},
    )
