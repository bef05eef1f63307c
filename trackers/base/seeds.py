"""Seeds of runs."""

import zlib

import numpy as np


def run_seed(
    name: str, sequence: str, repetition: int, restarts: int = 0, base: int | None = None
) -> np.random.SeedSequence:
    """Return the seed of a run: it depends on tracker name, sequence name and repetition only.

    Trackers of equal name get the same random numbers. Other trackers have no influence. `restarts`
    is the number of trackers that the protocol has started earlier in the run. `base` selects other
    random numbers for all runs.
    """
    key = (zlib.crc32(name.encode()), zlib.crc32(sequence.encode()))
    entropy = repetition if base is None else [base, repetition]
    return np.random.SeedSequence(entropy, spawn_key=(*key, restarts) if restarts else key)
