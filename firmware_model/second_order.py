"""What linearisation leaves out: the products of parameter errors and state errors.

    heave: da1 dw + dgamma dtheta - dkappa dq        pitch: da2 dq + da3 dtheta

For Gaussian errors a product dx dy has the mean P_xy, and two products the covariance
P_xx' P_yy' + P_xy' P_yx'. An estimator that ignores them believes its first samples too much and never
recovers; one that adds them as process noise is careful while it knows little, and loses nothing later: the
noise vanishes with the errors.
"""

from firmware_model.propagation import A1, A2, A3, GAMMA, KAPPA, THETA, Q, W
from firmware_model.ud_factors import UdFactors


class SecondOrder:
    """Means (m/s^2, rad/s^2) and variances of the two sums."""

    def __init__(self) -> None:
        self.heave_mean = 0.0
        self.pitch_mean = 0.0
        self.heave_variance = 0.0
        self.pitch_variance = 0.0

    def update(self, ud: UdFactors) -> None:
        """The moments for the covariance in `ud`."""
        P = ud.covariance
        ww, qq, tt = P(W, W), P(Q, Q), P(THETA, THETA)
        wq, wt, qt = P(W, Q), P(W, THETA), P(Q, THETA)
        aw, at, aq = P(A1, W), P(A1, THETA), P(A1, Q)
        gw, gt, gq = P(GAMMA, W), P(GAMMA, THETA), P(GAMMA, Q)
        kw, kt, kq = P(KAPPA, W), P(KAPPA, THETA), P(KAPPA, Q)
        dq, dt, rq, rt = P(A2, Q), P(A2, THETA), P(A3, Q), P(A3, THETA)
        self.heave_mean = aw + gt - kq
        self.pitch_mean = dq + rt
        self.heave_variance = (
            (P(A1, A1) * ww + aw * aw)
            + (P(GAMMA, GAMMA) * tt + gt * gt)
            + (P(KAPPA, KAPPA) * qq + kq * kq)
            + 2.0
            * (
                (P(A1, GAMMA) * wt + at * gw)
                - (P(A1, KAPPA) * wq + aq * kw)
                - (P(KAPPA, GAMMA) * qt + kt * gq)
            )
        )
        self.pitch_variance = (
            (P(A2, A2) * qq + dq * dq) + (P(A3, A3) * tt + rt * rt) + 2.0 * (P(A2, A3) * qt + dt * rq)
        )
