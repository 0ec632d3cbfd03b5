"""Settings of all tests."""

import os

# Matrices here are tiny: threads of the linear algebra library only get in each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
