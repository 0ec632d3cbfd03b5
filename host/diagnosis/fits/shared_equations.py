"""Which equations a set of effects is evaluated in.

Their functions take longer to build and to compile than to run over a recording, and a search meets hundreds
of sets. So a set of many is evaluated in the equations of what nearly every set of many holds, with the
coefficients of all that is not its own at 0 (`host.dynamics.propagate.Inputs.shared`): those are built once.
"""

from host.catalogue import FAINT, ORDINARY, named, structure_of
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.explanation import Names
from host.diagnosis.fits.margins import LARGEST_SET
from host.dynamics.equations import Structure

CARRIED = frozenset(
    name
    for name in (*ORDINARY, *FAINT, FREE_TRIM.name)
    if named(name).state is None and named(name).size_names
)
"""What acts nowhere where its coefficients are zero, and moves no state of its own."""


def in_shared_equations(names: Names) -> Structure | None:
    """The equations in which a set of these effects is evaluated; None for its own."""
    if len(names - {FREE_TRIM.name}) <= LARGEST_SET:
        return None
    return structure_of(names | CARRIED)
