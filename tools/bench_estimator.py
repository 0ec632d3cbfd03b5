"""`python -m tools.bench_estimator`: cost of an update, and which forms survive on the depth model."""

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model import (
    EstimatorConfig,
    Mils,
    MilsConfig,
    RobustConfig,
    Sample,
    Status,
    car_from_physical,
    make_estimator,
)

Array = NDArray[np.float64]

P0 = 1e6
NOISE = 1e-3  # m, in the depth equation


def depth_rows(count: int) -> tuple[Array, Array]:
    """Rows and outputs of the paper's depth model under a multisine plane at 10 Hz."""
    _, beta = car_from_physical(-0.63084, -3.38699, -8.19858, 0.41385, -3.94120, u0=2.5, h=0.1)
    t = 0.1 * np.arange(count + 4)
    rudder = sum(
        0.06 * np.sin(2.0 * np.pi * f * t + 9.0 * f) for f in (0.02, 0.05, 0.11, 0.23, 0.41, 0.7, 1.1)
    )
    noise = NOISE * np.random.default_rng(3).normal(size=count + 4)
    depth = [0.0] * 4
    rows = []
    for k in range(4, count + 4):
        rows.append(
            [-depth[k - 1], -depth[k - 2], -depth[k - 3], -depth[k - 4], *rudder[k - 4 : k - 1][::-1]]
        )
        depth.append(float(np.dot(rows[-1], beta) + noise[k]))
    return np.array(rows), np.array(depth[4:])


def median_cost(n: int, p: int, real: Callable[[float], Any], steps: int) -> float:
    """Median time of an update, microseconds."""
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(steps, n)).tolist()
    mils = Mils(n, p, 0.97, P0, real=real)
    times = []
    for phi in rows:
        start = time.perf_counter_ns()
        mils.update(phi, 1.0)
        times.append(time.perf_counter_ns() - start)
    return statistics.median(times[p:]) * 1e-3


def median_sample_cost(config: EstimatorConfig, steps: int) -> float:
    """Median time in which an estimator takes one sample of a moving vehicle, microseconds."""
    rng = np.random.default_rng(0)
    estimator = make_estimator(config)
    times = []
    for k in range(steps):
        rudder = 0.2 * float(np.sin(0.07 * k) + np.sin(0.19 * k))
        depth, pitch = 20.0 + 0.01 * float(rng.normal()), -0.4 * rudder + 0.002 * float(rng.normal())
        sample = Sample(t_us=100_000 * k, depth=depth, pitch=pitch, rudder=rudder)
        start = time.perf_counter_ns()
        estimator.update(sample)
        times.append(time.perf_counter_ns() - start)
    return statistics.median(times[steps // 4 :]) * 1e-3


def textbook_life(rows: Array, p: int, forgetting: float, real: type, *, symmetric: bool) -> int:
    """Steps until P of the textbook update, or of its symmetrised form, is not positive definite."""
    n = rows.shape[1]
    typed: NDArray[Any] = rows.astype(real)
    P: NDArray[Any] = (P0 * np.eye(n)).astype(real)
    for k in range(len(typed)):
        Phi = typed[max(0, k - p + 1) : k + 1][::-1].T
        S = Phi.T @ P @ Phi + real(forgetting) * np.eye(Phi.shape[1], dtype=real)
        L = np.linalg.solve(S.T, (P @ Phi).T).T
        P = (P - L @ (Phi.T @ P)) / real(forgetting)
        if symmetric:
            P = (P + P.T) / real(2.0)
        if not np.isfinite(P).all() or np.linalg.eigvalsh((P + P.T).astype(float)).min() <= 0.0:
            return k
    return len(rows)


def square_root_life(
    rows: Array, outputs: Array, p: int, forgetting: float, real: Callable[[float], Any]
) -> int:
    """The same for the square-root form."""
    n = rows.shape[1]
    mils = Mils(n, p, forgetting, P0, real=real)
    for k, (phi, y) in enumerate(zip(rows.tolist(), outputs.tolist(), strict=True)):
        if mils.update(phi, y) not in (Status.UPDATED, Status.CAPPED):
            return k
        if k % 100 == 0 and np.linalg.svd(np.array(mils.state()["root"]).reshape(n, n))[1][-1] <= 0.0:
            return k
    return len(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=3000, help="steps of each survival run (default 3000)")
    steps = parser.parse_args().steps

    print("median cost of a sample, microseconds")
    for p in (1, 5):
        robust = EstimatorConfig(step=0.1, speed=2.0, robust=RobustConfig(innovation_length=p))
        mils = EstimatorConfig(method="mils", step=0.1, speed=2.0, mils=MilsConfig(innovation_length=p))
        costs = (median_sample_cost(robust, 2000), median_sample_cost(mils, 2000))
        print(f"    p = {p}   robust {costs[0]:7.1f}   mils {costs[1]:7.1f}")

    print("\nmedian cost of a MILS step, microseconds")
    print("    n   p   float64   float32")
    for n in (3, 7):
        for p in (1, 5, 8):
            double = median_cost(n, p, float, 2000)
            single = median_cost(n, p, np.float32, 300)
            print(f"{n:5d} {p:3d} {double:9.1f} {single:9.1f}")

    rows, outputs = depth_rows(steps)
    print(f"\nsteps with P positive definite, of {steps}: depth model, paper's coordinates")
    print(" type     forgetting   p   textbook  symmetrised  square root")
    for real in (np.float32, np.float64):
        for forgetting in (0.97, 1.0):
            for p in (1, 8):
                textbook = textbook_life(rows, p, forgetting, real, symmetric=False)
                symmetrised = textbook_life(rows, p, forgetting, real, symmetric=True)
                scalar = float if real is np.float64 else real
                root = square_root_life(rows, outputs, p, forgetting, scalar)
                case = f" {real.__name__:9s} {forgetting:9.3f} {p:3d}"
                print(f"{case} {textbook:10d} {symmetrised:12d} {root:12d}")


if __name__ == "__main__":
    main()
