"""The answers of a trial: sealed before the diagnosis, opened after it."""

import gzip
import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

SEALED = "answers.json.gz"
SEAL = "answers.sha256"


class BrokenSeal(Exception):
    """The answers are not those whose hash was published; the message is one line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Floor:
    """Noise-free truth at the instruments' instants, and the noise that was put on it.

    rows  those that the logger kept; None where all were kept as they were
    """

    pitch_noise_rad: float
    depth_noise_m: float
    step_s: float
    pitch_rad: list[float]
    depth_m: list[float]
    rows: list[int] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What one recording hides.

    usual         what this vehicle has beside it as every real one does, and what may be named or not
    misfits       by effect: chi2 that remains without it, all coefficients fitted anew
    coefficients  by effect, then by the catalogue's name; empty where the forms differ
    """

    number: int
    case: str
    hidden: list[str]
    slots: list[str]
    sizes: dict[str, float]
    misfits: dict[str, float]
    base: dict[str, float]
    coefficients: dict[str, dict[str, float]]
    outing: dict[str, float | str | bool]
    floor: Floor
    usual: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Of its recording, without a suffix."""
        return recording_name(self.number)


def recording_name(number: int) -> str:
    """A name that hints at nothing."""
    return f"dive_{number:04d}"


def seal(folder: Path, seed: int, answers: list[Answer]) -> str:
    """Writes the answers and beside them their SHA-256, which is also returned.

    The seed goes under the seal too: whoever knows it can draw the answers.
    """
    text = json.dumps({"schema": 1, "seed": seed, "answers": [_told(answer) for answer in answers]})
    packed = gzip.compress(text.encode(), mtime=0)
    digest = hashlib.sha256(packed).hexdigest()
    (folder / SEALED).write_bytes(packed)
    (folder / SEAL).write_text(f"{digest}  {SEALED}\n", encoding="utf-8")
    return digest


def _told(answer: Answer) -> dict[str, object]:
    entry = asdict(answer)
    if entry["floor"]["rows"] is None:
        del entry["floor"]["rows"]  # trials that were sealed before there were loggers keep their hash
    return entry


def published(folder: Path) -> str | None:
    """The hash that was published, or None where nothing is sealed yet."""
    path = folder / SEAL
    return path.read_text(encoding="utf-8").split()[0] if path.is_file() else None


def open_answers(folder: Path, digest: str) -> tuple[int, list[Answer]]:
    """Seed and answers. Raises BrokenSeal when they are not those of the hash."""
    path = folder / SEALED
    packed = path.read_bytes()
    found = hashlib.sha256(packed).hexdigest()
    if found != digest:
        raise BrokenSeal(f"{path}: SHA-256 is {found[:16]}..., published was {digest[:16]}...")
    content = json.loads(gzip.decompress(packed))
    answers = []
    for entry in content["answers"]:
        answers.append(Answer(**(entry | {"floor": Floor(**entry["floor"])})))
    return content["seed"], answers
