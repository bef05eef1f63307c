"""What a page shows, as files for a paper."""

import re
import shutil
import subprocess
from urllib.parse import quote

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from trackmark.bench.pages.paper_export import write_paper
from trackmark.reports.figures import write_for_papers
from trackmark.reports.page.content import Chart, Line, Page, Section, Sheet
from trackmark.reports.renderers import to_latex, to_markdown
from trackmark.reports.tables import Cell, Table

DOCUMENT = r"""\documentclass{article}\usepackage{booktabs,graphicx}
\begin{document}\input{report}\end{document}"""
NAMES = ['</script>$x_1$ "q"', "ключ\nзвук 跟踪", "=1+1"]


@pytest.fixture
def page():
    rows = [[Cell(name), Cell("0.500"), Cell("0.250", best=True), Cell("—")] for name in NAMES]
    data = pd.DataFrame({"sequence": NAMES, "mean": [0.5, 0.25, np.nan]})
    heat = Table("heat", "Mean overlap", ["sequence", *NAMES], 1, rows, data=data)
    values = [[0.5, 0.25, float("nan")]] * 3
    steps = [
        Line(name, number, [0, 5], [1, 0.5], [1, 0.2], [1, 0.8])
        for number, name in enumerate(NAMES[:2])
    ]
    dots = [Line(NAMES[1], 1, [3.0], [0.5], [0.4], [0.6])]
    sections = [
        Section("heat", "Map", ["Words & 50 %"], [Sheet(heat, values, heat=True)]),
        Section("survival", "S", charts=[Chart("", "x", "y", steps, "n = 2", figure="survival")]),
        Section(
            "speed", "V", charts=[Chart("", "x", "y", dots, "w", figure="speed")], command="a b"
        ),
        Section("curves", "C", charts=[Chart("", "x", "y", dots, "w", figure="not-drawn")]),
        Section("errors", "E", charts=[Chart("", "x", "y", dots, "w", figure="frames-ключ-1")]),
    ]
    return Page("T <script>", sections, NAMES)


def test_a_page_is_written_as_tables_figures_markdown_and_latex(page, tmp_path):
    plain = Figure(figsize=(1, 1))
    plain.savefig(tmp_path / "frames-ключ-1.pdf")  # as `write_plots` names it
    paths = write_paper(tmp_path, page, ".pdf", ["others"])
    assert {path.name for path in paths} == {
        *(f"heat{suffix}" for suffix in (".txt", ".md", ".csv", ".tex", ".pdf")),
        "survival.pdf", "speed.pdf", "report.md", "report.tex",
    }  # fmt: skip
    assert all(path.stat().st_size for path in paths)
    text = (tmp_path / "report.md").read_text()
    assert re.findall(r"^!\[.*\]\((.*)\)$", text, re.M) == [
        "heat.pdf", "survival.pdf", "speed.pdf", quote("frames-ключ-1.pdf")
    ]  # fmt: skip
    assert "\n    a b\n" in text
    assert not re.search(r"(?<!\\)<", text)
    latex = (tmp_path / "report.tex").read_text()
    included = included_in(latex)
    assert included[:3] == ["heat.pdf", "survival.pdf", "speed.pdf"]
    assert len(included) == 4
    assert included[3].isascii()
    content = (tmp_path / included[3]).read_bytes()
    assert content == (tmp_path / "frames-ключ-1.pdf").read_bytes()
    if shutil.which("pdflatex") is None:
        pytest.skip("pdflatex is not installed")
    assert overfull(tmp_path, DOCUMENT) == []


def included_in(latex):
    return re.findall(r"\\includegraphics\[.*\]\{(.*)\}", latex)


def test_latex_has_a_pdf_of_each_figure_that_is_written_as_svg(page, tmp_path):
    for suffix in (".svg", ".pdf"):
        write_for_papers(tmp_path / f"frames-ключ-1{suffix}", Figure(figsize=(1, 1)))
    paths = write_paper(tmp_path, page, ".svg", [])
    figures = {path.name for path in paths if path.suffix in (".svg", ".pdf")}
    assert figures == {
        f"{name}{suffix}" for name in ("heat", "survival", "speed") for suffix in (".svg", ".pdf")
    }
    assert "](survival.svg)" in (tmp_path / "report.md").read_text()
    included = included_in((tmp_path / "report.tex").read_text())
    assert len(included) == 4
    assert all(name.endswith(".pdf") for name in included)
    if shutil.which("pdflatex") is None:
        pytest.skip("pdflatex is not installed")
    assert overfull(tmp_path, DOCUMENT) == []


def overfull(folder, document):
    """Boxes that are too large by a point or more, once it compiles."""
    (folder / "whole.tex").write_text(document)
    command = ["pdflatex", "-halt-on-error", "-draftmode", "-no-shell-escape", "whole.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, check=False)
    told = done.stdout.decode(errors="replace")
    assert done.returncode == 0, told[-900:]
    boxes = re.findall(r"(Overfull .box \((\d+)\.\d*pt.*)", told)
    return [line for line, points in boxes if int(points) >= 1]


PARAMETERS = '{"colour": "rgb", "bins": 8, "scale": "adaptive", "scale_smoothing": 0.1}' * 12
DIGESTS = "numpy 2.3.1, scipy 1.16.0, digest 294f9cd07e0bc003294f9cd07e0bc003294f9cd07e0bc003"


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_nothing_sticks_out_of_a_page_of_latex(tmp_path):
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
    sections = [Section("all", "All", words, [*map(Sheet, tables)] * 5)]
    write_paper(tmp_path, Page("T", sections), ".pdf", [])
    assert overfull(tmp_path, DOCUMENT) == []


def test_texts_stand_left_and_numbers_right(tmp_path):
    rows = [[Cell("a"), Cell("better (~9)"), Cell("[-0.1, 0.2]"), Cell("—"), Cell("54 of 99")]]
    table = Table("t", "", ["pair", "the first is", "95 %", "nothing", "success"], 1, rows)
    assert "| --- | --- | ---: | ---: | ---: |" in to_markdown(table)
    assert r"\begin{tabular}{llrrr}" in to_latex(table)
