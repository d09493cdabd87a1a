"""Where tasks run: what a worker does with its memory."""

import subprocess
import sys

import pytest

FAULTS = """
import resource, numpy as np
from experiments.sweep.executors import keep_freed_memory

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        np.ones(200_000)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

faults()
first = faults()
keep_freed_memory()
faults()
print(first, faults())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="sizes of glibc")
def test_a_worker_under_a_dask_nanny_uses_memory_again():
    """1.6 MB that come from the system have 390 pages, each of which is counted as it is cleared."""
    settings = {"MALLOC_TRIM_THRESHOLD_": "65536", "PATH": ""}
    command = [sys.executable, "-c", FAULTS]
    before, after = map(
        int, subprocess.run(command, env=settings, capture_output=True, text=True, check=True).stdout.split()
    )
    assert before > 20 * 380
    assert after < 100
