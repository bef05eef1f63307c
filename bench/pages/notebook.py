"""Player of the frames of stored results, in a notebook."""

import html
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Protocol

from trackmark import datasets
from trackmark.bench.protocols import STORED_ONE_PASS
from trackmark.bench.store import data_frames
from trackmark.bench.store.layout import experiment_folders
from trackmark.datasets import Sequence
from trackmark.reports.files import write_file
from trackmark.reports.temporary_paths import temporary_folder

_PLAYER_HEIGHT = 780  # CSS pixels


class StoredResults(Protocol):
    """Results with a folder, for example `bench.api.results.Results`."""

    @property
    def stored_folder(self) -> Path: ...  # noqa: D102  # folder of the runs


class SequencePlayer:
    """Player of the frames of one sequence, for a notebook or a file.

    `page`: HTML of a page that needs no other files.
    """

    def __init__(self, page: str) -> None:
        self.page = page

    def save(self, path: str | Path) -> None:
        """Write the page to a file; raise `OSError` if it cannot be written."""
        write_file(Path(path), lambda file: file.write_text(self.page, encoding="utf-8"))

    def _repr_html_(self) -> str:
        """Return the page in a frame whose scripts cannot access the notebook."""
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" title="Player" loading="lazy" '
            'sandbox="allow-scripts allow-downloads" allow="clipboard-write; fullscreen" '
            f'style="width: 100%; height: {_PLAYER_HEIGHT}px; border: 0"></iframe>'
        )


def player(
    results: str | Path | StoredResults,
    sequence: str | Path | Sequence,
    frame: int | None = None,
    tracker: str | None = None,
    repetition: int = 0,
) -> SequencePlayer:
    """Return a player of a sequence with the boxes of all trackers that ran on it by one-pass.

    Parameters
    ----------
    results : path or Results
        Folder of results, or results of `evaluate`, `run` or `load_results`.
    sequence : str, Path or Sequence
        Name in the results or its last part, specification, path, or the sequence.
    frame : int, optional
        Frame that the player shows first; the first one with ground truth by default.
    tracker : str, optional
        Label of the tracker whose run is selected; none by default.
    repetition : int
        Repetition of the selected run.

    Raises
    ------
    ValueError
        If the results have no run on the sequence or no run of the tracker.
    ResultsError
        If there are no results, or they are damaged.
    """
    from trackmark.bench.analysis.stored_runs import judged_runs
    from trackmark.bench.pages.content import Page, PageSection
    from trackmark.bench.pages.page import write_page
    from trackmark.bench.pages.player_runs import collect_runs, scenes
    from trackmark.reports.charts import PlayerPosition

    folder = Path(results) if isinstance(results, str | Path) else results.stored_folder
    experiment, name = _find_sequence(folder, sequence)
    runs = collect_runs(judged_runs(experiment, sequence=name), [])
    if tracker is not None and tracker not in runs.labels:
        names = ", ".join(runs.labels)
        raise ValueError(f"No run of {tracker!r} on {name!r}. Expected one of: {names}.")
    (scene,) = scenes(runs, lambda *_: None)
    first = scene.first if frame is None else frame
    if not 0 <= first < scene.frames:
        raise ValueError(f"{name!r}: no frame {first}. Expected: 0 to {scene.frames - 1}.")
    page = Page(name, [PageSection("frames", "Sequence", scenes=True)], runs.labels, [scene])
    start = page.opening(scene, first)
    if tracker is not None:
        start = PlayerPosition(0, runs.labels.index(tracker), repetition, first).link
    with temporary_folder() as temporary:
        path, *_ = write_page(temporary / "page.html", replace(page, start=start), room=inf)
        return SequencePlayer(path.read_text("utf-8"))


def complete_name(sequence: str, names: Iterable[str]) -> str:
    """Return the only name whose last part is `sequence`; `sequence` if it is a name itself."""
    ends = [name for name in names if sequence in (name, name.rpartition("/")[2])]
    return ends[0] if sequence not in ends and len(ends) == 1 else sequence


def _find_sequence(folder: Path, sequence: str | Path | Sequence) -> tuple[Path, str]:
    """Return the experiment that has runs on a sequence, and the sequence's name in these runs."""
    names: dict[str, Path] = {}
    for experiment in reversed(experiment_folders(folder)):
        runs = data_frames.load_runs(experiment)
        scored = runs[(runs["protocol"] == STORED_ONE_PASS) & (runs["status"] != "missing")]
        names |= dict.fromkeys(map(str, scored["sequence"].unique()), experiment)
    requested = sequence.name if isinstance(sequence, Sequence) else str(sequence)
    name = complete_name(requested, names)
    if name not in names:
        with suppress(datasets.SequenceError, OSError):  # then `sequence` is only a name
            name = datasets.load(requested).name
    if name not in names:
        expected = f"Expected one of: {', '.join(sorted(names))}."
        if not names:
            expected = "The player shows one-pass runs only, and there are none."
        raise ValueError(f"{folder}: no run on {requested!r}. {expected}")
    return names[name], name
