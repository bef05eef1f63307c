"""Times of methods that take turns on equal images in memory, in one thread.

    times = kept_times(context, plain, "as-written", ["CamShift"], ["hand"])
    times["hand"]["CamShift"] -> seconds per frame, shape (12,)

Times do not include run delay (`trackers.base.call_clock`). Other load then slows all methods
equally and hardly changes ratios of times. A paper's `timing.py` defines the methods and a table of
their times (`time_table`). Times are never judged.
"""

import json
import platform
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.evaluation.interleaved_timing import (
    Reference,
    one_thread,
    take_turns,
)
from trackmark.bench.evaluation.timed_clips import TurnTime, time_updates
from trackmark.bench.execution.pool import map_in_workers
from trackmark.bench.experiments.tracker_spec import BOXES, parse_tracker
from trackmark.bench.output_files import write_file
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.scene_values import cache_file
from trackmark.trackers.base.interface import Box, Image

ROUNDS = 12  # number of times of each method
SECONDS = 2.0  # minimum total time of the slowest method [s]
FRAMES = 20
STEADY_RATIO = 1.1  # of the median to the minimum time of `reference`, for times that are kept
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}

Values = NDArray[np.float64]

Times = dict[str, dict[str, Values]]
"""Seconds per frame by sequence and method, each of shape (`ROUNDS`,)."""

Methods = Mapping[str, Callable[[], Any]]
"""Functions that create timed objects with `init(image, box)` and `update(image)`, by name."""

MethodMaker = Callable[[Mapping[str, str]], Methods]

Excerpt = tuple[str, Sequence[Image], Box]
"""Name of a sequence, consecutive images, and the init box in the first image."""


def tracker_methods(specs: Mapping[str, str]) -> Methods:
    """Return trackers (specifications by name) as methods of the same names."""
    seed = np.random.SeedSequence(0)
    return {name: partial(parse_tracker(spec).make, seed) for name, spec in specs.items()}


def open_excerpts(
    name: str, scene: str, n_frames: int, stretches: int = 1, region: str = BOXES
) -> list[Excerpt]:
    """Render evenly spaced excerpts of a scene, each with the ground-truth box of its first image.

    There are `stretches` excerpts of `n_frames` images each, in addition to their first image. The
    boxes are those of the ground-truth region `region`.
    """
    sequence = datasets.load(scene)
    boxes = select_ground_truth(sequence, region, scene).boxes
    present = np.flatnonzero(np.isfinite(boxes).all(axis=1))
    latest = max(min(present[-1], len(sequence) - 1 - n_frames), present[0])
    starts = np.linspace(present[0], latest, stretches).astype(int)
    excerpts: list[Excerpt] = []
    for first in present[np.searchsorted(present, starts)].tolist():
        stop = min(first + n_frames + 1, len(sequence))
        excerpts.append((name, [sequence[frame] for frame in range(first, stop)], boxes[first]))
    return excerpts


class _TimedMethod:
    """Method that is timed in this process."""

    def __init__(self, make: Callable[[], Any], excerpts: Sequence[Excerpt]) -> None:
        self._excerpts = excerpts
        self._initialised = [make() for _ in excerpts]
        for method, (_, images, box) in zip(self._initialised, excerpts, strict=True):
            method.init(images[0], box)  # only once: initialisation can be slow
        self._method: Any = None

    def turn(self, index: int, start: int, stop: int) -> TurnTime:
        """Return the time of the updates on images `start` to `stop` of an excerpt.

        If `start` is 0, the method restarts from its state after `init`.
        """
        if start == 0:
            self._method = deepcopy(self._initialised[index])
        return time_updates(self._method, self._excerpts[index][1][start + 1 : stop + 1])


def turn_times(methods: Methods, excerpts: Sequence[Excerpt]) -> Times:
    """Time methods that take turns on excerpts, and the fixed work `reference`.

    The fastest pass of a round counts: other load can only slow a pass down.
    """
    makers = {**methods, "reference": Reference}
    frames = [len(images) - 1 for _, images, _ in excerpts]
    with one_thread():
        timed = [_TimedMethod(make, excerpts) for make in makers.values()]
        seconds, turns = take_turns([method.turn for method in timed], frames, 2 * ROUNDS, SECONDS)
    passes = seconds.shape[1] // ROUNDS
    rounds = seconds[:, : passes * ROUNDS].reshape(len(timed), ROUNDS, passes, len(turns))
    fastest, times = rounds.min(axis=2), {}
    for name in dict.fromkeys(name for name, *_ in excerpts):
        of_sequence = [excerpts[number][0] == name for number, *_ in turns]
        n = sum(len(images) - 1 for other, images, _ in excerpts if other == name)
        times[name] = dict(zip(makers, fastest[:, :, of_sequence].sum(axis=2) / n, strict=True))
    return times


def kept_times(
    context: Context,
    methods: MethodMaker,
    setting: str,
    names: Sequence[str],
    sequences: Sequence[str],
    n_frames: int = FRAMES,
    stretches: int = 1,
) -> Times:
    """Return times on the first scene of each sequence, cached or measured now.

    Times are cached in the report's folder until the timed code or the machine changes, provided
    that the time of `reference` was nearly equal in all rounds. `methods`: returns the methods for
    trackers, which are specifications by name. `names`, `sequences`: trackers with equal init
    regions and sequences, as named in `paper.toml`. `n_frames`, `stretches`: see `open_excerpts`.
    """
    specs = {name: context.paper.spec(name, setting) for name in names}
    scenes = {name: context.paper.sequences[name].scenes(1)[0][0] for name in sequences}
    versions = [parse_tracker(spec).version for spec in specs.values()]
    scene_versions = [
        (name, *datasets.name_and_fingerprint(scene)) for name, scene in scenes.items()
    ]
    machine = platform.platform(), platform.node()
    arguments = specs, versions, scene_versions, n_frames, stretches, machine
    file = cache_file(context.folder / "times", methods, *arguments)
    if file.is_file():
        return {
            sequence: {method: np.array(values) for method, values in by_method.items()}
            for sequence, by_method in json.loads(file.read_bytes()).items()
        }
    measure_all = partial(measure_scenes, methods, specs, n_frames=n_frames, stretches=stretches)
    times: Times
    (times,) = map_in_workers(measure_all, [scenes], 1, ONE_THREAD)
    reference: Values = np.sum([of_sequence["reference"] for of_sequence in times.values()], axis=0)
    if np.median(reference) <= STEADY_RATIO * reference.min():
        write_file(file, json.dumps(times, default=lambda values: values.tolist()))
    return times


def measure_scenes(
    methods: MethodMaker,
    specs: Mapping[str, str],
    scenes: Mapping[str, str],
    n_frames: int,
    stretches: int,
) -> Times:
    """Time methods on scenes, which are specifications by name of the sequence."""
    region = parse_tracker(next(iter(specs.values()))).init
    return turn_times(
        methods(specs),
        [
            excerpt
            for scene in scenes.items()
            for excerpt in open_excerpts(*scene, n_frames, stretches, region)
        ],
    )


def milliseconds(seconds: Values) -> str:
    """Return the median of times as text in milliseconds."""
    value = 1e3 * float(np.median(seconds))
    return f"{value:.{2 if abs(value) >= 0.1 else 3}f}"
