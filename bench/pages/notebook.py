"""Player of the frames of stored results, in a notebook."""

import html
from contextlib import suppress
from dataclasses import replace
from math import inf
from pathlib import Path

from trackmark import datasets
from trackmark.bench.operating_system import temporary_folder
from trackmark.bench.output_files import write_file
from trackmark.bench.protocols import ONE_PASS
from trackmark.bench.store.database import single_experiment
from trackmark.bench.store.runs import Runs, complete_name
from trackmark.datasets import Sequence

_PLAYER_HEIGHT = 780  # CSS pixels


class SequencePlayer:
    """Player of the frames of one sequence, for a notebook or a file.

    `page`: HTML of a page that needs no other files.
    """

    def __init__(self, page: str) -> None:
        self.page = page

    def save(self, path: str | Path) -> None:
        """Write the page to a file; raise `OSError` if it cannot be written."""
        write_file(Path(path), self.page)

    def _repr_html_(self) -> str:
        """Return the page in a frame whose scripts cannot access the notebook."""
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" title="Player" loading="lazy" '
            'sandbox="allow-scripts allow-downloads" allow="clipboard-write; fullscreen" '
            f'style="width: 100%; height: {_PLAYER_HEIGHT}px; border: 0"></iframe>'
        )


def player(
    runs: str | Path | Runs,
    sequence: str | Path | Sequence,
    frame: int | None = None,
    tracker: str | None = None,
    repetition: int = 0,
) -> SequencePlayer:
    """Return a player of a sequence with the boxes of all trackers that ran on it by one-pass.

    Parameters
    ----------
    runs : path or Runs
        Folder of an experiment, or runs of `evaluate`, `run` or `load_runs`.
    sequence : str, Path or Sequence
        Name in the runs or its last part, specification, path, or the sequence.
    frame : int, optional
        Frame that the player shows first; the first one with ground truth by default.
    tracker : str, optional
        Label of the tracker whose run is selected; none by default.
    repetition : int
        Repetition of the selected run.

    Raises
    ------
    ValueError
        If there is no run on the sequence or no run of the tracker.
    ResultsError
        If there are no results or several experiments in the folder, or a file is damaged.
    """
    from trackmark.bench.pages.content import Page, PageSection, player_link
    from trackmark.bench.pages.page import write_page
    from trackmark.bench.pages.page_frames import with_frames
    from trackmark.bench.pages.player_runs import collect_runs
    from trackmark.reports.charts import PlayerPosition

    if not isinstance(runs, Runs):
        runs = Runs.open(single_experiment(Path(runs).expanduser()))
    name = _name_of(sequence, runs)
    page_runs = collect_runs(runs.read(runs.evaluated_rows(sequence=name)), [])
    if tracker is not None and tracker not in page_runs.labels:
        names = ", ".join(page_runs.labels)
        raise ValueError(f"No run of {tracker!r} on {name!r}. Expected one of: {names}.")
    (player_sequence,) = with_frames(page_runs.sequences, lambda *_: None)
    first = player_sequence.first if frame is None else frame
    if not 0 <= first < player_sequence.n_frames:
        raise ValueError(
            f"{name!r}: no frame {first}. Expected: 0 to {player_sequence.n_frames - 1}."
        )
    section = PageSection("frames", "Sequence", lists_sequences=True)
    page = Page(name, [section], page_runs.labels, [player_sequence])
    start = player_link(player_sequence, first)
    if tracker is not None:
        start = PlayerPosition(0, page_runs.labels.index(tracker), repetition, first).link
    with temporary_folder() as temporary:
        path, *_ = write_page(temporary / "page.html", replace(page, start=start), room=inf)
        return SequencePlayer(path.read_text("utf-8"))


def _name_of(sequence: str | Path | Sequence, runs: Runs) -> str:
    """Return the name of a sequence in one-pass runs; raise `ValueError` without runs on it."""
    names = {row["sequence"] for row in runs.evaluated_rows(protocol=ONE_PASS)}
    requested = sequence.name if isinstance(sequence, Sequence) else str(sequence)
    name = complete_name(requested, names)
    if name not in names:
        with suppress(datasets.SequenceError, OSError):  # then `sequence` is only a name
            name = datasets.load(requested).name
    if name not in names:
        expected = f"Expected one of: {', '.join(sorted(names))}."
        if not names:
            expected = "The player shows one-pass runs only, and there are none."
        raise ValueError(f"{runs!r}: no run on {requested!r}. {expected}")
    return name
