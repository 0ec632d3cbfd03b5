"""What a set loses without some of its effects, one Gauss-Newton step ahead.

About the maximum the log-likelihood falls by 1/2 d^T M d for the information M. With the sizes s of these
effects put to zero and their other parameters idle, the rest o follows by -M_oo^-1 M_os s, and the loss is
1/2 s^T (M_ss - M_so M_oo^-1 M_os) s (half of Wald's statistic).
"""

import numpy as np

from host.diagnosis.fits.margins import ROUGH
from host.dynamics.equations import Effect
from host.likelihood.fit import Fit
from host.recordings.recording import Array


def one_step_without(fit: Fit, *effects: Effect) -> tuple[float, Array] | None:
    """Twice the log-likelihood lost without the effects, and the whole set's parameters (n,) there.

    None where no value of its parameters makes one of them absent.
    """
    names = np.array(fit.structure.names)
    own = np.isin(names, [parameter.name for effect in effects for parameter in effect.parameters])
    sizes = [np.isin(names, effect.size_names) & fit.free for effect in effects]
    if not all(size.any() for size in sizes):
        return None
    gone = np.any(sizes, axis=0)
    others = fit.free & ~own
    M = fit.information
    change = -fit.parameters[gone]
    scale = np.sqrt(np.maximum(np.diag(M)[others], 1e-300))
    normal = M[np.ix_(others, others)] / np.outer(scale, scale) + 1e-9 * np.eye(scale.size)
    follow = -np.linalg.solve(normal, (M[np.ix_(others, gone)] @ change) / scale) / scale
    loss = change @ M[np.ix_(gone, gone)] @ change + change @ M[np.ix_(gone, others)] @ follow
    parameters = fit.parameters.copy()
    parameters[gone] = 0.0
    parameters[others] += follow
    return float(loss), fit.structure.clipped(parameters)


def promises_more(larger: Fit, effect: Effect, known: Fit) -> bool:
    """Whether a larger set without the effect should be clearly likelier than what is known of that set.

    What is known may have ended in another valley, bent towards what it lacked as it grew.
    """
    ahead = one_step_without(larger, effect)
    return ahead is not None and larger.log_likelihood - 0.5 * ahead[0] > known.log_likelihood + ROUGH
