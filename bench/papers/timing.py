"""Times: of timing runs, and of methods that take turns on the same images in memory.

Ratios between methods come from turns alone, with an interval over rounds of them; a reference that
takes turns, too, tells how the machine was. All are CPU times on one thread, warm where nothing
else is said (`bench.metrics.times`).
"""

import hashlib
import inspect
import json
import platform
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from copy import deepcopy
from functools import partial
from math import exp, nan
from pathlib import Path
from time import thread_time
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

import datasets
import trackers
from bench.evaluation.record import Run
from bench.evaluation.reference import reference
from bench.evaluation.turns import Reference, one_thread, take_turns
from bench.experiments.contestant import BOXES, contestant, run_seed
from bench.experiments.experiment import read_experiment
from bench.metrics.times import DISTURBED_RATIO
from bench.papers.context import Context
from bench.statistics.intervals import mean_interval
from bench.store.files import write_atomically
from bench.store.layout import Cell, run_path
from bench.store.loading import load_results
from bench.store.results import Results
from datasets.source_digest import source_digest
from trackers.base.interface import Box, Image

__all__ = [
    "Clips",
    "beginning",
    "failed_passes",
    "frame_times",
    "geometric_mean",
    "kept_times",
    "runs_lacking",
    "slope",
    "tracker_times",
    "turn_times",
]

PACKAGE = Path(str(trackers.__file__)).parent
ROUNDS = 12
"""Over which an interval is taken; see `turn_times`."""

SECONDS = 0.5
"""That the slowest method takes at least in all rounds."""

FRAMES = 40

Clips: TypeAlias = Mapping[str, tuple[Any, ...]]
"""By name the images, the target's box in the first of them, and its mask where one is given."""


def frame_times(
    folder: Path, cells: Collection[Cell] | None = None, details: Collection[str] = ()
) -> pd.DataFrame:
    """CPU times of every frame of the timing runs of an experiment.

    Parameters
    ----------
    folder : Path
        Results of the timing experiment.
    cells : collection of Cell, optional
        The runs that are meant; all by default.
    details : collection of str
        Of the tracker, which stand beside.

    Returns
    -------
    DataFrame
        `tracker` (its label), `sequence`, `repetition`, `disturbed` (1: by other load), `frame`,
        `seconds` (warm; NaN in runs that were stored before these were taken), `decoded` (seconds
        as decoded) and the details.
    """
    columns = ["tracker", "sequence", "repetition", "disturbed", "frame", "seconds", "decoded"]
    columns += details
    pieces = [pd.DataFrame(columns=columns)]
    for run, load in _passes(folder, cells):
        if run.times is None:
            continue
        key, timed = run.identity, np.flatnonzero(np.isfinite(run.times.cpu))
        warm = np.full(len(run.boxes), nan) if run.times.warm_cpu is None else run.times.warm_cpu
        known = {"frame": timed, "seconds": warm[timed], "decoded": run.times.cpu[timed]}
        rows = pd.DataFrame(known | {name: run.details[name][timed] for name in details})
        rows = rows.assign(tracker=key.tracker, sequence=key.sequence, repetition=key.repetition)
        pieces.append(rows.assign(disturbed=load)[columns])
    return pd.concat(pieces[1:] or pieces, ignore_index=True)


def _passes(folder: Path, cells: Collection[Cell] | None) -> Iterator[tuple[Run, int]]:
    """Finished timing runs, and whether load disturbed them."""
    results, runs = Results(folder), load_results(folder, cells)
    for _, run in runs[runs["status"] == "finished"].iterrows():
        path = run_path(run["tracker"], run["sequence"], run["repetition"], run["protocol"])
        yield results.read(folder / path), run["disturbed"]


