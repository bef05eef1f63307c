"""Which sequences a command is asked for, and what is seen while they are opened."""

import io
import json
import shutil
import threading
import zlib

import pytest

from trackmark import datasets
from trackmark.bench.commands import _options
from trackmark.bench.commands._options import chosen_sequences
from trackmark.bench.execution import plan
from trackmark.bench.store.results import Results


@pytest.fixture
def places(here, otb, monkeypatch):
    """Folders with sequences of OTB, of images and of DAVIS, and with what is no sequence."""
    monkeypatch.chdir(here)
    for number in (10, 2):
        otb(here / "data" / f"walk{number}", 2)
        shutil.copytree(here / "data" / f"walk{number}" / "img", here / f"shots/day{number}")
    (here / "data" / "notes.txt").write_text("walk2 is the best")
    for kind in ("JPEGImages", "Annotations"):
        shutil.copytree(here / "shots" / "day2", here / "davis" / kind / "480p" / "bear")
    return here


DAYS = ["shots/day2", "shots/day10"]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("data/walk2", ["data/walk2"]),
        ("data", ["data/Small", "data/walk2", "data/walk10"]),
        ("data/", ["data/Small", "data/walk2", "data/walk10"]),
        ("data/walk*", ["data/walk2", "data/walk10"]),
        ("d?ta/walk?", ["data/walk2"]),
        ("*/day?", ["shots/day2"]),
        ("shots/day2,s*ts", ["shots/day2", "shots/day10"]),
        (".", ["data/Small", "data/walk2", "data/walk10", "davis/bear", *DAYS]),
        ("davis", ["davis/bear"]),
        ("davis/b*", ["davis/bear"]),
        ("davis/JPEGImages/480p", ["davis/JPEGImages/480p/bear"]),
        ("plain/*:scene=3", ["plain/target:scene=3"]),
        ("stress", ["stress/pillar", "stress/twin"]),
    ],
)
def test_patterns_and_folders_stand_for_their_sequences(places, text, names):
    assert [source.text for source in chosen_sequences(text, None)] == names


def test_an_absolute_pattern_is_one_too(places):
    (found,) = chosen_sequences(str(places / "*" / "walk2"), None)
    assert found.text == str(places / "data" / "walk2")


def test_a_suite_is_all_its_sequences(places):
    assert datasets.matching("samples") == datasets.matching("samples/*")
    assert len(datasets.matching("samples")) == 2


def test_a_folder_is_run_as_a_whole(trackmark, places):
    run = ("run", "--trackers", "static", "--sequences", "data")
    said = trackmark(*run, "--json").stdout
    assert {json.loads(row)["sequence"] for row in said.splitlines()} == {
        "Small",
        "walk2",
        "walk10",
    }
    took = "data/Small and 2 more: taken for a folder with img/ and groundtruth_rect.txt (OTB)."
    assert took in trackmark(*run).stdout.splitlines()


@pytest.mark.parametrize(
    ("text", "names", "kind"),
    [
        ("data", ["data/Small", "data/walk2", "data/walk10"], "(OTB)"),
        ("davis", ["davis/bear"], "(DAVIS)"),
        ("shots/day?", ["shots/day2"], "images"),
        ("stress", ["stress/pillar", "stress/twin"], "built-in"),
    ],
)
def test_a_folder_or_pattern_is_described_by_what_it_stands_for(
    trackmark, places, text, names, kind
):
    said = trackmark("describe", text).stdout
    assert kind in said
    assert said.splitlines()[-len(names) :] == [f"  {name}" for name in names]
    about = json.loads(trackmark("describe", text, "--json").stdout)
    assert (about["of them"], about["sequences"]) == (names, len(names))


@pytest.mark.parametrize("text", ["multipat/*", "data/*.mp4", "nowhere/*", "data/n*"])
def test_a_pattern_that_matches_nothing_names_the_nearest_few(trackmark, one_line, places, text):
    line = one_line(trackmark("run", "--trackers", "static", "--sequences", text, status=2))
    assert text in line
    assert "trackmark list sequences" in line
    assert len(line) < 320
    assert ("multipart/" in line) == text.startswith("multi")


