"""Content of a page for a paper: tables, figures, Markdown and LaTeX."""

import re
import shutil
import subprocess
from urllib.parse import quote

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from tests.bench.pages.reading import write_experiment_page
from trackmark.bench.pages.paper_export import write_paper
from trackmark.bench.pages.report_figures import FigureFiles
from trackmark.bench.reporting.by_preset import preset_report
from trackmark.reports.figures import write_for_papers
from trackmark.reports.page.content import Chart, Line, Page, PageSection, PageTable
from trackmark.reports.tables import Cell, Table

DOCUMENT = r"""\documentclass{article}\usepackage{booktabs,graphicx}
\begin{document}\input{report}\end{document}"""
NAMES = ['</script>$x_1$ "q"', "ключ\nзвук 跟踪", "=1+1"]
FIGURES = ("heat", "survival", "frames-ключ-1")


@pytest.fixture
def page():
    rows = [[Cell(name), Cell("0.500"), Cell("0.250", best=True), Cell("—")] for name in NAMES]
    data = pd.DataFrame({"sequence": NAMES, "mean": [0.5, 0.25, np.nan]})
    heat = Table("heat", "Mean overlap", ["sequence", *NAMES], 1, rows, data=data)
    lines = [Line(NAMES[1], 1, [3.0], [0.5], [0.4], [0.6])]
    charts = {
        name: Chart("", "x", "y", lines, "n = 2", figure=name)
        for name in ("survival", "missing", "frames-ключ-1")
    }
    sections = [
        PageSection("heat", "Map", ["Words & 50 %"], [PageTable(heat, [[0.5] * 3] * 3, heat=True)]),
        *(PageSection(key, "S", charts=[chart]) for key, chart in charts.items()),
    ]
    texts = {"answer": "a_b has <i> & 50 %", "details": ("$x$ follows.",)}
    return Page("T <script>", sections, NAMES, **texts)


@pytest.mark.parametrize("suffix", [".pdf", ".svg"])
def test_page_is_written_in_markdown_and_latex(page, tmp_path, suffix):
    for name in FIGURES:
        write_for_papers(tmp_path / f"{name}{suffix}", Figure(figsize=(1, 1)))
    paths = write_paper(tmp_path, page, suffix, ["others"])
    tables = {f"heat{ending}" for ending in (".txt", ".md", ".csv", ".tex")}
    assert {path.name for path in paths} == {*tables, "report.md", "report.tex"}
    text = (tmp_path / "report.md").read_text()
    figures_in_text = re.findall(r"^!\[.*\]\((.*)\)$", text, re.M)
    assert figures_in_text == [quote(f"{name}{suffix}") for name in FIGURES]
    assert not re.search(r"(?<!\\)<", text)
    assert text.index("50 %") < text.index("follows") < text.index("## Map")
    latex = (tmp_path / "report.tex").read_text()
    assert r"\& 50 \%" in latex
    included = re.findall(r"\\includegraphics\[.*\]\{(.*)\}", latex)
    assert included[:2] == ["heat.pdf", "survival.pdf"]
    assert included[2].isascii()
    content = (tmp_path / included[2]).read_bytes()
    assert content == (tmp_path / "frames-ключ-1.pdf").read_bytes()
    assert wide_boxes(tmp_path) == []


def wide_boxes(folder):
    """Compile the document; return boxes that are too wide by a point or more."""
    if shutil.which("pdflatex") is None:
        pytest.skip("pdflatex is not installed")
    (folder / "whole.tex").write_text(DOCUMENT)
    command = ["pdflatex", "-halt-on-error", "-draftmode", "-no-shell-escape", "whole.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, check=False)
    output = done.stdout.decode(errors="replace")
    assert done.returncode == 0, output[-900:]
    boxes = re.findall(r"(Overfull .box \((\d+)\.\d*pt.*)", output)
    return [line for line, points in boxes if int(points) >= 1]


PARAMETERS = '{"colour": "rgb", "bins": 8, "scale": "adaptive", "scale_smoothing": 0.1}' * 12
DIGESTS = "numpy 2.3.1, scipy 1.16.0, digest 294f9cd07e0bc003294f9cd07e0bc003294f9cd07e0bc003"


def test_long_tables_and_words_fit_a_page_of_latex(tmp_path):
    long = "plain/target:length=60:scene=9:noise=30:speed=fast:occlusion=whole:light=dappled"
    heads = ["tracker", *(f"90th percentile {number} [px]" for number in range(12))]
    wide = [[Cell(f"{long}-{row}"), *[Cell("12.34 ±5.67", best=True)] * 12] for row in range(120)]
    texts = [
        [Cell(NAMES[row % 3]), Cell(PARAMETERS), Cell(DIGESTS), Cell("294f9cd07e0bc003")]
        for row in range(9)
    ]
    names = ["name", "parameters", "libraries", "version"]
    notes = [f"failed: {long}, repetition {n}: ValueError: {PARAMETERS[:200]}" for n in range(40)]
    tables = [
        Table("wide", f"Of {long}.", heads, 1, wide, notes[:1]),
        Table("texts", "Of trackers.", names, 1, texts, notes),
        Table("few", "", ["a", "b"], 1, [[Cell("x"), Cell("1")]]),
    ]
    words = [f"Runs of {long}, {long} and {PARAMETERS}."]
    sections = [PageSection("all", "All", words, [*map(PageTable, tables)] * 5)]
    write_paper(tmp_path, Page("T", sections), ".pdf", [])
    assert wide_boxes(tmp_path) == []


@pytest.mark.slow
def test_figures_of_runs_are_written_next_to_the_page(results, tmp_path, drifting):
    report, messages = preset_report(results, ["native", "otb"]), []
    figures = FigureFiles(".svg", messages.append, report.scored)
    write_experiment_page(results, tmp_path, figures=figures)
    names = {path.stem for path in tmp_path.glob("*.svg")}
    scenes = {f"frames-plain-target-length-60-scene-{n}" for n in range(1, 5)}
    assert names == {
        "success", "precision", "survival", "speed-accuracy", "heat", "metrics-otb-success",
        "metrics-otb-precision",
        "frames-plain-target-length-60", "frames-plain-target-length-60-noise-30-scene-9", *scenes,
    }  # fmt: skip
    assert len([*tmp_path.glob("strip-*.png")]) == 6
    assert messages == []
    text = (tmp_path / "report.md").read_text()
    assert "](success.svg)" in text
    assert "online boxes" in (tmp_path / "success.svg").read_text()
