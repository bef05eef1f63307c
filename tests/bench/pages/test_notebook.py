"""Results in a notebook: what it is given is HTML, whole and without others' markup."""

import json
import re
from html.parser import HTMLParser

import pandas as pd
import pytest

from trackmark import bench

NAME = "\"><script>alert('x')⁄<!-- ключ 跟踪"


class Tags(HTMLParser):
    """Elements that are open at the end, and the attributes of all."""

    def __init__(self, text):
        super().__init__()
        self.open, self.seen, self.text = [], [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, given):
        self.open.append(tag)
        self.seen.append((tag, dict(given)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        self.text += text


@pytest.fixture
def results(trackmark, workspace, otb):
    otb(workspace / "data" / NAME, 4)
    where = f"data/{NAME},data/Small"
    trackmark("run", "--trackers", "static,knob.py:Knob", "--sequences", where, "--name", "mine")
    return workspace / "results"


def test_results_are_a_data_frame_that_a_notebook_shows_as_tables(results):
    runs = bench.load_results(results)
    assert len(runs) == 4
    assert type(runs[runs["tracker"] == "static"]) is pd.DataFrame
    shown = Tags(runs._repr_html_())
    assert shown.open == []
    assert {tag for tag, _ in shown.seen} <= {
        *["table", "caption", "thead", "tbody", "tr", "th", "td", "p", "b"]
    }
    assert not any(given for _, given in shown.seen)
    assert NAME in shown.text
    mean = runs["mean_overlap"][runs["tracker"] == "knob.py:Knob"].mean()
    assert f"{mean:.3f}" in shown.text


def test_a_player_is_a_page_of_one_sequence_in_a_frame_of_its_own(results, tmp_path):
    made = bench.player(bench.load_results(results), NAME, "knob.py:Knob", frame=2)
    shown = Tags(made._repr_html_())
    ((tag, given),) = shown.seen
    assert tag == "iframe"
    assert "allow-same-origin" not in given["sandbox"]
    assert given["srcdoc"] == made.page
    data = json.loads(re.search(r'id="data">(.*?)</script>', made.page, re.S)[1])
    assert [scene["name"] for scene in data["scenes"]] == [NAME]
    assert len(data["scenes"][0]["takes"]) == 2
    assert data["start"].endswith("tracker=knob.py%3AKnob&repetition=0&frame=2")
    assert "alert('x')" not in made.page
    made.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text() == made.page


def test_player_lists_valid_names_in_errors(results):
    for arguments, words in (
        (("gone",), "no run on 'gone'. Expected one of: .*Small"),
        (("Small", "camshift"), "No run of 'camshift'.*static"),
        (("Small", None, 0, 5), "no frame 5. Expected: 0 to 4"),
    ):
        with pytest.raises(ValueError, match=words):
            bench.player(results, *arguments)
    assert "frame=0" in bench.player(results, "data/Small").page
