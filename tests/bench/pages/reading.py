"""Helpers that write a page, read it, and open it in a browser."""

import json
import re
from html.parser import HTMLParser
from urllib.parse import urlencode

from trackmark import datasets
from trackmark.bench.pages.report import Commands, write_report_page
from trackmark.bench.reporting.tables import tables


class Cells(HTMLParser):
    """Parser of the tables in the HTML of a page."""

    def __init__(self, text):
        super().__init__()
        self.tables, self.links, self.tags = {}, [], []
        self._table = self._row = self._cell = None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.tags.append(tag)
        if tag == "table":
            self._table = self.tables[values["id"]] = []
        if tag == "tr":
            self._row = []
            self._table.append(self._row)
        if tag in ("td", "th"):
            self._cell = {"text": "", "value": values.get("data-value"), "link": None}
            self._row.append(self._cell)
        if tag == "a" and self._cell is not None:
            self._cell["link"] = values["href"]

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self._cell = None

    def handle_data(self, text):
        if self._cell is not None:
            self._cell["text"] += text


def data_of(text):
    """Return the data of a page's scripts."""
    return json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])


def write_experiment_page(experiment, folder, report_tables=None, **options):
    """Write the page of an experiment, by default with its own tables."""
    commands, path = Commands(str(experiment)), folder / "report.html"
    report_tables = tables(experiment) if report_tables is None else report_tables
    paths = write_report_page(
        experiment, path, report_tables, "Trial", commands, lambda *_: None, **options
    )
    return paths[0]


def canonical_name(text):
    """Return the canonical name of a sequence."""
    return datasets.load(text).name


def state(browser):
    return dict(browser.run("[...state]"))


def open_frame(browser, **address):
    """Open the player at an address and wait for its frame."""
    browser.run(f"location.hash = {json.dumps(urlencode(address))}")
    number = address["frame"]
    name = json.dumps(address["sequence"])
    browser.wait(f"scene && scene.name === {name} && paintedFrame === {number}")


def filter_tables(browser, words):
    """Type words into the filter of tables."""
    browser.run(f"byId('filter').value = {json.dumps(words)}")
    browser.run("byId('filter').dispatchEvent(new Event('input'))")


def scroll_to(browser, chart):
    """Scroll to a chart and wait until it is drawn."""
    browser.wait(
        f"new Promise((done) => {{ byId('{chart}').scrollIntoView({{block: 'center', behavior: "
        "'instant'}); requestAnimationFrame(() => "
        f"done(document.querySelector('#{chart} svg') !== null)); }})"
    )
