"""Helpers that write a page, read it, and open it in a browser."""

import json
import re
from base64 import b64decode
from html.parser import HTMLParser
from urllib.parse import urlencode

import numpy as np

from trackmark import datasets
from trackmark.bench.analysis.run_tables import tables
from trackmark.bench.pages.report import ReportPage
from trackmark.bench.protocols import ONE_PASS
from trackmark.bench.store.runs import Runs

DEFAULTS = {"has_revised": False, "failure": "", "is_ellipse": False, "maps": [], "numbers": False}
DEFAULTS |= {"repetition": 0, "start": 0, "start_label": "", "scored": [], "restarts": []}
"""Values that the data of a page omit."""


class Cells(HTMLParser):
    """Parser of the tables in the HTML of a page, which omits end tags that HTML implies."""

    def __init__(self, text):
        super().__init__()
        self.tables, self.links, self.tags = {}, [], []
        self._table = self._row = self._cell = None
        self._data = data_of(text)
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.tags.append(tag)
        if tag == "table":
            self._table = self.tables[values["id"]] = []
        if tag in ("td", "th", "tr"):
            self._cell = None
        if tag == "tr":
            self._row = []
            self._table.append(self._row)
        if tag in ("td", "th"):
            self._cell = {"text": "", "link": None}
            self._row.append(self._cell)
        if tag == "a" and self._cell is not None:
            self._cell["link"] = address_of(values["href"], self._data)

    def handle_endtag(self, tag):
        if tag in ("thead", "tbody", "tfoot", "table"):
            self._cell = None

    def handle_data(self, text):
        if self._cell is not None:
            self._cell["text"] += text


def address_of(link, data):
    """Return the address that a link in numbers selects: sequence, tracker, repetition, frame, …"""
    if not re.match(r"#\d+\.\d+\.", link):
        return link
    sequence, tracker, repetition, frame, *details = link[1:].split(".")
    start, revised, *show = details or "00"
    address = {"sequence": data["sequences"][int(sequence)]["name"]}
    address |= {"tracker": data["labels"][int(tracker)], "repetition": repetition, "frame": frame}
    more = {
        "start": start.strip("0"),
        "trajectory": "revised" * int(revised),
        "show": ".".join(show),
    }
    return "#" + urlencode(address | {key: text for key, text in more.items() if text})


def frames_in(chunk):
    """Return the frames of a chunk; before each frame is its size in four bytes."""
    frames, rest = [], b64decode(chunk)
    while rest:
        end = 4 + int.from_bytes(rest[:4], "little")
        frames.append(rest[4:end])
        rest = rest[end:]
    return frames


def rows_of_sequences(text):
    """Return the rows of the folded tables of all sequences, each after the sequence's name."""
    tables = Cells(text).tables
    return [
        [sequence["name"], *row]
        for number, sequence in enumerate(data_of(text)["sequences"])
        for row in tables.get(f"scores-{number}", [])[1:]
    ]


def data_of(text):
    """Return the data of a page's scripts."""
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])
    for sequence in data["sequences"]:
        sequence["runs"] = [DEFAULTS | run for run in sequence["runs"]]
    return data


def write_experiment_page(experiment, folder, report_tables=None, **options):
    """Write the page of an experiment, by default with its own tables."""
    runs = Runs.open(experiment)
    page = ReportPage(runs, tables(runs) if report_tables is None else report_tables)
    return page.write(folder / "report.html", "Trial", lambda *_: None, **options)[0]


def stored_runs(experiment, **fields):
    """Return the runs of an experiment with their rows and ground truths, by default one-pass."""
    runs = Runs.open(experiment)
    return runs.read(runs.evaluated_rows(**{"protocol": ONE_PASS, **fields}))


