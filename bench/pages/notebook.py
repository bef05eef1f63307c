"""Stored results in a notebook: their tables, and the frames behind them."""

import html
from collections.abc import Collection
from contextlib import suppress
from dataclasses import replace
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd

from trackmark import datasets
from trackmark.bench.store import data_frames
from trackmark.bench.store.layout import RunKey, experiment_folders
from trackmark.reports.files import write_file

_HEIGHT = 780  # of a player [CSS pixels]


class Runs(pd.DataFrame):
    """Stored runs, a row a run; a notebook shows the tables of `trackmark report` instead.

    Selections and results of computations are plain data frames.
    """

    _metadata = ("folder", "cells")
    folder: Path
    cells: Collection[RunKey] | None

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def _repr_html_(self) -> str:
        """Return the tables that a notebook shows."""
        from trackmark.bench.reporting.tables import tables, title_of
        from trackmark.reports.renderers import to_html

        experiments = experiment_folders(self.folder)
        return "".join(
            to_html(table)
            for one in experiments
            for table in tables(one, self.cells, title_of(one, named=len(experiments) > 1))
        )


def load_results(folder: str | Path, cells: Collection[RunKey] | None = None) -> Runs:
    """All runs of an experiment, or of all experiments in a folder.

    A data frame; parameters, columns and errors as of `bench.store.data_frames.load_results`. In a
    notebook it shows the report's tables.
    """
    runs = Runs(data_frames.load_results(folder, cells))
    runs.folder, runs.cells = Path(folder), cells
    return runs


class Player:
    """A player of one sequence's frames; a notebook shows it, `save` writes it to a file.

    `page` is the text of a page in HTML that needs nothing else.
    """

    def __init__(self, page: str) -> None:
        self.page = page

    def save(self, path: str | Path) -> None:
        """Write the page to a file. Raises `OSError`."""
        write_file(Path(path), lambda file: file.write_text(self.page, encoding="utf-8"))

    def _repr_html_(self) -> str:
        """Return the page in a frame whose scripts cannot reach the notebook."""
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" title="Player" loading="lazy" '
            'sandbox="allow-scripts allow-downloads" allow="clipboard-write; fullscreen" '
            f'style="width: 100%; height: {_HEIGHT}px; border: 0"></iframe>'
        )


def player(
    results: str | Path | Runs,
    sequence: str,
    tracker: str | None = None,
    repetition: int = 0,
    frame: int | None = None,
) -> Player:
    """Play a sequence with the boxes of all trackers that ran on it.

    Parameters
    ----------
    results : path or Runs
        A folder of results, or the return value of `load_results`.
    sequence : str
        Its name in the results, or its specification.
    tracker : str, optional
        Label of the tracker whose run is selected; none by default.
    repetition : int
        Repetition of this run.
    frame : int, optional
        Frame that the player opens; the first one with ground truth by default.

    Raises
    ------
    ValueError
        If the results have no run on the sequence, or none of the tracker.
    ResultsError
        If there are no results, or they are damaged.
    """
    from trackmark.bench.pages.player_runs import read_runs, scenes
    from trackmark.reports.page.content import Page, PageSection, PlayerPosition
    from trackmark.reports.page.page import write_page

    folder = Path(results.folder if isinstance(results, Runs) else results)
    experiment, name = _holding(folder, sequence)
    runs = read_runs(experiment, [], sequence=name)
    if tracker is not None and tracker not in runs.labels:
        names = ", ".join(runs.labels)
        raise ValueError(f"There is no run of {tracker!r} on {name!r}; there are {names}.")
    (scene,) = scenes(runs, str(experiment), lambda *_: None)
    first = scene.first if frame is None else frame
    if not 0 <= first < scene.frames:
        raise ValueError(f"{name!r} has frames 0 to {scene.frames - 1}, and no {first}.")
    page = Page(name, [PageSection("frames", "Sequence", scenes=True)], runs.labels, [scene])
    start = page.opening(scene, first)
    if tracker is not None:
        start = page.address(PlayerPosition(0, runs.labels.index(tracker), repetition, first))
    with TemporaryDirectory(prefix="trackmark-") as made:
        path, *_ = write_page(Path(made) / "page.html", replace(page, start=start), room=inf)
        return Player(path.read_text("utf-8"))


def _holding(folder: Path, sequence: str) -> tuple[Path, str]:
    """Return the experiment that has runs on a sequence, and the name in these runs."""
    names = {
        str(name): experiment
        for experiment in reversed(experiment_folders(folder))
        for name in _ran_on(experiment)
    }
    if sequence not in names:
        with suppress(datasets.SequenceError, OSError):  # it may be called as it was asked for
            sequence = datasets.load(sequence).name
    if sequence not in names:
        known = ", ".join(sorted(names)) or "none"
        raise ValueError(f"{folder}: there is no run on {sequence!r}; there are {known}.")
    return names[sequence], sequence


def _ran_on(experiment: Path) -> list[str]:
    """Return the sequences with scored runs."""
    runs = data_frames.load_results(experiment)
    scored = runs[(runs["protocol"] == "accuracy") & (runs["status"] != "missing")]
    return [str(name) for name in scored["sequence"].unique()]
