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
from typing import Any

from tools.trial.answers import Answer

ROOT = Path(__file__).parent.parent.parent
DIAGNOSES = "diagnoses"
RUN_FILE = "run.json"
ANSWER_FILE = "diagnosis.json"
TRUE_FILE = "true_structure.json"
MOST_SECONDS = 1800.0
DIAGNOSE = (sys.executable, "-m", "tools.cli", "diagnose")


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
    command: tuple[str, ...] = DIAGNOSE,
    also: Callable[[Path], tuple[str, ...]] = lambda _: (),
) -> dict[str, Run]:
    """The runs by name of recording; those that have answered before are kept and not repeated.

    command    in place of `mils diagnose`; RECORDING --out DIR --jobs 1 --quiet is added
    also       more that the command is told with a recording
    """
    runs = {}
    with ThreadPoolExecutor(jobs) as pool:
        waiting = {
            pool.submit(_diagnose, path, folder / DIAGNOSES / path.stem, (*command, *also(path))): path.stem
            for path in recordings
        }
        for done in as_completed(waiting):
            runs[waiting[done]] = done.result()
            on_done()
    return runs


def fit_true_structures(
    folder: Path, answers: dict[Path, Answer], jobs: int, on_done: Callable[[], None]
) -> None:
    """Fits each recording with the effects that it hides; those fitted before are kept."""
    with ThreadPoolExecutor(jobs) as pool:
        waiting = [pool.submit(_fit_true, folder, path, answer) for path, answer in answers.items()]
        for done in as_completed(waiting):
            done.result()
            on_done()


def read_result(folder: Path, name: str, file: str) -> dict[str, Any] | None:
    """A JSON file of a recording's diagnosis, or None where there is none."""
    path = folder / DIAGNOSES / name / file
    if not path.is_file():
        return None
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def _environment() -> dict[str, str]:
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(paths)}


def _fit_true(folder: Path, recording: Path, answer: Answer) -> None:
    out = folder / DIAGNOSES / recording.stem / TRUE_FILE
    if not out.is_file():
        start = dict(answer.base)
        for coefficients in answer.coefficients.values():
            start |= coefficients
        acting = ",".join([*answer.usual, *answer.hidden])
        told = ["--effects", acting, "--start", json.dumps(start), "--out", str(out)]
        command = [sys.executable, "-m", "tools.true_structure", str(recording), *told]
        subprocess.run(command, env=_environment(), capture_output=True, timeout=MOST_SECONDS, check=False)


def _diagnose(recording: Path, out: Path, command: tuple[str, ...]) -> Run:
    noted = out / RUN_FILE
    if noted.is_file():
        kept = Run(**json.loads(noted.read_text(encoding="utf-8")))
        # Python ends with 1, too, where a command breaks off.
        if kept.has_answered and (out / ANSWER_FILE).is_file():
            return kept
    out.mkdir(parents=True, exist_ok=True)
    spoken = out / "said.txt"
    began = time.monotonic()
    with spoken.open("w", encoding="utf-8") as voice:
        process = subprocess.Popen(
            [*command, str(recording), "--out", str(out), "--jobs", "1", "--quiet"],
            stdout=voice,
            stderr=subprocess.STDOUT,
            env=_environment(),
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
