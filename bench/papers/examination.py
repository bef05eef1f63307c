"""Examining scenes one by one in processes of their own, before or beside the trackers' runs."""

import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from typing import TypeVar

__all__ = ["examined"]

T = TypeVar("T")
R = TypeVar("R")


def examined(
    function: Callable[[T], R], scenes: Sequence[T], jobs: int, title: str
) -> Iterator[tuple[T, R]]:
    """What a function says of each scene, as it comes; with a progress bar.

    Parameters
    ----------
    function : callable
        Takes one scene; it and what it gives can be pickled.
    scenes : sequence
        What it is asked of.
    jobs : int
        Worker processes.
    title : str
        Of the bar.
    """
    from loky import ProcessPoolExecutor
    from tqdm import tqdm

    if not scenes:
        return
    executor = ProcessPoolExecutor(max_workers=min(jobs, len(scenes)))
    with warnings.catch_warnings():
        # Workers keep textures of the scenes that they saw; loky replaces those that grow.
        warnings.filterwarnings("ignore", "A worker was restarted", UserWarning)
        try:
            futures = {executor.submit(function, scene): scene for scene in scenes}
            ended = as_completed(futures)
            for future in tqdm(ended, title, len(futures), unit="scene", disable=None, delay=1.0):
                yield futures[future], future.result()
        finally:
            executor.shutdown(wait=True, kill_workers=True)
