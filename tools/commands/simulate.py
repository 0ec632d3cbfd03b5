"""`mils simulate`: a model's free run on a given plane movement."""

import argparse
from pathlib import Path

from tools.bench import load_vehicle, read_all, require_bench


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", type=Path, metavar="MODEL.json")
    parser.add_argument(
        "input", type=Path, metavar="INPUT", help="recording or CSV with time_s and rudder_rad"
    )
    parser.add_argument("--vehicle", type=Path, help="vehicle file: columns, units, channels")
    parser.add_argument("--out", type=Path, required=True, metavar="SIM.csv")


def run(args: argparse.Namespace) -> int:
    require_bench()
    from host.identification.model import read_model
    from host.identification.simulate import simulate, write_simulation

    model = read_model(args.model)
    vehicle = load_vehicle(args.vehicle)
    recordings = read_all([args.input], vehicle, lambda _: None, needs=("rudder",))
    simulated = [simulate(model, recording) for recording in recordings]
    write_simulation(simulated, args.out)
    print(f"{sum(run.time.size for run in simulated)} rows: {args.out}")
    return 0
