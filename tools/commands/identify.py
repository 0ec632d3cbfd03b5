"""`mils identify`: recordings of one vehicle to model.json and a report."""

import argparse
from pathlib import Path

from tools.bench import (
    add_leave_out,
    joint_or_each,
    load_vehicle,
    progress,
    read_all,
    require_bench,
    tell_notes,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recordings", metavar="RECORDING", nargs="+", type=Path, help=".csv .tlog .BIN .log .asc .blf .jsonl"
    )
    parser.add_argument("--vehicle", type=Path, help="vehicle file: columns, units, channels, speed")
    parser.add_argument(
        "--method",
        choices=("car", "mils", "robust", "ml"),
        default="ml",
        help="ml: maximum likelihood (default); robust: as on the vehicle; mils, car: the paper's regression",
    )
    parser.add_argument(
        "--each", action="store_true", help="one model for each recording instead of one for all"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("."), metavar="DIR", help="where model.json and report.html go"
    )
    add_leave_out(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress")


def run(args: argparse.Namespace) -> int:
    require_bench()
    from host.identification.identify import identify
    from host.identification.model import write_model
    from host.identification.report import advice, unit_of, write_report
    from host.identification.verdict import verdict
    from host.recordings.afloat import under_water
    from host.recordings.left_out import spans_in, without

    vehicle, leave_out = load_vehicle(args.vehicle), spans_in(args.leave_out)
    worst = 0
    with progress(args.quiet) as say:
        on_grid = args.method != "ml"
        read = without(under_water(read_all(args.recordings, vehicle, say, on_grid=on_grid)), leave_out)
        for recordings, folder in joint_or_each(read, args.out, args.each):
            result = identify(recordings, vehicle, args.method, say)
            folder.mkdir(parents=True, exist_ok=True)
            write_model(result.model, folder / "model.json")
            say("writing the report")
            write_report(result, folder / "report.html")
            print(verdict(result).sentence)
            for name, value in result.model.values.items():
                std, unit = result.model.std[name], unit_of(name, recordings)
                print(
                    f"  {name:13s} {value:+10.5f} +- {std:.5f} {unit}"
                    if std
                    else f"  {name:13s} {value:+10.5f} {unit}"
                )
            for effect in result.model.effects:
                for name, entry in effect["parameters"].items():
                    print(f"  {name:13s} {entry['value']:+10.5f} +- {entry['std']:.5f} {entry['unit']}")
            for line in advice(result):
                print(f"  to learn {line}")
            for note in result.notes:
                print(f"  note: {note}")
            tell_notes(result.recordings)
            print(f"model:  {folder / 'model.json'}\nreport: {folder / 'report.html'}")
            worst = max(worst, 1 if result.undetermined else 0)
    return worst
