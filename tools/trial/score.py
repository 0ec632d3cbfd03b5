"""The figures of a trial: rates with their bars, confusion, coverage, cost."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import sqrt
from statistics import median

from tools.trial.hidden import KINDS, STRANGERS
from tools.trial.judge import NOTHING, Coefficient, Judged

NEGLIGIBLE = 0.1  # of BIC: two fits of one set
MISSED = 6.0  # of BIC, that a name must be worth
USUAL_ROWS, PROMPT = 3000, 60.0  # 300 s at 10 Hz, and within how many s they are to be diagnosed
BANDS = ((50.0, 300.0), (300.0, 2000.0), (2000.0, 20000.0))  # of misfit; weaker effects are harder to name


@dataclass(frozen=True, slots=True, kw_only=True)
class Rate:
    """A share of cases. `bar` is what it must reach, from both sides where `most` is given."""

    name: str
    hits: int
    count: int
    least: float | None = None
    most: float | None = None

    @property
    def share(self) -> float:
        return self.hits / self.count if self.count else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 %, by Wilson's score."""
        if not self.count:
            return 0.0, 1.0
        z, n, p = 1.96, self.count, self.share
        middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
        half = z / (1 + z**2 / n) * sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
        return max(middle - half, 0.0), min(middle + half, 1.0)

    @property
    def is_met(self) -> bool | None:
        """None where there is no bar or no case."""
        if not self.count or (self.least is None and self.most is None):
            return None
        return (self.least is None or self.share >= self.least) and (
            self.most is None or self.share <= self.most
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """All that is printed."""

    recordings: int
    failed: list[str]
    rates: list[Rate]
    bands: list[Rate]
    by_effect: list[Rate]
    confusion: dict[tuple[str, str], int]
    errors: dict[str, tuple[float, Rate]]  # coefficient: median relative error, coverage
    median_seconds: float
    longest_seconds: float
    largest_memory_mb: float


def score(judged: list[Judged]) -> Score:
    """Sums up the judged recordings; those without a diagnosis count as wrong."""
    none, one, two, outside = (_of(case, judged) for case in ("none", "one", "two", "outside"))
    effect = [c for j in judged for c in j.effect_coefficients]
    base = [c for j in judged for c in j.base_coefficients]
    exact = [j for j in judged if j.is_exact and j.over_floor is not None]
    told = [j for j in judged if j.over_truth is not None]
    located = [j for j in judged if j.is_slot_right is not None]
    known = [j for j in judged if j.case != "outside" and j.over_floor is not None]
    rates = [
        _rate("one hidden: named first", one, lambda j: bool(j.is_first), least=0.92),
        _rate("one hidden: named first or in a class of at most 3", one, lambda j: bool(j.is_in_class), 0.97),
        _rate("one hidden: that and nothing else named", one, lambda j: j.is_exact),
        _rate("one hidden: no other set is likelier than the true one", one, _is_likeliest),
        _rate("two hidden: both named", two, lambda j: bool(j.are_named), 0.88),
        _rate("two hidden: both named or in a class of at most 3", two, lambda j: bool(j.are_in_class)),
        _rate("two hidden: those and nothing else named", two, lambda j: j.is_exact),
        _rate("two hidden: no other set is likelier than the true one", two, _is_likeliest),
        _rate(
            "hidden: missed by the search, as the true set is likelier by 6 of BIC", [*one, *two], _is_missed
        ),
        _rate("nothing hidden: something named", none, lambda j: bool(j.named) or j.has_failed, most=0.02),
        _rate("nothing hidden: verdict no_mismatch", none, lambda j: j.verdict == "no_mismatch"),
        _rate("outside physics: unexplained or partly explained", outside, lambda j: j.admits, 0.90),
        _rate(
            "outside physics: slot located right", _of("outside", located), lambda j: bool(j.is_slot_right)
        ),
        _rate(
            "slot located right",
            _of("one", located) + _of("two", located),
            lambda j: bool(j.is_slot_right),
            0.97,
        ),
        _rate("abstention: something hidden, nothing named", [*one, *two], lambda j: not j.named),
        _rate("held-out error <= 1.05 x true structure", told, lambda j: _within(j.over_truth, 1.05), 0.90),
        _rate("held-out error <= 1.05 x noise", known, lambda j: _within(j.over_floor, 1.05)),
        _rate("held-out error <= 1.05 x noise, rightly named", exact, lambda j: _within(j.over_floor, 1.05)),
        _rate("95 % intervals of effects hold the truth", effect, lambda c: c.is_covered, 0.93, 0.97),
        _rate("95 % intervals of a1 ... u0 hold the truth", base, lambda c: c.is_covered, 0.93, 0.97),
        _rate(
            "no longer than 300 s at 10 Hz: diagnosed in 60 s, on one core",
            [j for j in judged if j.rows <= USUAL_ROWS],
            lambda j: j.seconds <= PROMPT,
        ),
    ]
    bands = [
        _rate(
            f"one hidden, misfit {low:g}-{high:g}: named first",
            [j for j in one if low <= j.weakest_misfit < high],
            lambda j: bool(j.is_first),
        )
        for low, high in BANDS
    ]
    return Score(
        recordings=len(judged),
        failed=[j.recording for j in judged if j.has_failed],
        rates=rates,
        bands=bands,
        by_effect=[
            _rate(name, [j for j in [*one, *two] if name in j.hidden], lambda j, name=name: name in j.named)
            for name in KINDS
        ]
        + [_rate(name, [j for j in outside if name in j.hidden], lambda j: j.admits) for name in STRANGERS],
        confusion=dict(
            Counter((j.hidden[0] if j.hidden else NOTHING, j.first) for j in judged if j.case != "two")
        ),
        errors={
            name: (
                median(c.error for c in coefficients),
                _rate(name, coefficients, lambda c: c.is_covered),
            )
            for name, coefficients in sorted(_by_name([*effect, *base]).items())
        },
        median_seconds=median(j.seconds for j in judged) if judged else 0.0,
        longest_seconds=max((j.seconds for j in judged), default=0.0),
        largest_memory_mb=max((j.memory_mb for j in judged), default=0.0),
    )


def _of(case: str, judged: list[Judged]) -> list[Judged]:
    return [one for one in judged if one.case == case]


def _rate(
    name: str,
    cases: Iterable[object],
    holds: Callable[..., bool],
    least: float | None = None,
    most: float | None = None,
) -> Rate:
    listed = list(cases)
    return Rate(
        name=name, hits=sum(holds(case) for case in listed), count=len(listed), least=least, most=most
    )


def _is_likeliest(judged: Judged) -> bool:
    return judged.truth_lead is not None and judged.truth_lead >= -NEGLIGIBLE


def _is_missed(judged: Judged) -> bool:
    return judged.has_failed or (judged.truth_lead is not None and judged.truth_lead > MISSED)


def _within(ratio: float | None, limit: float) -> bool:
    return ratio is not None and ratio <= limit


def _by_name(coefficients: list[Coefficient]) -> dict[str, list[Coefficient]]:
    found: dict[str, list[Coefficient]] = {}
    for coefficient in coefficients:
        found.setdefault(coefficient.name, []).append(coefficient)
    return found
