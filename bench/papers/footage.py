"""The runs behind claims as a page's player shows them, with the frames that tell most."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from bench.evaluation.record import Trace
from bench.pages.filming import Watch
from bench.pages.takes import Reading, Stored, scenes, taken
from bench.papers import Effort
from bench.papers.grounds import Ground
from bench.store.index import index_row
from bench.store.results import Results
from bench.store.truth import read_truth
from reports.page.content import Place, Scene

__all__ = ["Footage", "footage_of"]

MOST_FRAMES = 2400
"""Of a page: some ten megabytes."""

QUICK_SECONDS, SECONDS = 1.0, 20.0
"""What rendering further frames may take, by what it took when the runs were made."""

NEAR = 2
"""Frames before and after the worst ones of each test's first scene that are kept anyhow."""


@dataclass(frozen=True)
class Footage:
    """Where numbers lead to, by the file of their run and what makes a frame the worst one."""

    reading: Reading
    scenes: Sequence[Scene]
    _known: Mapping[str, tuple[str, str]]  # tracker and sequence of a run, by its file

    @property
    def frames(self) -> int:
        """How many there are."""
        return sum(len(chunk) for scene in self.scenes for chunk in scene.thumbnails)

    def place(
        self, run: str, kind: str, beside: Iterable[str] = (), trace: Trace = "online"
    ) -> Place | None:
        """The worst frame of a run by a trace; trackers of the runs `beside` it are shown, too."""
        return _place(self.reading, self._known, run, kind, beside, trace)

    def worst(self, runs: Iterable[str], kind: str) -> Place | None:
        """The worst frame that is there of those runs that claims rest on; None for none."""
        found = {self._known[run] for run in runs if run in self._known}
        return self.reading.worst_of(sorted(found), kind, self._is_there)

    def _is_there(self, place: Place) -> bool:
        scene = self.scenes[place.sequence]
        return bool(scene.thumbnails) and (scene.kept is None or place.frame in scene.kept)


def footage_of(
    grounds: Mapping[str, Sequence[Ground]], results: Path, effort: Effort, watch: Watch
) -> Footage:
    """Read the runs that grounds name, and film their worst frames.

    All of these are there, whatever they take, and of the scenes that speak most against each claim
    the frames before and after; then what is around them, as far as time and room go. Raises
    `ResultsError` for a file that can't be read.
    """
    every = [ground for found in grounds.values() for ground in found]
    files = {one.run: None for ground in every for _, row in ground.rows for one in row if one.run}
    known: dict[str, tuple[str, str]] = {}
    reading = taken(_stored(files, known), [])
    ranked = [
        (rank, _place(reading, known, one.run, ground.kind, (), one.trace))
        for ground in every
        for rank, (_, row) in enumerate(ground.rows)
        for one in row
        if one.run
    ]
    ranked.sort(key=lambda one: one[0])
    places = [place for _, place in ranked if place]
    first = [place for rank, place in ranked if place and not rank]
    chosen = _Chosen(reading, QUICK_SECONDS if effort.quick else SECONDS)
    chosen.add(places, 0, free=True)
    chosen.add(first, NEAR, free=True)
    chosen.add(places, max((len(stage.truth) for stage in reading.stages), default=0))
    return Footage(
        reading,
        [*scenes(reading, str(results), watch, chosen=chosen.frames)] if files else [],
        known,
    )


def _stored(files: Iterable[str], known: dict[str, tuple[str, str]]) -> Iterator[Stored]:
    truth = cache(read_truth)
    for name in files:
        file = Path(name)
        results = Results(file.parent.parent.parent)
        run = results.read(file)
        stored = truth(results.folder, run.identity.sequence, run.identity.fingerprint)
        row = index_row(results, file, run, stored)
        known[name] = str(row["tracker"]), str(row["sequence"])
        source = row["source"] or row["sequence"]  # a scene's name says all of it
        yield row | {"source": source}, run, stored


def _place(
    reading: Reading,
    known: Mapping[str, tuple[str, str]],
    run: str,
    kind: str,
    beside: Iterable[str],
    trace: Trace,
) -> Place | None:
    if run not in known:
        return None
    place = reading.place(*known[run], kind, trace)
    shown = sorted({reading.trackers.index(known[one][0]) for one in beside if one in known})
    return place and place._replace(show=tuple(shown))


class _Chosen:
    """Frames of each sequence, as many, beside free ones, as there are room and seconds for."""

    def __init__(self, reading: Reading, seconds: float) -> None:
        self._stages, self._seconds = reading.stages, seconds
        self._chosen: list[set[int]] = [set() for _ in reading.stages]
        self._left = MOST_FRAMES

    @property
    def frames(self) -> list[list[int]]:
        """Their numbers, sorted, by sequence."""
        return [sorted(one) for one in self._chosen]

    def add(self, places: Sequence[Place], most: int, *, free: bool = False) -> None:
        """Choose the frames of places, and ever more around them, at most so many away."""
        for reach in range(most + 1):
            before, refused = self._left, False
            for place in places:
                stage, its = self._stages[place.sequence], self._chosen[place.sequence]
                cost = 0.0 if free else stage.row["frame_seconds"] or 0.0
                for frame in {place.frame - reach, place.frame + reach} - its:
                    if not 0 <= frame < len(stage.truth):
                        continue
                    if not free and (cost >= self._seconds or self._left <= 0):
                        refused = True
                        continue
                    its.add(frame)
                    self._seconds -= cost
                    self._left -= 1
            if refused and self._left == before:
                break
