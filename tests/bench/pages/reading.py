"""A page written, read, and opened in a browser."""

import json
import re
from html.parser import HTMLParser
from urllib.parse import urlencode

from trackmark import datasets
from trackmark.bench.pages.report import Commands, write_report_page
from trackmark.bench.reporting.tables import tables


class Cells(HTMLParser):
    """Tables of a page, as somebody reads them who knows nothing of ours."""

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
    """What a page's scripts know."""
    return json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])


def written(experiment, folder, **options):
    """The page of an experiment."""
    said = Commands(str(experiment))
    made = tables(experiment)
    paths = write_report_page(
        experiment, folder / "report.html", made, "Trial", said, lambda *_: None, **options
    )
    return paths[0]


def named(text):
    """A sequence's canonical name."""
    return datasets.load(text).name


def state(shown):
    return dict(shown.run("[...state]"))


def seen(shown, **address):
    """Open the player at an address, and wait for its frame."""
    shown.run(f"location.hash = {json.dumps(urlencode(address))}")
    number = address["frame"]
    name = json.dumps(address["sequence"])
    shown.wait(f"scene && scene.name === {name} && paintedFrame === {number}")
