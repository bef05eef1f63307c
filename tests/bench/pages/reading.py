"""Helpers that write a page, read it, and open it in a browser."""

import json
import re
from html.parser import HTMLParser
from urllib.parse import urlencode

from trackmark import datasets
from trackmark.bench.pages.report import Commands, write_report_page
from trackmark.bench.reporting.tables import tables


class Cells(HTMLParser):
    """Tables of a page, read from its HTML alone."""

    def __init__(self, text):
        super().__init__()
        self.tables, self.links, self.tags = {}, [], []
        self._table = self._row = self._cell = None
        self.feed(text)

    def handle_starttag(self, tag, given):
        told = dict(given)
        self.tags.append(tag)
        if tag == "table":
            self._table = self.tables[told["id"]] = []
        if tag == "tr":
            self._row = []
            self._table.append(self._row)
        if tag in ("td", "th"):
            self._cell = {"text": "", "value": told.get("data-value"), "link": None}
            self._row.append(self._cell)
        if tag == "a" and self._cell is not None:
            self._cell["link"] = told["href"]

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self._cell = None

    def handle_data(self, text):
        if self._cell is not None:
            self._cell["text"] += text


def data_of(text):
    """Return the data of a page's scripts."""
    return json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])


def written(experiment, folder, made=None, **options):
    """Write the page of an experiment, with tables that were made or with its own."""
    commands, path = Commands(str(experiment)), folder / "report.html"
    made = tables(experiment) if made is None else made
    paths = write_report_page(experiment, path, made, "Trial", commands, lambda *_: None, **options)
    return paths[0]


def named(text):
    """Return a sequence's canonical name."""
    return datasets.load(text).name


def state(shown):
    return dict(shown.run("[...state]"))


def seen(shown, **address):
    """Open the player at an address, and wait for its frame."""
    shown.run(f"location.hash = {json.dumps(urlencode(address))}")
    number = address["frame"]
    name = json.dumps(address["sequence"])
    shown.wait(f"scene && scene.name === {name} && paintedFrame === {number}")


def filter_tables(shown, words):
    """Type words into the filter of tables."""
    shown.run(f"byId('filter').value = {json.dumps(words)}")
    shown.run("byId('filter').dispatchEvent(new Event('input'))")


def scroll_to(shown, chart):
    """Scroll to a chart, and wait until it is drawn."""
    shown.wait(
        f"new Promise((done) => {{ byId('{chart}').scrollIntoView({{block: 'center', behavior: "
        "'instant'}); requestAnimationFrame(() => "
        f"done(document.querySelector('#{chart} svg') !== null)); }})"
    )
