"""What can be said of a scene without a filter: is the target separable, what the switch picks.

It is settled before any tracker runs. The **gate**: a scene is kept if, under the better of
the two representations, the target at its true box is nearer to the first frame's model than
the best clutter within three widths, in at least 80 % of 50 or more unoccluded frames. Scenes
that are not kept are run and shown all the same; verdicts are given for the kept ones and for
all. The **switch**: d[p1, p2] (Eq. 7) of the first frame's rectangle under its three readings,
and of rectangles that differ from it as a user's hand might.
"""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import datasets
from bench.evaluation.reference import reference
from bench.papers.examination import examined
from bench.papers.multipart.appearance import Appearance, part_distance, states_of
from bench.store.files import write_atomically

__all__ = [
    "FRAMES",
    "INITIAL",
    "JITTERS",
    "KEPT_SHARE",
    "LOG",
    "THRESHOLD",
    "Scene",
    "clutter_states",
    "examine",
    "examine_all",
    "jittered",
    "read_log",
    "separability",
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

LOG = Path(__file__).with_name("scenes.csv")
"""What was found of the scenes that the tables draw, with the version that it was found of."""


@dataclass(frozen=True)
class Scene:
    """What was found of a scene.

    Attributes
    ----------
    sequence : str
        Canonical name.
    fingerprint : str
        Version of the sequence that was examined.
    frames : int
        Unoccluded frames that were examined.
    single, multi : float
        Share of them in which the true box was nearer to the model than the best clutter.
    distance_full, distance_body, distance_tight : float
        d[p1, p2] of the first frame's rectangle.
    multi_full, multi_body, multi_tight : float
        Share of jittered rectangles of which the switch picks the multi-part histogram.
    """

    sequence: str
    fingerprint: str
    frames: int
    single: float
    multi: float
    distance_full: float
    distance_body: float
    distance_tight: float
    multi_full: float
    multi_body: float
    multi_tight: float

    @property
    def kept(self) -> bool:
        """Whether the scene passes the gate."""
        return self.frames >= FRAMES and max(self.single, self.multi) >= KEPT_SHARE


def examine(name: str) -> Scene:
    """Examine a sequence of walking persons; renders `FRAMES` + 1 of its frames."""
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
    return Scene(sequence.name, sequence.fingerprint, frames, single, multi, **distances, **shares)


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


def examine_all(names: Sequence[str], folder: Path, jobs: int) -> dict[str, Scene]:
    """Look scenes up in the log, examine those it does not know, and write them to a folder.

    Parameters
    ----------
    names : sequence of str
        Names of sequences.
    folder : Path
        Gets `scenes.csv`; what an earlier call left there is looked up too.
    jobs : int
        Worker processes.

    Returns
    -------
    dict of str to Scene
        By canonical name.
    """
    known = {**read_log(LOG), **read_log(folder / LOG.name)}
    opened = [datasets.load(name) for name in names]
    scenes = {
        sequence.name: known[sequence.fingerprint]
        for sequence in opened
        if sequence.fingerprint in known
    }
    left = [sequence.name for sequence in opened if sequence.name not in scenes]
    try:
        title = "Scenes examined before any tracker runs"
        for _, scene in examined(examine, left, jobs, title):
            scenes[scene.sequence] = scene
    finally:  # also on Ctrl-C: what was examined is not examined again
        write_log(folder / LOG.name, [scenes[name] for name in sorted(scenes)])
    return scenes


def read_log(path: Path) -> dict[str, Scene]:
    """Scenes of a log by fingerprint; none where there is no log."""
    if not path.is_file():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {row["fingerprint"]: _scene(row) for row in rows}


def _scene(row: dict[str, str]) -> Scene:
    values: dict[str, Any] = {}
    for field in fields(Scene):
        text = row[field.name]
        values[field.name] = text if field.type is str else field.type(text)  # type: ignore[operator]  # float or int
    return Scene(**values)


def write_log(path: Path, scenes: Iterable[Scene]) -> None:
    """Write a log: CSV with a line a scene, and whether it is kept for the reader's sake."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [*(field.name for field in fields(Scene)), "kept"])
    writer.writeheader()
    for scene in scenes:
        writer.writerow({**asdict(scene), "kept": "yes" if scene.kept else "no"})
    write_atomically(path, text.getvalue().encode())
