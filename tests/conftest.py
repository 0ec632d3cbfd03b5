"""Settings of all tests."""

import os

from hypothesis import settings

# Matrices here are tiny: threads of the linear algebra library only get in each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# How long an example takes is the machine's matter, not the product's.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")
