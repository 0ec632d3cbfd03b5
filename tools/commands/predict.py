"""`mils predict`: how well a model's free run meets a recording."""

import argparse
import json
from pathlib import Path

from tools.bench import load_vehicle, read_all, require_bench, tell_notes


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", type=Path, metavar="MODEL.json")
    parser.add_argument("recording", type=Path, metavar="RECORDING")
    parser.add_argument("--vehicle", type=Path, help="vehicle file: columns, units, channels")
    parser.add_argument("--json", type=Path, metavar="F", help="write the score here")


def run(args: argparse.Namespace) -> int:
    require_bench()
    import numpy as np

    from host.identification.model import read_model
    from host.identification.predict import predict, score
    from host.recordings.afloat import under_water

    model = read_model(args.model)
    recordings = under_water(read_all([args.recording], load_vehicle(args.vehicle), lambda _: None))
    runs = [predict(model, recording) for recording in recordings]
    tell_notes(recordings)
    total = score(np.hstack([run.outputs for run in runs]), [run.recording for run in runs])
    print(
        f"depth {total.depth_rmse_m:.4f} m rms ({total.depth_fit_percent:.2f} %), "
        f"pitch {np.degrees(total.pitch_rmse_rad):.4f} deg rms ({total.pitch_fit_percent:.2f} %), "
        f"{total.samples} samples"
    )
    if args.json is not None:
        args.json.write_text(json.dumps(total.as_json(), indent=2) + "\n", encoding="utf-8")
    return 0
