"""Waves are named by their swing, and what acts beside them is still found."""

import numpy as np
from hidden_dive import hidden_dive

from host.diagnosis.diagnose import diagnose


def test_a_coupling_is_found_among_waves() -> None:
    rng = np.random.default_rng(4)
    met = rng.uniform(0.8, 1.6, 12)  # rad/s
    phases = rng.uniform(0.0, 2.0 * np.pi, (2, 12))

    def rough(time: float, x: np.ndarray, _: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
        force, moment = np.sin(met * time + phases).sum(axis=1)
        return 0.8 * x[1] + 0.01 * force, 0.02 * moment, 0.0

    found = diagnose([hidden_dive(rough, duration=90.0)])
    names = [effect.name for effect in found.effects]
    assert names.count("surface_waves") == 1
    coupling = next(effect for effect in found.effects if effect.name != "surface_waves")
    assert "heave_pitch_rate_coupling" in {coupling.name, *coupling.twins}
    assert "surface_waves" in found.extended.names
    assert found.has_sea
