"""Description of the machine, without which times mean nothing."""

import os
import platform
from functools import cache
from pathlib import Path


@cache
def machine_name() -> str:
    """Return processor and number of cores of this machine: `AMD EPYC 7B13, 2 cores`."""
    cores = os.cpu_count() or 1
    return f"{_processor()}, {cores} core{'s' * (cores > 1)}"


def _processor() -> str:
    """Return the model of the processor, or else its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8", "replace").splitlines()
    except OSError:  # not Linux
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return " ".join(next(filter(None, models), platform.processor() or platform.machine()).split())
