"""Stored results in a notebook: tables of scores and a player of the frames."""

import html
from collections.abc import Collection
from contextlib import suppress
from dataclasses import replace
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd

from trackmark import datasets
from trackmark.bench.protocols import STORED_ONE_PASS
from trackmark.bench.store import data_frames
from trackmark.bench.store.layout import RunKey, experiment_folders
from trackmark.reports.files import write_file

_PLAYER_HEIGHT = 780  # CSS pixels


class Runs(pd.DataFrame):
    """Data frame with one row per stored run; a notebook shows the tables of `trackmark report`.

    Selections and results of computations are plain data frames.
    """

    _metadata = ("folder", "cells")
    folder: Path
    cells: Collection[RunKey] | None

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def _repr_html_(self) -> str:
        """Return the tables as HTML."""
        from trackmark.bench.reporting.tables import tables, title_of
        from trackmark.reports.renderers import to_html

        experiments = experiment_folders(self.folder)
        return "".join(
            to_html(table)
            for experiment in experiments
            for table in tables(
                experiment, self.cells, title_of(experiment, named=len(experiments) > 1)
            )
        )


def load_results(folder: str | Path, cells: Collection[RunKey] | None = None) -> Runs:
    """Return the runs of an experiment, or of all experiments in a folder, as a data frame.

    Parameters, columns and errors are those of `bench.store.data_frames.load_results`. A notebook
    shows the tables of the report.
    """
    runs = Runs(data_frames.load_results(folder, cells))
    runs.folder, runs.cells = Path(folder), cells
    return runs


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
    results: str | Path | Runs,
    sequence: str,
    tracker: str | None = None,
    repetition: int = 0,
    frame: int | None = None,
) -> SequencePlayer:
    """Return a player of a sequence with the boxes of all trackers that ran on it.

    Parameters
    ----------
    results : path or Runs
        Folder of results, or the return value of `load_results`.
    sequence : str
        Name in the results, or specification.
    tracker : str, optional
        Label of the tracker whose run is selected; none by default.
    repetition : int
        Repetition of the selected run.
    frame : int, optional
        Frame that the player shows first; the first one with ground truth by default.

    Raises
    ------
    ValueError
        If the results have no run on the sequence or no run of the tracker.
    ResultsError
        If there are no results, or they are damaged.
    """
    from trackmark.bench.pages.player_runs import read_runs, scenes
    from trackmark.reports.page.content import Page, PageSection, PlayerPosition
    from trackmark.reports.page.page import write_page

    folder = Path(results.folder if isinstance(results, Runs) else results)
    experiment, name = _find_sequence(folder, sequence)
    runs = read_runs(experiment, [], sequence=name)
    if tracker is not None and tracker not in runs.labels:
        names = ", ".join(runs.labels)
        raise ValueError(f"No run of {tracker!r} on {name!r}. Expected one of: {names}.")
    (scene,) = scenes(runs, str(experiment), lambda *_: None)
    first = scene.first if frame is None else frame
    if not 0 <= first < scene.frames:
        raise ValueError(f"{name!r}: no frame {first}. Expected: 0 to {scene.frames - 1}.")
    page = Page(name, [PageSection("frames", "Sequence", scenes=True)], runs.labels, [scene])
    start = page.opening(scene, first)
    if tracker is not None:
        start = page.address(PlayerPosition(0, runs.labels.index(tracker), repetition, first))
    with TemporaryDirectory(prefix="trackmark-") as temporary:
        path, *_ = write_page(Path(temporary) / "page.html", replace(page, start=start), room=inf)
        return SequencePlayer(path.read_text("utf-8"))


def _find_sequence(folder: Path, sequence: str) -> tuple[Path, str]:
    """Return the experiment that has runs on a sequence, and the sequence's name in these runs."""
    names: dict[str, Path] = {}
    for experiment in reversed(experiment_folders(folder)):
        runs = data_frames.load_results(experiment)
        scored = runs[(runs["protocol"] == STORED_ONE_PASS) & (runs["status"] != "missing")]
        names |= dict.fromkeys(map(str, scored["sequence"].unique()), experiment)
    if sequence not in names:
        with suppress(datasets.SequenceError, OSError):  # then `sequence` is only a name
            sequence = datasets.load(sequence).name
    if sequence not in names:
        expected = ", ".join(sorted(names)) or "none"
        raise ValueError(f"{folder}: no run on {sequence!r}. Expected one of: {expected}.")
    return names[sequence], sequence
