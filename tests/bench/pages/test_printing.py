"""A page on paper: all of it, on light ground, and nothing that only a screen can do."""

from base64 import b64decode

import pytest

from tests import browser
from tests.bench.pages.reading import seen, state
from trackmark.reports.page.content import Card, Chart, Line, Page, Section, Sheet
from trackmark.reports.page.page import write_page
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
    heads = ["sequence", "tracker", *(f"90th percentile {n} [px]" for n in range(columns))]
    cells = [
        [Cell(LONG), Cell("particle-filter:particles=200"), *[Cell("12.34 ±5.67")] * columns]
        for _ in range(rows)
    ]
    return Table(name, f"Of {LONG}.", heads, 2, cells)


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    """A page of narrow and wide tables, of charts and of a folded section."""
    lines = [Line(f"t{n}", n, [0, 1, 2], [0, n, 1]) for n in range(9)]
    charts = [Chart(f"Chart {n}", "x", "y", lines[: 3 + n], "words") for n in range(6)]
    wide = [Sheet(table(f"wide-{columns}", columns)) for columns in (3, 8, 25)]
    card = Card("card", "A claim", facts={"why": "w"}, sheets=[Sheet(table("claimed", 12, 2))])
    command = "trackmark report " + " ".join(f"--results-of {LONG}-{n}" for n in range(9))
    sections = [
        Section("tables", "Tables", ["Words."], wide, command=command),
        Section("charts", "Charts", charts=charts),
        Section("cards", "Claims", ["Words."], cards=[card], folded="all claims"),
    ]
    path = tmp_path_factory.mktemp("printed") / "report.html"
    return write_page(path, Page("T", sections))[0]


def on_paper(chromium, *, dark=False):
    """Lay the page out as it is printed."""
    chromium.size(LINE, 900)
    features = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    chromium.call("Emulation.setEmulatedMedia", media="print", features=features)
    chromium.run("dispatchEvent(new Event('beforeprint'))")


@pytest.fixture
def printed(chromium, tables):
    chromium.size(1280, 900)
    chromium.open(tables.as_uri())
    yield chromium
    chromium.call("Emulation.setEmulatedMedia", media="")


def test_on_paper_tables_are_whole_and_charts_drawn(printed):
    assert printed.run("document.querySelectorAll('figure.chart > svg').length") < 6
    on_paper(printed)
    assert printed.run(STICKING_OUT) == []
    assert printed.run(CUT) == []
    assert printed.run("document.querySelectorAll('figure.chart:not(:has(svg))').length") == 0
    told = "[...document.querySelectorAll('main :is(th, td, dd, p)')]"
    assert printed.run(f"{told}.filter(one => !one.checkVisibility()).length") == 0


def test_letters_of_a_table_are_made_no_smaller_than_it_takes(printed):
    on_paper(printed)
    sizes = printed.run(
        "Object.fromEntries([...document.querySelectorAll('table')].map(one => "
        "[one.id, parseFloat(getComputedStyle(one.tBodies[0]).fontSize)]))"
    )
    assert sizes["wide-3"] > 10
    assert sizes["wide-3"] > sizes["wide-8"] > sizes["wide-25"] > 2
    widths = printed.run(
        "Object.fromEntries([...document.querySelectorAll('table')].map(one => "
        "[one.id, one.offsetWidth]))"
    )
    assert min(widths["wide-8"], widths["wide-25"]) > 0.9 * 690


@pytest.mark.parametrize("dark", [False, True])
def test_paper_is_light_whatever_the_screen_is(printed, dark):
    on_paper(printed, dark=dark)
    style = "getComputedStyle(document.documentElement)"
    ground, ink = printed.run(f"[{style}.backgroundColor, {style}.color]")
    assert ground == "rgb(255, 255, 255)"
    assert max(map(int, ink[4:-1].split(","))) < 64


def test_what_only_a_screen_can_do_is_not_printed(chromium, page, results):
    chromium.size(1280, 900)
    chromium.open(page.as_uri())
    scene = chromium.run("data.scenes[0].name")
    seen(chromium, sequence=scene, tracker="static", repetition=0, frame=5)
    on_paper(chromium)
    try:
        controls = (
            "[...document.querySelectorAll('nav, input, select, dialog, header label, .copy')]"
        )
        assert chromium.run(f"{controls}.filter(one => one.checkVisibility()).length") == 0
        assert (
            chromium.run("getComputedStyle(document.querySelector('header')).position") == "static"
        )
    finally:
        chromium.call("Emulation.setEmulatedMedia", media="")
    assert state(chromium)["frame"] == "5"


def test_printing_draws_all_and_leaves_the_page_as_it_was(printed):
    open_ones = "document.querySelectorAll('details[open]').length"
    assert printed.run(open_ones) == 0
    told = printed.call("Page.printToPDF", displayHeaderFooter=False)
    assert b64decode(told["data"]).startswith(b"%PDF")
    assert printed.run("document.querySelectorAll('figure.chart:not(:has(svg))').length") == 0
    assert printed.run(open_ones) == 0
    assert printed.run("document.body.className") == ""
    styles = "[...document.querySelectorAll('table')].map(one => one.getAttribute('style') || '')"
    assert printed.run(styles) == [""] * 4
