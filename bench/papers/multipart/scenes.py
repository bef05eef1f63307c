"""What can be said of a scene without a filter: is the target separable, what the switch picks.

It is settled before any tracker runs. The **gate**: a scene is kept if, under the better of
the two representations, the target at its true box is nearer to the first frame's model than
the best clutter within three widths, in at least 80 % of 50 or more unoccluded frames. As many
scenes are drawn as it takes for enough to be kept (`drawing.py`); the others are run under `--all`,
and verdicts are then given for the kept ones and for all. The **switch**: d[p1, p2] (Eq. 7) of the
first frame's rectangle under its three readings, and of rectangles that differ from it as a user's
hand might.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
from bench.evaluation.reference import reference
from bench.papers.scenes import examined
from bench.store.files import write_atomically
from datasets.text_form import parse_text
from trackers.base.interface import Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import N_BINS, LuvBins
from trackers.histograms.counting import region_counts
from trackers.histograms.rectangles import bhattacharyya_distances, pixel_regions
from trackers.multipart import LEAST_PIXELS, LEAST_SHARE

__all__ = [
    "INITIAL",
    "KEPT_SHARE",
    "LOG",
    "THRESHOLD",
    "Appearance",
    "examined_scene",
    "kept",
    "measured",
    "passes",
    "read_log",
    "states_of",
    "write_log",
]

INITIAL = {"full": "full", "boxes": "body", "tight": "tight"}
"""What is meant by the object's rectangle, by the name of the sequence's truth."""

THRESHOLD = 0.4  # T of Eq. 7
KEPT_SHARE = 0.8
FRAMES = 50
WIDTHS = 3
UNOCCLUDED = 0.95  # visible fraction from which a frame is examined
JITTERS = 200
JITTER = 0.05  # of the rectangle's sides
_STEPS_A_WIDTH = 8  # of the grid of clutter
_EVERY_BIN = np.arange(N_BINS)

LOG = Path(__file__).with_name("scenes.csv")
"""What was found of the scenes that the tables draw, with the version that it was found of."""


def measured(names: Sequence[str], folder: Path, jobs: int) -> dict[str, pd.DataFrame]:
    """Look scenes up in the log, examine those it does not know, and write them to a folder.

    Parameters
    ----------
    names : sequence of str
        Names of sequences of walking persons.
    folder : Path
        Gets `scenes.csv`; what an earlier call left there is looked up too.
    jobs : int
        Worker processes.

    Returns
    -------
    dict of str to DataFrame
        `static`, a row a scene: `name` (canonical), `fingerprint`, `frames` (unoccluded ones that
        were examined), `single` and `multi` (share of them in which the true box was nearer to the
        model than the best clutter), of each of `INITIAL` `distance_<initial>` (d[p1, p2] of the
        first rectangle) and `multi_<initial>` (share of jittered ones of which the switch picks
        the multi-part histogram), `kept_scene`. `switch`, a row a scene and first rectangle:
        `sequence`, `scene`, `init`, `initial`, `kept_scene`, `distance`, `multi_share`.
    """
    known = pd.concat([read_log(LOG), read_log(folder / LOG.name)])
    opened = dict(map(datasets.identity, names))
    there = known[known["fingerprint"].isin(opened.values())].drop_duplicates("fingerprint")
    rows: list[Any] = there.to_dict("records")
    left = sorted(set(opened) - {row["name"] for row in rows})
    try:
        title = "Scenes examined before any tracker runs"
        rows += [row for _, row in examined(examined_scene, left, jobs, title)]
    finally:  # also on Ctrl-C: what was examined is not examined again
        found = pd.DataFrame(rows).sort_values("name", ignore_index=True)
        write_log(folder / LOG.name, found)
    found = found.assign(kept_scene=passes(found))
    return {"static": found, "switch": _switch(found)}


def kept(tables: Mapping[str, pd.DataFrame]) -> dict[str, bool]:
    """Whether the gate keeps a scene, by its name."""
    return dict(zip(tables["static"]["name"], tables["static"]["kept_scene"], strict=True))


def read_log(path: Path) -> pd.DataFrame:
    """Scenes of a log, a row each; nothing where there is none."""
    if not path.is_file():
        return pd.DataFrame()
    log = pd.read_csv(path, dtype=str).drop(columns="kept", errors="ignore")
    log = log.rename(columns={"sequence": "name"})  # as older logs have it
    numbers = [column for column in log if column not in ("name", "fingerprint")]
    for column in numbers:
        log[column] = log[column].map(float)  # exactly
    return log


def write_log(path: Path, scenes: pd.DataFrame) -> None:
    """Write a log; whether the gate keeps a scene is said for the reader's sake."""
    log = scenes.assign(kept=passes(scenes).map({True: "yes", False: "no"}))
    write_atomically(path, log.to_csv(index=False).encode())


def passes(scenes: pd.DataFrame) -> "pd.Series[bool]":
    """Whether the gate keeps each scene of a log."""
    better = scenes[["single", "multi"]].max(axis=1)
    return (scenes["frames"] >= FRAMES) & (better >= KEPT_SHARE)


def _switch(scenes: pd.DataFrame) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "sequence": scene["name"].partition(":")[0],
            "scene": int(parse_text(scene["name"])[1].get("scene", 0)),
            "init": init,
            "initial": initial,
            "kept_scene": scene["kept_scene"],
            "distance": scene[f"distance_{initial}"],
            "multi_share": scene[f"multi_{initial}"],
        }
        for scene in scenes.to_dict("records")
        for init, initial in INITIAL.items()
    )


