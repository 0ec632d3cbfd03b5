"""Whether a hull holds a straight run by itself."""

import numpy as np

from host.likelihood.fit import Fit


def is_stable(fit: Fit) -> bool:
    """Whether heave, pitch rate and pitch die away at the speed of the fit, the plane at rest.

    The poles are the eigenvalues of [[a1, c_wq, 0], [c_qw, a2, a3], [0, 1, 0]] on (w, q, theta), with the
    couplings that the set has; all must damp (Fossen 2021, straight-line stability).
    """
    p = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    heave = [p["a1"], p.get("c_wq", 0.0), 0.0]
    pitch = [p.get("c_qw", 0.0), p["a2"], p["a3"]]
    return bool((np.linalg.eigvals([heave, pitch, [0.0, 1.0, 0.0]]).real < 0.0).all())
