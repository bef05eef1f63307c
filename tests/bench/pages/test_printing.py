"""Printed pages: complete, on light background, without interactive elements."""

from base64 import b64decode

import pytest

from tests import browser
from tests.bench.pages.reading import open_frame, state
from trackmark.bench.pages.content import Page, PageSection, PageTable
from trackmark.bench.pages.page import card, write_page
from trackmark.reports.charts import Chart, Line
from trackmark.reports.tables import Cell, Table

pytestmark = browser.needs_browser

LINE = 703  # pixels between the margins of A4, which is narrower than Letter
LONG = "plain/target:length=60:scene=9:noise=30:speed=fast"

STICKING_OUT = f"""[...document.querySelectorAll("th, td, caption, p, figure, code, summary")]
    .filter(one => one.getBoundingClientRect().right > {LINE + 1}).map(one => one.outerHTML)"""
CUT = """[...document.querySelectorAll("main *")]
    .filter(one => one.scrollWidth > one.clientWidth + 1)
    .filter(one => getComputedStyle(one).overflowX !== "visible")
    .map(one => one.outerHTML)"""


def table(name, columns, rows=40):
    headings = ["sequence", "tracker", *(f"90th percentile {n} [px]" for n in range(columns))]
    labels = [Cell(LONG), Cell("particle-filter:particles=200")]
    return Table(
        name, f"Of {LONG}.", headings, 2, [[*labels, *[Cell("12.34 ±5.67")] * columns]] * rows
    )


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    """Return a page with narrow and wide tables, charts and a folded section."""
    lines = [Line(f"t{n}", n, [0, 1, 2], [0, n, 1]) for n in range(9)]
    charts = [Chart(f"Chart {n}", "x", "y", lines[: 3 + n], "words") for n in range(6)]
    wide = [PageTable(table(f"wide-{columns}", columns)) for columns in (3, 8, 25)]
    claimed = {"tables": [PageTable(table("claimed", 12, 2))], "paragraphs": ["Words."]}
    command = "trackmark report " + " ".join(f"--results-of {LONG}-{n}" for n in range(9))
    fold = card("fold", key="card", title="A claim", commands=[command], **claimed)
    sections = [
        PageSection("tables", "Tables", [card("page_table", sheet=entry) for entry in wide]),
        PageSection("charts", "Charts", [card("chart", chart=chart) for chart in charts]),
        PageSection("cards", "Claims", [fold]),
    ]
    path = tmp_path_factory.mktemp("printed") / "report.html"
    return write_page(path, Page("T", sections))[0]


@pytest.fixture
def on_paper(chromium):
    """Provide `on_paper(page)`, which opens a page with its print layout, in dark mode."""

    def on_paper(page):
        chromium.open(page.as_uri())
        chromium.size(LINE, 900)
        features = [{"name": "prefers-color-scheme", "value": "dark"}]
        chromium.call("Emulation.setEmulatedMedia", media="print", features=features)
        chromium.run("dispatchEvent(new Event('beforeprint'))")
        return chromium

    chromium.size(1280, 900)
    yield on_paper
    chromium.call("Emulation.setEmulatedMedia", media="")


def test_paper_has_whole_tables_and_charts_on_light_ground(on_paper, tables):
    printed = on_paper(tables)
    assert printed.run(STICKING_OUT) == []
    assert printed.run(CUT) == []
    assert printed.run("document.querySelectorAll('figure.chart > svg').length") == 6
    texts = "[...document.querySelectorAll('main :is(th, td, dd, p)')]"
    assert printed.run(f"{texts}.filter(one => !one.checkVisibility()).length") == 0
    style = "getComputedStyle(document.documentElement)"
    ground, ink = printed.run(f"[{style}.backgroundColor, {style}.color]")
    assert ground == "rgb(255, 255, 255)"
    assert max(map(int, ink[4:-1].split(","))) < 64


@pytest.mark.usefixtures("on_paper")
def test_controls_are_not_printed(chromium, page):
    chromium.open(page.as_uri())
    name = chromium.run("data.sequences[0].name")
    open_frame(chromium, sequence=name, tracker="static", repetition=0, frame=5)
    chromium.call("Emulation.setEmulatedMedia", media="print")
    controls = "[...document.querySelectorAll('nav, input, select, dialog, header label, .copy')]"
    assert chromium.run(f"{controls}.filter(one => one.checkVisibility()).length") == 0
    header = "getComputedStyle(document.querySelector('header')).position"
    assert chromium.run(header) == "static"
    chromium.call("Emulation.setEmulatedMedia", media="")
    assert state(chromium)["frame"] == "5"


def test_printing_leaves_the_page_as_it_was(chromium, tables):
    chromium.size(1280, 900)
    chromium.open(tables.as_uri())
    printed = chromium.call("Page.printToPDF", displayHeaderFooter=False)
    assert b64decode(printed["data"]).startswith(b"%PDF")
    assert chromium.run("document.querySelectorAll('details[open]').length") == 0