def examined_scene(name: str) -> dict[str, str | float]:
    """Examine a scene, for a row of the log; renders `FRAMES` + 1 frames."""
    sequence = datasets.load(name)
    first = sequence.first_frame
    image = sequence[first]
    generator = np.random.default_rng(0)
    distances, shares = {}, {}
    for region, initial in INITIAL.items():
        box = reference(sequence, region, name).boxes[first]
        distances[f"distance_{initial}"] = part_distance(image, box)
        halves = [part_distance(image, other) for other in jittered(box, generator)]
        shares[f"multi_{initial}"] = float(np.mean(np.array(halves) > THRESHOLD))
    frames, single, multi = separability(sequence)
    labels = {"name": sequence.name, "fingerprint": sequence.fingerprint}
    return {**labels, "frames": frames, "single": single, "multi": multi, **distances, **shares}


def separability(sequence: datasets.Sequence) -> tuple[int, float, float]:
    """Frames examined, and in what share of them the truth beats the clutter, by both."""
    first = sequence.first_frame
    clear = np.flatnonzero(sequence.present & (sequence.visibility >= UNOCCLUDED))
    clear = clear[clear > first]
    chosen = np.unique(clear[np.linspace(0, len(clear) - 1, FRAMES).round().astype(int)])
    model = Appearance(sequence[first], sequence.boxes[first])
    nearer = []
    for frame in chosen.tolist():
        box = sequence.boxes[frame]
        clutter = clutter_states(box, sequence.regions["full"][frame])
        states = np.vstack([states_of(box[np.newaxis]), clutter])
        both = model.distances(sequence[frame], states)
        nearer.append([values[0] < values[1:].min() for values in both])
    single, multi = np.mean(nearer, axis=0).tolist()
    return len(chosen), single, multi


def clutter_states(box: NDArray[np.float64], whole: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rectangles of a box's size within three widths of it that a score would call a miss.

    Parameters
    ----------
    box : ndarray of float64, shape (4,)
        The true box, in pixels.
    whole : ndarray of float64, shape (4,)
        The whole person: a centre in it counts as on the target.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Centre x, y [pixels] and area [pixels²], on a grid of an eighth of the width.
    """
    centre = box[:2] + box[2:] / 2
    offsets = np.arange(-WIDTHS * _STEPS_A_WIDTH, WIDTHS * _STEPS_A_WIDTH + 1) / _STEPS_A_WIDTH
    x, y = np.meshgrid(centre[0] + offsets * box[2], centre[1] + offsets * box[2])
    inside = (whole[0] <= x) & (x <= whole[0] + whole[2])
    inside &= (whole[1] <= y) & (y <= whole[1] + whole[3])
    x, y = x[~inside], y[~inside]
    return np.column_stack([x, y, np.full(len(x), box[2] * box[3])])


def jittered(
    box: NDArray[np.float64], generator: np.random.Generator
) -> Iterator[NDArray[np.float64]]:
    """Rectangles as a hand would draw them again: place and sides off by up to 5 %."""
    x, y, width, height = box
    for shift_x, shift_y, wider, higher in generator.uniform(-JITTER, JITTER, (JITTERS, 4)):
        yield np.array(
            [x + shift_x * width, y + shift_y * height, width * (1 + wider), height * (1 + higher)]
        )


def states_of(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Centre x, y [pixels] and area [pixels²] of boxes, shape (n, 3) from (n, 4)."""
    centres = boxes[:, :2] + boxes[:, 2:] / 2
    return np.column_stack([centres, boxes[:, 2] * boxes[:, 3]])


def part_distance(image: Image, box: NDArray[np.float64]) -> float:
    """d[p1, p2] of a box's upper and lower half (Eq. 7)."""
    counts, totals = _counts(image, states_of(box[np.newaxis]), box[2] / box[3])
    distances = bhattacharyya_distances(counts[0], totals[0], counts[1, 0], int(totals[1, 0]))
    return float(distances[0])


class Appearance:
    """Histograms of a box, whole and by halves, and distances of other rectangles to them.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        BGR.
    box : ndarray of float64, shape (4,)
        In pixels.
    """

    def __init__(self, image: Image, box: NDArray[np.float64]) -> None:
        self._aspect = float(box[2] / box[3])
        counts, totals = _counts(image, states_of(box[np.newaxis]), self._aspect)
        self._counts, self._totals = counts[:, 0], totals[:, 0]

    def distances(
        self, image: Image, states: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distances of rectangles of the box's aspect: to the whole, and by halves (Eq. 1, 2).

        Parameters
        ----------
        image : ndarray of uint8, shape (height, width, 3)
            BGR.
        states : ndarray of float64, shape (n, 3)
            Centre x, y [pixels] and area [pixels²].

        Returns
        -------
        single, multi : ndarray of float64, shape (n,)
            1 where too little of a rectangle is in the image.
        """
        counts, totals = _counts(image, states, self._aspect)
        single = bhattacharyya_distances(
            counts.sum(axis=0, dtype=np.int32),
            totals.sum(axis=0),
            self._counts.sum(axis=0, dtype=np.int32),
            int(self._totals.sum()),
        )
        halves = [
            bhattacharyya_distances(counts[part], totals[part], reference, int(total))
            for part, (reference, total) in enumerate(zip(self._counts, self._totals, strict=True))
        ]
        return single, (halves[0] + halves[1]) / 2


def _counts(
    image: Image, states: NDArray[np.float64], aspect: float
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Votes by half, rectangle and bin, and their sums."""
    height, width = image.shape[:2]
    regions = pixel_regions(states, aspect, 2, width, height, LEAST_SHARE, LEAST_PIXELS)
    colours = LuvBins()
    counts = region_counts(SharedFrame(image), regions, colours, _EVERY_BIN)
    return counts, regions.pixels * colours.votes_a_pixel
