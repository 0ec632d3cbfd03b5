"""Runs `mils diagnose` on each recording, as a user would, and notes what it cost."""

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
DIAGNOSES = "diagnoses"
RUN_FILE = "run.json"
MOST_SECONDS = 1800.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What one call of the command cost and said."""

    seconds: float
    memory_mb: float
    exit_code: int
    said: str

    @property
    def has_answered(self) -> bool:
        """Exit codes 0 and 1 are answers; all else is a failure."""
        return self.exit_code in (0, 1)


def diagnose_all(
    folder: Path,
    recordings: list[Path],
    jobs: int,
    on_done: Callable[[], None],
    command: tuple[str, ...] = (),
) -> dict[str, Run]:
    """The runs by name of recording; those that have answered before are kept and not repeated.

    command    in place of `mils diagnose`; RECORDING --out DIR --quiet is added
    """
    runs = {}
    with ThreadPoolExecutor(jobs) as pool:
        waiting = {
            pool.submit(_diagnose, path, folder / DIAGNOSES / path.stem, command): path.stem
            for path in recordings
        }
        for done in as_completed(waiting):
            runs[waiting[done]] = done.result()
            on_done()
    return runs


def read_diagnosis(folder: Path, name: str) -> dict[str, object] | None:
    """diagnosis.json of a recording, or None where the command left none."""
    path = folder / DIAGNOSES / name / "diagnosis.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None


def read_model(folder: Path, name: str) -> dict[str, object] | None:
    """extended_model.json of a recording, or None where the command left none."""
    path = folder / DIAGNOSES / name / "extended_model.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None


def _diagnose(recording: Path, out: Path, command: tuple[str, ...]) -> Run:
    noted = out / RUN_FILE
    if noted.is_file():
        kept = Run(**json.loads(noted.read_text(encoding="utf-8")))
        if kept.has_answered:
            return kept
    out.mkdir(parents=True, exist_ok=True)
    command = command or (sys.executable, "-m", "tools.cli", "diagnose")
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(paths)}
    spoken = out / "said.txt"
    began = time.monotonic()
    with spoken.open("w", encoding="utf-8") as voice:
        process = subprocess.Popen(
            [*command, str(recording), "--out", str(out), "--quiet"],
            stdout=voice,
            stderr=subprocess.STDOUT,
            env=environment,
        )
        limit = threading.Timer(MOST_SECONDS, process.kill)
        limit.start()
        _, status, usage = os.wait4(process.pid, 0)
        limit.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    run = Run(
        seconds=round(time.monotonic() - began, 2),
        memory_mb=round(usage.ru_maxrss / 1024, 1),
        exit_code=process.returncode,
        said=spoken.read_text(encoding="utf-8", errors="replace")[-2000:],
    )
    noted.write_text(json.dumps(asdict(run), indent=2) + "\n", encoding="utf-8")
    return run
