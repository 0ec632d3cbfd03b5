"""Cuts the excerpts beside this file out of whole recordings: `python make_excerpts.py FOLDER`.

FOLDER holds small.tlog, small.BIN, 2023-04-18_11-03-34.tlog (ardusub_log_tools) and sub_6dof_gentle.tlog,
.BIN, .csv. The real ones are cut by length, so that damage stays as it was; the dive is
whole and thinned by message.
"""

import csv
import struct
import sys
from collections import Counter
from pathlib import Path

HERE = Path(__file__).parent
BEGIN_S, END_S = 79.0, 187.1  # since boot: the whole part for which the .csv holds the truth
# Every n-th message of a kind is kept, to keep the file small.
KEEP_EVERY = {
    "HEARTBEAT": 1,
    "SCALED_PRESSURE": 1,
    "ATTITUDE": 2,
    "SERVO_OUTPUT_RAW": 5,
    "SCALED_PRESSURE3": 10,
}
RECORDS = {"ATT", "BARO", "RCOU"}


def cut_dive_tlog(source: Path, target: Path) -> None:
    from pymavlink import mavutil

    log = mavutil.mavlink_connection(str(source))
    boot_ms = 0
    seen: Counter[str] = Counter()
    with target.open("wb") as out:
        while (message := log.recv_msg()) is not None:
            boot_ms = getattr(message, "time_boot_ms", boot_ms)
            kind = message.get_type()
            seen[kind] += 1
            every = KEEP_EVERY.get(kind)
            if every and seen[kind] % every == 0 and BEGIN_S <= boot_ms / 1000 < END_S:
                out.write(struct.pack(">Q", round(message._timestamp * 1e6)) + message.get_msgbuf())


def cut_dive_bin(source: Path, target: Path) -> None:
    data = source.read_bytes()
    names, lengths = {0x80: "FMT"}, {0x80: 89}
    at = 0
    with target.open("wb") as out:
        while at + 3 <= len(data) and data[at + 2] in lengths:
            kind = data[at + 2]
            record = data[at : at + lengths[kind]]
            at += lengths[kind]
            if kind == 0x80 and len(record) == 89:
                names[record[3]] = record[5:9].rstrip(b"\0").decode()
                lengths[record[3]] = record[4]
                if names[record[3]] in RECORDS:
                    out.write(record)
            elif names[kind] in RECORDS:
                time_us = int.from_bytes(record[3:11], "little")
                if BEGIN_S <= time_us * 1e-6 < END_S:
                    out.write(record)


def cut_truth(source: Path, target: Path) -> None:
    """The simulator's depth and pitch at the rows where they are new; elsewhere the .csv repeats them."""
    before = None
    with source.open() as rows, target.open("w") as out:
        out.write("time_boot_s,depth_m,pitch_rad\n")
        for row in csv.DictReader(rows):
            time_s = float(row["time_boot_ms"]) / 1000
            truth = row["sim_depth"], row["sim_pitch"]
            if before is not None and truth != before and BEGIN_S <= time_s < END_S:
                out.write(f"{time_s:.3f},{truth[0]},{truth[1]}\n")
            before = truth


def main() -> None:
    folder = Path(sys.argv[1])
    lengths = {"small.tlog": 150_000, "small.BIN": 120_000, "2023-04-18_11-03-34.tlog": 200_000}
    for name, length in lengths.items():
        (HERE / name).write_bytes((folder / name).read_bytes()[:length])
    cut_dive_tlog(folder / "sub_6dof_gentle.tlog", HERE / "dive.tlog")
    cut_dive_bin(folder / "sub_6dof_gentle.BIN", HERE / "dive.BIN")
    cut_truth(folder / "sub_6dof_gentle.csv", HERE / "dive_truth.csv")


if __name__ == "__main__":
    main()
