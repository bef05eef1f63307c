"""Results in a notebook: complete HTML without injected markup."""

import json
import re
from html.parser import HTMLParser

import pytest

import trackmark as tm
from tests.bench.pages.reading import address_of

NAME = "\"><script>alert('x')⁄<!-- ключ 跟踪"


class Tags(HTMLParser):
    """Parser that collects unclosed elements and all attributes."""

    def __init__(self, text):
        super().__init__()
        self.open, self.seen, self.text = [], [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.open.append(tag)
        self.seen.append((tag, dict(attributes)))

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


def test_notebook_shows_results_as_table(results):
    loaded = tm.load_runs(results)
    assert len(loaded) == 4
    tags = Tags(loaded._repr_html_())
    assert tags.open == []
    assert {tag for tag, _ in tags.seen} <= {
        *["table", "caption", "thead", "tbody", "tr", "th", "td", "p", "b"]
    }
    assert not any(attributes for _, attributes in tags.seen)
    assert NAME in tags.text
    mean = loaded.means()["mean_overlap"]["knob.py:Knob"]
    assert f"{mean:.3f}" in tags.text


def test_player_is_page_of_one_sequence_in_sandbox(results, tmp_path):
    player = tm.player(tm.load_runs(results), NAME, 2, "knob.py:Knob")
    tags = Tags(player._repr_html_())
    ((tag, attributes),) = tags.seen
    assert tag == "iframe"
    assert "allow-same-origin" not in attributes["sandbox"]
    assert attributes["srcdoc"] == player.page
    data = json.loads(re.search(r'id="data">(.*?)</script>', player.page, re.S)[1])
    assert [entry["name"] for entry in data["sequences"]] == [NAME]
    assert len(data["sequences"][0]["runs"]) == 2
    address = address_of(f"#{data['start']}", data)
    assert address.endswith("tracker=knob.py%3AKnob&repetition=0&frame=2")
    assert "alert('x')" not in player.page
    player.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text() == player.page


def test_player_lists_valid_names_in_errors(results):
    for arguments, words in (
        (("gone",), "no run on 'gone'. Expected one of: .*Small"),
        (("Small", 0, "camshift"), "No run of 'camshift'.*static"),
        (("Small", 5), "no frame 5. Expected: 0 to 4"),
    ):
        with pytest.raises(ValueError, match=words):
            tm.player(results, *arguments)
    supervised = tm.evaluate("static", "samples/face", protocol="supervised")
    with pytest.raises(ValueError, match="The player shows one-pass runs only, and there are none"):
        tm.player(supervised, "face")
    assert "frame=0" in tm.player(results, "data/Small").page