def test_a_sweep_that_nobody_runs_is_refused_with_its_count(trackmark, one_line, here):
    many = ", ".join(map(str, range(1000)))
    (here / "trial.toml").write_text(
        'version = 1\ntrackers = ["static"]\nsequences = [{ name = "plain/target", '
        f"scene = [{many}], noise = [{many}], blur = [{many}] }}]\n"
    )
    line = one_line(trackmark("run", "trial.toml", status=2))
    assert "trial.toml: sequences sweeps over 1000000000 combinations" in line


def test_a_hundred_thousand_sequences_are_asked_for_at_once(here):
    many = tuple(_options.SequenceSource(f"plain/target:scene={i}") for i in range(100_000))
    assert len(plan.Experiment("many", ("static",), many).sequences) == 100_000
    with pytest.raises(plan.ExperimentError, match="'plain/target:scene=7' is named twice"):
        plan.Experiment("many", ("static",), (*many, many[7]))


def test_opening_that_takes_long_is_told_with_how_far_it_is(trackmark, places, monkeypatch):
    told = threading.Event()
    echo = _options.click.echo

    def heard(text="", **how):
        echo(text, **how)
        if "1 of 3" in str(text):
            told.set()

    def slow(source, protocol, planned=plan._planned):
        if source.text == "data/walk2":  # the second of three
            assert told.wait(300)
        return planned(source, protocol)

    monkeypatch.setattr(_options, "PATIENCE", 0.01)
    monkeypatch.setattr(_options.click, "echo", heard)
    monkeypatch.setattr(plan, "_planned", slow)
    said = trackmark("run", "--trackers", "static", "--sequences", "data", "--dry-run")
    assert "Opening sequences: 1 of 3 …" in said.stderr.splitlines()
    assert "Opening" not in said.stdout


@pytest.mark.parametrize("number", [1, 4])
def test_an_image_that_claims_too_much_is_told_in_the_sequences_name_and_blames_no_tracker(
    trackmark, one_line, here, number
):
    image = here / "data" / "Small" / "img" / f"{number:04}.png"
    head = b"IHDR" + (60000).to_bytes(4, "big") * 2 + image.read_bytes()[24:29]
    check = zlib.crc32(head).to_bytes(4, "big")
    image.write_bytes(image.read_bytes()[:12] + head + check + image.read_bytes()[33:])
    line = one_line(trackmark("run", "--trackers", "static", "--sequences", "data/Small", status=2))
    assert f"{number:04}.png: frame {number - 1} can't be read (it claims 60000x60000" in line
    assert not [cell for file in here.glob("results/*") for cell in Results(file).cells()]


class Terminal(io.StringIO):
    """Notes down what is written, and tells of a bar."""

    def __init__(self):
        super().__init__()
        self.told = threading.Event()

    def isatty(self):
        return True

    def write(self, text):
        if "0/2" in text:
            self.told.set()
        return super().write(text)


def test_work_of_which_nothing_is_seen_yet_is_told(monkeypatch):
    told = threading.Event()
    monkeypatch.setattr(_options, "PATIENCE", 0.01)
    monkeypatch.setattr(
        _options.click,
        "echo",
        lambda text, err: err and text == "Waiting for the first frame …" and told.set(),
    )
    with _options.progress_bar(2, "frame") as show:
        assert told.wait(300)
        show(1)


def test_on_a_terminal_the_bar_itself_shows_and_ends_its_line(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(_options, "PATIENCE", 0.01)
    monkeypatch.setattr(_options, "progress_outlet", lambda: terminal)
    with _options.progress_bar(2, "frame"):
        assert terminal.told.wait(300)
    assert terminal.getvalue().endswith("\n")
    assert "Waiting" not in terminal.getvalue()
