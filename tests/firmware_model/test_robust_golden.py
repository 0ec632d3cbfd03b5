"""The estimator does today what it did when the trace was written; a change of numbers is a decision."""

import json

import numpy as np
from robust_golden import TRACE, samples_from, trace


def test_the_trace_is_repeated():
    golden = json.loads(TRACE.read_text())
    now = trace(samples_from(golden["samples"]))
    assert now["statuses"] == golden["statuses"]
    np.testing.assert_allclose(now["estimates"], golden["estimates"], rtol=1e-7)
    assert {"UPDATED", "WAITING", "RESTARTED", "REFUSED_OUTLIER"} <= set(golden["statuses"])
