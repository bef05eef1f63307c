"""A whole report in a folder: tables in every format, plots and film strips."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import pandas as pd

from reports.comma_separated import to_csv
from reports.figures import write_figure
from reports.files import write_file
from reports.latex import to_latex
from reports.markdown import to_markdown
from reports.plots import frame_plot, precision_plot, speed_plot, success_plot
from reports.tables import Table
from reports.text import to_text

__all__ = ["FORMATS", "file_name", "report_page", "write_plots", "write_tables"]

FORMATS = {
    "text": (".txt", to_text),
    "markdown": (".md", to_markdown),
    "csv": (".csv", to_csv),
    "latex": (".tex", to_latex),
}
"""Suffix and renderer of every format a table can have."""


def write_tables(
    folder: Path, tables: Sequence[Table], formats: Mapping[str, object] = FORMATS
) -> list[Path]:
    """Write tables into a folder, one file a table and format.

    Raises
    ------
    OSError
        Where a file can't be written.
    """
    paths = []
    for table in tables:
        for name in formats:
            suffix, render = FORMATS[name]
            text = render(table)
            paths.append(_write_text(folder / f"{table.name}{suffix}", text))
    return paths


def write_plots(
    folder: Path,
    frames: pd.DataFrame,
    timing: pd.DataFrame,
    title: str,
    trackers: Sequence[str],
    incomplete: Collection[str] = (),
) -> list[Path]:
    """Draw all plots that the data allow.

    Parameters
    ----------
    folder : Path
        Where to.
    frames : DataFrame
        Frame table (see `reports.plots`); may be empty.
    timing : DataFrame
        Timing runs; may be empty.
    title : str
        Headline.
    trackers, incomplete
        See `reports.plots.success_plot`.
    """
    paths = []
    if len(frames):
        paths.append(
            write_figure(folder / "success.png", success_plot(frames, title, trackers, incomplete))
        )
        paths.append(
            write_figure(
                folder / "precision.png", precision_plot(frames, title, trackers, incomplete)
            )
        )
        for sequence in frames["sequence"].unique():
            figure = frame_plot(frames, sequence, trackers, incomplete)
            paths.append(write_figure(folder / f"frames-{file_name(sequence)}.png", figure))
    if "cpu_seconds_median" in timing and timing["cpu_seconds_median"].notna().any():
        # Those that were timed alone come last: the others keep their colours.
        everybody = list(dict.fromkeys([*trackers, *timing["tracker"]]))
        paths.append(write_figure(folder / "speed.png", speed_plot(timing, title, everybody)))
    return paths


def report_page(
    title: str, remarks: Sequence[str], tables: Sequence[Table], pictures: Sequence[Path]
) -> str:
    """A whole report as one page of Markdown; pictures are linked by their file names."""
    parts = [f"# {title}", "\n".join(f"- {remark}" for remark in remarks)]
    parts += [to_markdown(table).rstrip("\n") for table in tables]
    parts += [f"![{picture.stem}]({picture.name})" for picture in pictures]
    return "\n\n".join(parts) + "\n"


def file_name(label: str) -> str:
    """A label as a file name: what is no letter, digit, dot or dash becomes a dash."""
    return "".join(sign if sign.isalnum() or sign in ".-" else "-" for sign in label)


def _write_text(path: Path, text: str) -> Path:
    def write(file: Path) -> None:
        file.write_text(text, encoding="utf-8")

    return write_file(path, write)