def runs_lacking(folder: Path, cells: Collection[Cell] | None = None) -> list[str]:
    """What a reader must know of timing runs: the machine's state, and times that there are not."""
    runs = list(_passes(folder, cells))
    told = [one for run, _ in runs for one in run.circumstances.get("reference_seconds", ())]
    found = []
    if told:
        low, middle, high = (1e3 * q for q in np.quantile(told, [0, 0.5, 1]))
        words = f"{middle:.2f} ms beside the timing runs ({low:.2f} to {high:.2f})"
        found.append(f"{folder.name}: the reference kernel took {words}.")
    if all(disturbed for _, disturbed in runs):
        found.append(f"{folder.name}: other load disturbed every run; time again when idle.")
    if any(run.times is not None and run.times.warm_cpu is None for run, _ in runs):
        found.append(f"{folder.name}: some runs have no warm times yet; remove them and run again.")
    return found


def failed_passes(folder: Path, cells: Collection[Cell] | None = None) -> list[str]:
    """Timing runs that failed, each in a line with the reason."""
    runs = load_results(folder, cells)
    return [
        f"failed: {run['tracker']} on {run['sequence']}, repetition {run['repetition']}: "
        + str(run["failure"]).partition("\n")[0]
        for _, run in runs[runs["status"] == "failed"].iterrows()
    ]


def beginning(name: str, frames: int, region: str = BOXES) -> tuple[list[Image], Box]:
    """The first image with the target and as many more as there are of `frames`, and its box."""
    sequence = datasets.load(name)
    first = sequence.first_frame
    stop = min(first + frames + 1, len(sequence))
    box = reference(sequence, region, name).boxes[first]
    return [sequence[frame] for frame in range(first, stop)], box


class _Shown:
    """A method that is shown clips, in this process."""

    def __init__(self, make: Callable[[], Any], clips: Sequence[tuple[Any, ...]]) -> None:
        self._images = [images for images, *_ in clips]
        self._begun = []  # once: to begin may take as long as many updates
        for images, *given in clips:
            self._begun.append(method := make())
            method.init(images[0], *given)
        self._method: Any = None

    def turn(self, number: int, start: int, stop: int) -> float:
        """See `bench.evaluation.turns.Side`."""
        if start == 0:
            self._method = deepcopy(self._begun[number])
        update, shown = self._method.update, self._images[number][start + 1 : stop + 1]
        began = thread_time()
        for image in shown:
            update(image)
        return thread_time() - began


def turn_times(methods: Mapping[str, Callable[[], Any]], clips: Clips) -> pd.DataFrame:
    """What updates cost by methods that take turns on clips.

    Other load only ever adds to a turn's time: of two or more passes in a round the least stands
    for it. Where code and data come to lie in memory, a per cent, stays the same in all rounds.

    Parameters
    ----------
    methods : mapping of str to callable
        Each makes what is timed: `init(image, box)`, or with a mask, and `update(image)`.
    clips : Clips
        What they are shown.

    Returns
    -------
    DataFrame
        A row a clip and round: `sequence` (the clip's name), `round`, seconds a frame by method,
        and of `reference`.
    """
    labels = [*methods, "reference"]
    sides = [_Shown(make, [*clips.values()]) for make in (*methods.values(), Reference)]
    frames = [len(images) - 1 for images, *_ in clips.values()]
    with one_thread():
        seconds, turns = take_turns(sides, frames, 2 * ROUNDS, SECONDS)
    a_round = seconds.shape[1] // ROUNDS
    rounds = seconds[:, : a_round * ROUNDS].reshape(len(sides), ROUNDS, a_round, len(turns))
    least, owners = rounds.min(axis=2), np.array([number for number, *_ in turns])
    return pd.concat(
        [
            pd.DataFrame(least[..., owners == number].sum(axis=-1).T / frames[number])
            .set_axis(labels, axis=1)
            .assign(sequence=name, round=np.arange(ROUNDS))
            for number, name in enumerate(clips)
        ],
        ignore_index=True,
    )


