"""Which vehicles a trial is of, and what can be hidden on them."""

from typing import Literal

from tools.trial.hidden import KINDS
from tools.trial.published import NATIVE

Fleet = Literal["linear", "usual", "published"]
"""linear     obey the paper's equations exactly but for what is hidden
usual      also have what every real vehicle has, of the plant's own kind
published  are published ones, with the whole of their physics
"""


def hideable(fleet: Fleet) -> tuple[str, ...]:
    """All but what the vehicles have by themselves."""
    return tuple(name for name in KINDS if fleet != "published" or name not in NATIVE)
