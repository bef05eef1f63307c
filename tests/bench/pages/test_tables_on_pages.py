"""Tables as a page shows them."""

from tests import browser
from tests.bench.pages.reading import Cells, written
from trackmark import bench
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.reports.page.content import Page, Section, Sheet
from trackmark.reports.page.page import write_page
from trackmark.reports.tables import Cell, Table

COLUMNS = [
    ["0.784 ±0.204", "0.103 [0.000, 0.210]", "0.929"],
    ["7 of 119", "118.7 ±0.6 of 119", "119 of 119"],
    ["better", "inconclusive", "worse"],
    ["< .001", ".047", "1"],
]


@browser.needs_browser
def test_units_stand_beneath_each_other_on_a_page(chromium, tmp_path):
    rows = [
        [Cell(one, one == "119 of 119") for one in row] for row in zip("abc", *COLUMNS, strict=True)
    ]
    rows.append([Cell("none"), *[Cell("—")] * 4])
    table = Table("t", "", ["tracker", "overlap", "success", "the first is", "p"], 1, rows)
    (path,) = write_page(tmp_path / "a.html", Page("T", [Section("a", "A", sheets=[Sheet(table)])]))
    chromium.open(path.as_uri())
    ends = """[1, 2, 4].map(column => [...document.querySelectorAll("tbody tr")].slice(0, 3)
        .map(row => row.cells[column]).map(cell => {
            const range = document.createRange(), rest = cell.querySelector("i");
            range.setStart(cell, 0);
            range.setEndBefore(rest);
            return [range.getBoundingClientRect().right || rest.getBoundingClientRect().left,
                rest.getBoundingClientRect().right];
        }))"""
    for column in chromium.run(ends):
        for edges in zip(*column, strict=True):
            assert max(edges) - min(edges) < 1, column
    read = (
        "[...document.querySelectorAll('tbody tr')].slice(0, 3).map(row => row.cells[2].innerText)"
    )
    assert chromium.run(read) == ["7 of 119", "118.7 ±0.6 of 119", "119 of 119"]
    sides = """[...document.querySelectorAll("tr")].map(row => [...row.cells]
        .map(cell => getComputedStyle(cell).textAlign))"""
    assert {tuple(row) for row in chromium.run(sides)} == {
        ("left", "right", "right", "left", "right")
    }


def test_long_names_alone_may_go_on_in_another_line(tmp_path):
    names = ["plain/target", "plain/target:noise=30:scene=4"]
    rows = [[Cell(name), Cell(loss)] for name, loss in zip(names, ["none", "14"], strict=True)]
    table = Table("t", "", ["sequence", "first loss [frame]"], 1, rows)
    (path,) = write_page(tmp_path / "a.html", Page("T", [Section("a", "A", sheets=[Sheet(table)])]))
    text = path.read_text()
    assert ">plain/target<" in text
    assert ">plain/<wbr>target:<wbr>noise=<wbr>30:<wbr>scene=<wbr>4<" in text
    assert Cells(text).tables["t"][2][0]["text"] == names[1]
    assert 'class="text"' not in text  # `none` is said for a number


def test_a_page_without_parts_of_sequences_says_what_there_would_be(without_processes, tmp_path):
    sources = tuple(SequenceSource(f"plain/target:length=15:scene={n}") for n in range(2))
    with without_processes():
        asked = Experiment("trial", ("static", "camshift:window=adaptive"), sources)
        folder = bench.run(asked, tmp_path, jobs=1)
    text = written(folder, tmp_path / "page").read_text()
    assert "These sequences have no parts to compare trackers on" in text
    assert "parts" not in Cells(text).tables
