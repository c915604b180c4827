"""pairsim: soft and rigid spheres on the axis of a tube, driven by pressure."""

import os

__version__ = "0.1.0"

# One thread a process: MPI is how pairsim uses more cores, and BLAS threads under it only fight each other.
# This must come before anything numerical is imported.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
