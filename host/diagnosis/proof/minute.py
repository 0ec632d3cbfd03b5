"""What is too small to be worth a name: offsets, and a plane that is late by less than its rows resolve.

Over minutes a depth to a centimetre tells a moment that a ten-thousandth of a degree of plane would hold: no
servo is so true, and the mean of what is not quite linear does as much. The model keeps it, as it is likelier
so; but to name it would send somebody to look for a weight that is not there. Nor is a slow servo to be
looked for where the plane is late by a fraction of a row: one that moved between rows was set in steps of its
own.
"""

import numpy as np

from host.catalogue.kin import OFFSETS, as_trim, is_time
from host.diagnosis.fits.explanation import Explanation, Names
from host.recordings.recording import Recording

LEAST_ANGLE = 5e-5  # rad, 0.003 deg: of plane, or of the climb that is due to a force
SHORT, SHORTEST = 0.25, 0.05  # of the time between rows, and s: commands of 20 Hz are late by half of that


def minute_in(explanation: Explanation) -> Names:
    """The offsets of a set that a smaller plane angle holds, and that let the vehicle climb at a smaller one.

    Of a constant force Z and moment M, in m/s^2 and rad/s^2, those angles are |Z / (a1 u0)| and |M / b2|.
    """
    fit = explanation.fit
    known = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    largest = LEAST_ANGLE * np.abs([known["a1"] * known["u0"], known["b2"]])
    found = set[str]()
    for effect in fit.structure.effects:
        if effect.name in OFFSETS:
            sizes = np.array([known[parameter.name] for parameter in effect.parameters])
            if (np.abs(as_trim(known, effect.name) @ sizes) < largest).all():
                found.add(effect.name)
    return frozenset(found)


def unresolved_in(explanation: Explanation, recordings: list[Recording]) -> Names:
    """What makes a plane late by less than a quarter of a row, where it moved on between rows."""
    if not any(recording.has_moving_plane for recording in recordings):
        return frozenset()
    fit = explanation.fit
    known = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    most = min(SHORTEST, SHORT * min(recording.step for recording in recordings))
    late = (effect for effect in fit.structure.effects if effect.slot == "actuator" and is_time(effect))
    return frozenset(effect.name for effect in late if known[effect.parameters[0].name] < most)