def kept_times(
    context: Context,
    measure: Callable[..., pd.DataFrame],
    names: Sequence[str],
    *texts: str,
    frames: int = FRAMES,
) -> pd.DataFrame:
    """Times of `measure(names, frames, *texts)` of now, or of before on this machine.

    `names` are sequences, `texts` trackers that the module of `measure` does not name. Times are
    kept beside the report until what is timed changes, if the machine was quiet: what the
    `reference` took then was nearly the same in all rounds. Otherwise the next call measures anew.
    """
    source = source_digest(Path(inspect.getfile(measure)), PACKAGE)
    shown: list[Any] = [[name, datasets.load(name).fingerprint] for name in names]
    shown += [[text, contestant(text).version] for text in texts]
    machine = [platform.platform(), platform.node()]
    identity = [measure.__name__, shown, source, machine, frames]
    key = hashlib.sha256(json.dumps(identity).encode()).hexdigest()[:16]
    file = context.folder / "times" / f"{key}.json"
    if file.is_file():
        return pd.DataFrame(json.loads(file.read_bytes()))
    times = measure(names, frames, *texts)
    if times["reference"].median() <= DISTURBED_RATIO * times["reference"].min():
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(file, json.dumps(times.to_dict("list")).encode())
    return times


def geometric_mean(values: ArrayLike) -> dict[str, float]:
    """`ratio`, their geometric mean, with the limits `low` and `high` of its 95 % interval."""
    logs = np.log(np.asarray(values, np.float64))
    low, high = mean_interval(logs)
    return {"ratio": exp(logs.mean()), "low": exp(low), "high": exp(high)}


def tracker_times(context: Context, name: str, frames: int = FRAMES) -> pd.DataFrame:
    """Times of the trackers of a timing experiment, a row a tracker and sequence.

    Parameters
    ----------
    context : Context
        With the timing runs.
    name : str
        Of the experiment, as the paper's description names it.
    frames : int
        Of each sequence's beginning, on which trackers take turns.

    Returns
    -------
    DataFrame
        `tracker`, `text` (its label), `sequence`; seconds a frame of timing runs that no load
        disturbed, medians over frames: `seconds` (warm), `decoded`; of turns on the sequence's
        beginning, its time over that of the experiment's first tracker: `ratio`, `low`, `high`;
        and seconds a call of the `reference` in these turns, with `load`, how much longer that
        took in the slowest round than in the fastest.
    """
    full = context.description.experiment(name)
    cells = context.asked.get(full, ())
    runs = frame_times(context.results / full, cells)
    quiet = runs[runs["disturbed"] == 0].groupby(["tracker", "sequence"])
    medians = quiet[["seconds", "decoded"]].median()
    texts, rows = list(read_experiment(full).trackers), []
    labels = [contestant(text).label for text in texts]
    for sequence in sorted({cell[1] for cell in cells}):
        times = kept_times(context, times_of_trackers, [sequence], *texts, frames=frames)
        machine = times["reference"]
        for label in labels:
            known = {"tracker": label.partition(":")[0], "text": label, "sequence": sequence}
            seconds = medians.reindex([(label, sequence)]).iloc[0]
            state = {"reference": machine.median(), "load": machine.max() / machine.min()}
            rows.append({**known, **seconds, **geometric_mean(times[label] / times[labels[0]])})
            rows[-1] |= state
    return pd.DataFrame(rows)


def times_of_trackers(names: Sequence[str], frames: int, *texts: str) -> pd.DataFrame:
    """Times of trackers in turns on the beginning of a sequence, by their labels."""
    (name,), chosen = names, [contestant(text) for text in texts]
    images, box = beginning(name, frames, chosen[0].init)  # of all
    sequence = datasets.load(name)
    mask = sequence.mask(sequence.first_frame)
    makers = {one.label: partial(one.make, run_seed(one.name, name, 0)) for one in chosen}
    return turn_times(makers, {name: (images, box, mask)})


def slope(values: "pd.Series[float]", seconds: "pd.Series[float]") -> dict[str, float]:
    """What the time grows by with each one more.

    Returns
    -------
    dict of str to float
        `slope` of the line through the times, `lower_limit` and `upper_limit` of its 95 %
        interval [seconds], of so many `degrees` of freedom, and `r_squared`.
    """
    from scipy.special import stdtrit
    from scipy.stats import linregress

    line = linregress(values.to_numpy(float), seconds.to_numpy(float))
    half = float(stdtrit(len(values) - 2, 0.975)) * line.stderr
    return {
        "slope": line.slope,
        "lower_limit": line.slope - half,
        "upper_limit": line.slope + half,
        "degrees": len(values) - 2,
        "r_squared": line.rvalue**2,
    }
