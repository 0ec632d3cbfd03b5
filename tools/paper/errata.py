"""What is wrong in the paper, each point by computation from its own Table 1 and its own printed "
"estimates."""

from tools.paper.errata_formulas import errata_in_formulas
from tools.paper.errata_values import errata_in_values
from tools.paper.erratum import Erratum
from tools.paper.table import Table


def errata() -> list[Erratum]:
    """All of them: formulas and claims, then numbers."""
    return errata_in_formulas() + errata_in_values()


def errata_table() -> Table:
    """The errata as a table of the report."""
    return Table(
        name="errata",
        title="Errata, recomputed",
        columns=("where", "printed", "correct", "what the computation shows", "confirmed"),
        rows=[(e.where, e.printed, e.correct, e.evidence, "yes" if e.is_shown else "no") for e in errata()],
        formats=("", "", "", "", ""),
    )
