"""A whole report in a folder: tables in every format, plots and film strips."""

import re
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path

import pandas as pd

from reports.files import write_file
from reports.printable import one_line
from reports.renderers import FORMATS, in_markdown, to_markdown
from reports.tables import Table

__all__ = ["file_name", "report_page", "write_plots", "write_tables"]


def write_tables(
    folder: Path, tables: Sequence[Table], formats: Iterable[str] = FORMATS
) -> list[Path]:
    """Write tables into a folder, one file a table and format.

    Raises
    ------
    OSError
        Where a file can't be written.
    """

    def write(table: Table, suffix: str, render: Callable[[Table], str]) -> Path:
        text = render(table)
        path = folder / f"{table.name}{suffix}"
        return write_file(path, lambda file: file.write_text(text, encoding="utf-8"))

    return [write(table, *FORMATS[name]) for table in tables for name in formats]


def write_plots(
    folder: Path,
    frames: pd.DataFrame,
    timing: pd.DataFrame,
    title: str,
    trackers: Sequence[str],
    incomplete: Collection[str] = (),
) -> list[Path]:
    """Draw all plots that the data allow: frame table and timing runs may be empty.

    Parameters as those of the plots in `reports.plots`.
    """
    # What draws is imported where something is drawn: tables are written without.
    from reports.figures import write_figure
    from reports.plots import frame_plot, precision_plot, speed_plot, success_plot

    figures = {}
    if len(frames):
        figures["success"] = success_plot(frames, title, trackers, incomplete)
        figures["precision"] = precision_plot(frames, title, trackers, incomplete)
        for sequence in frames["sequence"].unique():
            figure = frame_plot(frames, sequence, trackers, incomplete)
            figures[f"frames-{file_name(sequence)}"] = figure
    if "cpu_seconds_median" in timing and timing["cpu_seconds_median"].notna().any():
        # Those that were timed alone come last: the others keep their colours.
        everybody = list(dict.fromkeys([*trackers, *timing["tracker"]]))
        figures["speed"] = speed_plot(timing, title, everybody)
    return [write_figure(folder / f"{name}.png", figure) for name, figure in figures.items()]


def report_page(
    title: str, remarks: Sequence[str], tables: Sequence[Table], pictures: Sequence[Path]
) -> str:
    """A whole report as one page of Markdown; pictures are linked by their file names.

    Remarks may be set in Markdown, but what a tracker raised may stand in them: they have no links.
    """
    told = (re.sub(r"<|\](?=[(\[])", r"\\\g<0>", one_line(remark)) for remark in remarks)
    parts = [f"# {in_markdown(title)}", "\n".join(f"- {remark}" for remark in told)]
    parts += [to_markdown(table).rstrip("\n") for table in tables]
    parts += [f"![{picture.stem}]({picture.name})" for picture in pictures]
    return "\n\n".join(parts) + "\n"


def file_name(label: str) -> str:
    """A label as a file name: what is no letter, digit, dot or dash becomes a dash."""
    return "".join(sign if sign.isalnum() or sign in ".-" else "-" for sign in label)