def failing_tracker(frame, step=0):
    """Return the source of a tracker that fails in a frame; until then its box moves faster."""
    return f"""
class Failing:
    def init(self, image, box):
        self.box, self.frame = box, 0

    def update(self, image):
        self.frame += 1
        if self.frame == {frame}:
            raise ValueError("no <b>colour</b> is left")
        return self.box + [{step} * self.frame, 0, 0, 0]
"""


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
    browser.wait(f"sequence && sequence.name === {name} && paintedFrame === {number}")


def curves_of(text, chart):
    """Return points and places of the lines of a chart by tracker: arrays x, y, and texts."""
    figure = re.search(f'<figure class="chart" id="{chart}".*?</figure>', text, re.S)[0]
    left, right, low, high, bottom, top, least, most = map(
        float, re.search(r'data-scale="(.*?)"', figure)[1].split()
    )
    labels, curves = data_of(text)["labels"], {}
    for number, path, _, places in re.findall(
        r'data-k="(\d+)"[^>]* d="(.*?)"( data-positions="(.*?)")?/>', figure
    ):
        assert path.count("M") == 1
        points = np.reshape(re.findall(r"-?[\d.]+", path), (-1, 2)).astype(float).cumsum(axis=0)
        x = low + (points[:, 0] - left) / (right - left) * (high - low)
        y = least + (bottom - points[:, 1]) / (bottom - top) * (most - least)
        curves[labels[int(number)]] = x, y, places.split()
    return curves


def size_without_frames(text):
    """Return the number of characters of a page without the frames and boxes of its player."""
    text = re.sub(r'<script type="text/plain".*?</script>', "", text, flags=re.S)
    return len(re.sub(r"data:image/webp;base64,[^\"]*", "", text))


def violations(opened, axe):
    """Return the rules that a page violates, with the first element."""
    opened.run(f"{axe}; 0")
    entries = opened.run("axe.run(document).then((result) => result.violations)")
    return [(entry["id"], entry["nodes"][0]["html"][:200]) for entry in entries]


def check_accessibility(chromium, axe, paths, width, dark):
    for path in paths:
        chromium.console.clear()
        chromium.size(width, 900, dark=dark, mobile=width < 400, still=True)
        chromium.open(path.as_uri())
        chromium.run(
            "document.querySelectorAll('details.fold').forEach((one) => { one.open = true; })"
        )
        assert chromium.run("document.documentElement.scrollWidth") <= width, (path, width)
        cut = (
            "[...document.querySelectorAll('main :is(td, th)')].filter((cell) => {"
            " const { right } = cell.getBoundingClientRect();"
            " return right > innerWidth && !cell.closest('.wide'); }).length"
        )
        assert chromium.run(cut) == 0, (path, width)
        broken_rules = violations(chromium, axe)
        assert not broken_rules, (path, broken_rules)
        assert chromium.console == []


class Texts(HTMLParser):
    """Parser that collects captions, and the texts of sections."""

    def __init__(self, text):
        super().__init__()
        self.captions, self.sections, self._in = [], [], None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        classes = dict(attributes).get("class") or ""
        if tag == "section":
            self.sections.append("")
        if tag == "figcaption" or (tag == "p" and classes == "cap"):
            self.captions.append("")
            self._in = tag

    def handle_endtag(self, tag):
        if tag == self._in:
            self._in = None

    def handle_data(self, text):
        if self._in:
            self.captions[-1] += text
        if self.sections:
            self.sections[-1] += text


def check_texts(*paths):
    """Check that captions are short, and that no section or table is empty."""
    for path in paths:
        text = path.read_text()
        texts = Texts(text.partition("</main>")[0])
        assert texts.captions
        assert max(map(len, texts.captions)) <= 160, max(texts.captions, key=len)
        assert all(len(section.split()) > 4 for section in texts.sections)
        for table in re.findall(r"<tbody>.*?</tbody>", text, re.S):
            cells = re.findall(r"<td[^>]*>(.*?)(?=<t[dhr]\b|</tbody>)", table, re.S)
            dashes = [re.sub("<.*?>", "", cell).strip() in ("—", "–") for cell in cells]
            assert not all(dashes) or "heat" in text.partition(table)[0][-900:]
