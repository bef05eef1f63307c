"""The runs behind claims as a page's player shows them, with the frames that tell most."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from bench.pages.filming import Watch
from bench.pages.takes import Reading, Stored, scenes, taken
from bench.papers import Effort
from bench.papers.grounds import Ground
from bench.store.index import index_row
from bench.store.results import Results
from bench.store.truth import read_truth
from reports.page.page import Place, Scene

__all__ = ["Footage", "footage_of"]

MOST_FRAMES = 2400
"""Of a page: some ten megabytes."""

QUICK_SECONDS, SECONDS = 1.5, 20.0
"""What rendering frames may take, by what it took when the runs were made."""

_OPENING = 0.5  # seconds that opening a synthetic sequence takes, about: a tenth to one


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

    def place(self, run: str, kind: str, beside: Iterable[str] = ()) -> Place | None:
        """The worst frame of a run; trackers of the runs `beside` it are shown, too."""
        return _place(self.reading, self._known, run, kind, beside)


def footage_of(
    grounds: Mapping[str, Sequence[Ground]], results: Path, effort: Effort, watch: Watch
) -> Footage:
    """Read the runs that grounds name, and film their worst frames.

    Those of the scenes that speak most against each claim come first, then those of others, then
    their neighbours, as far as time and room go. Raises `ResultsError` for a file that can't be
    read.
    """
    every = [ground for found in grounds.values() for ground in found]
    files = {one.run: None for ground in every for _, row in ground.rows for one in row if one.run}
    known: dict[str, tuple[str, str]] = {}
    reading = taken(_stored(files, known), [])
    ranked = [
        (rank, _place(reading, known, one.run, ground.kind, ()))
        for ground in every
        for rank, (_, row) in enumerate(ground.rows)
        for one in row
        if one.run
    ]
    places = [place for _, place in sorted(ranked, key=lambda one: one[0]) if place]
    seconds = QUICK_SECONDS if effort.quick else SECONDS
    chosen = _chosen(reading, places, seconds)
    return Footage(
        reading, [*scenes(reading, str(results), watch, chosen=chosen)] if files else [], known
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
) -> Place | None:
    if run not in known:
        return None
    place = reading.place(*known[run], kind)
    shown = sorted({reading.trackers.index(known[one][0]) for one in beside if one in known})
    return place and place._replace(show=tuple(shown))


def _chosen(reading: Reading, places: Sequence[Place], seconds: float) -> list[list[int]]:
    """Frames of each sequence: those of the places, and ever more around them."""
    chosen: list[set[int]] = [set() for _ in reading.stages]
    longest = max((len(reading.stages[one.sequence].truth) for one in places), default=0)
    left = MOST_FRAMES
    for reach in range(longest):
        before, refused = left, False
        for place in places:
            stage, its = reading.stages[place.sequence], chosen[place.sequence]
            for frame in {place.frame - reach, place.frame + reach} - its:
                cost = (stage.row["frame_seconds"] or 0.0) + (0.0 if its else _OPENING)
                if not 0 <= frame < len(stage.truth):
                    continue
                if cost > seconds or not left:
                    refused = True
                    continue
                its.add(frame)
                seconds -= cost
                left -= 1
        if refused and left == before:
            break
    return [sorted(one) for one in chosen]
