"""The command line of mracad: one module per command in ``commands``."""

import os

# Results must not depend on the number of cores, and small matrices gain nothing from threads.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
