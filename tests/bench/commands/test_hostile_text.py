"""Numbers, names and texts at the edge of what formats can hold, as a user meets them."""

from xml.etree import ElementTree

import pytest

SMALL = ("--sequences", "data/Small")
BOTH = ("--sequences", "data/Small,data/Other")


@pytest.fixture
def two(tmp_path, otb):
    otb(tmp_path / "data" / "Other", 5)


def test_check_junit_escapes_what_xml_cannot_hold(trackmark, tmp_path, spoil):
    trackmark("baseline", "own", "--trackers", "knob.py:Knob", *SMALL)
    spoil("raise ValueError('red' + chr(27) + chr(0) + chr(0xFFFE) + chr(0xD800))")
    files = ("--junit", "check.xml", "--markdown", "check.md")
    trackmark("check", "own", *files, status=1)
    failure, _mean = ElementTree.parse(tmp_path / "check.xml").iter("failure")
    assert "red\\u001b\\u0000\\ufffe\\ud800" in failure.get("message")
    assert "ValueError: red" in (tmp_path / "check.md").read_text()


def test_check_because_rejects_text_that_is_not_utf8(trackmark, tmp_path):
    trackmark("baseline", "own", "--trackers", "static", *SMALL)
    before = (tmp_path / "baselines" / "own.toml").read_bytes()
    accept = ("check", "own", "--accept", "static", "--because")
    message = trackmark(*accept, "\udcff", status=2).stderr
    assert "--because" in message
    assert "not UTF-8" in message
    assert (tmp_path / "baselines" / "own.toml").read_bytes() == before
    trackmark(*accept, "delete \x7f and escape \x1b")
    trackmark("check", "own")


@pytest.mark.parametrize("name", ["NA", "nan", "None", "null"])
def test_compare_published_accepts_a_tracker_named_na(trackmark, tmp_path, two, name):
    trackmark("run", "--trackers", "static", *BOTH, "--name", "ours")
    rows = f"tracker,sequence,mean_overlap\n{name},Small,0.5\n{name},Other,0.6\n"
    (tmp_path / "published.csv").write_text(rows)
    compared = trackmark("compare", "--results", "results/ours", "--published", "published.csv")
    assert f"{name} (published)" in compared.stdout


HUGE = """self.count = getattr(self, "count", 0) + 1
        return Estimate(numpy.array([
            [1e308, 1e308, 1e308, 1e308],
            [-1e308, -1e308, 1e308, 1e308],
            [0.0, 0.0, 1e308, 1e308],
            [1e308, 0.0, 1e-308, 1e308],
        ][self.count % 4]))"""


def test_boxes_of_1e308_are_scored_without_a_warning(trackmark, tmp_path, two):
    file = tmp_path / "knob.py"
    source = file.read_text()
    act = "return Estimate(self.box + [self.random.random(), 0, 0, 0])"
    assert act in source
    file.write_text(
        source.replace(act, HUGE).replace("from pydantic", "import numpy\nfrom pydantic")
    )
    # Warnings are errors in tests.
    command = ("run", "--trackers", "static,knob.py:Knob", *BOTH, "--name", "ours")
    assert "4 of 4 runs" in trackmark(*command, "--seeds", 1).stdout
    presets = "native,otb,lasot,got10k,trackingnet,long-term"
    trackmark("report", "results/ours", "--metrics", presets, "--folder", "report")
    compared = trackmark("compare", "--results", "results/ours")
    anchors = (*command[:-1], "anchors", "--protocol", "anchors", "--seeds", 1)
    trackmark(*anchors)
    trackmark("report", "results/anchors", "--metrics", "vot-anchor", "--format", "text")
    trackmark("show", "data/Small", "--results", "results/ours", "--output", "shown.mp4")
    assert "static" in compared.stdout


LOOPS = [
    ("run", "loop.toml"),
    ("run", "--trackers", "static", "--sequences", "loop"),
    ("run", "--trackers", "loop.py", *SMALL),
    ("run", "--trackers", "static", *SMALL, "--output", "loop"),
    ("describe", "loop"),
    ("describe", "loop/tracker.py"),
    ("show", "data/Small", "--output", "loop.png"),
    ("show", "data/Small", "--results", "loop", "--output", "shown.png"),
    ("annotate", "data/Small/img", "--box", "0:1,1,9,9", "--box", "4:1,1,9,9", "--output")
    + ("loop.csv",),
    ("report", "loop"),
    ("compare", "--results", "loop"),
    ("results", "list", "loop"),
    ("results", "merge", "data", "loop"),
    ("baseline", "loop.toml", "--trackers", "static", *SMALL),
    ("check", "loop.toml"),
]


@pytest.mark.parametrize("arguments", LOOPS, ids=" ".join)
def test_a_loop_of_symbolic_links_is_one_line(trackmark, one_line, tmp_path, arguments):
    for name in ("loop", "loop.toml", "loop.py", "loop.png", "loop.csv"):
        (tmp_path / name).symlink_to(name)
    assert "loop" in one_line(trackmark(*arguments, status=2))


def test_a_loop_among_the_images_is_one_line(trackmark, one_line, tmp_path):
    image = tmp_path / "data" / "Small" / "img" / "0003.png"
    image.unlink()
    image.symlink_to("0003.png")
    line = one_line(trackmark("run", "--trackers", "static", *SMALL, status=2))
    assert "0003.png" in line


@pytest.mark.parametrize("option", ["--junit", "--markdown"])
@pytest.mark.parametrize("place", ["knob.py/out", "x" * 300, "loop"])
def test_check_names_the_file_that_it_cannot_write(trackmark, tmp_path, option, place):
    (tmp_path / "loop").symlink_to("loop")
    trackmark("baseline", "own", "--trackers", "static", *SMALL)
    message = trackmark("check", "own", option, place, status=2).stderr
    assert f"{place}: cannot write (" in message


def test_compare_folder_names_the_file_it_cannot_write(trackmark, tmp_path, two):
    trackmark("run", "--trackers", "static,knob.py:Knob", *BOTH, "--name", "ours")
    command = ("compare", "--results", "results/ours", "--folder", "knob.py/out")
    message = trackmark(*command, status=2).stderr
    assert "knob.py/out/comparison.txt: cannot write (Not a directory)." in message


def test_an_oserror_without_a_file_name_is_one_line(trackmark, one_line, monkeypatch):
    def fail(*_):
        raise OSError(24, "Too many open files")

    monkeypatch.setattr("trackmark.bench.store.layout.experiment_folders", fail)
    line = one_line(trackmark("results", "list", "results", status=2))
    assert line == "trackmark: Too many open files."


@pytest.mark.parametrize("key", ["trackers", "sequences"])
def test_a_nul_in_an_experiment_is_one_line(trackmark, one_line, tmp_path, key):
    names = {"trackers": "static", "sequences": "data/Small"}
    names[key] = {"trackers": "a\\u0000.py", "sequences": "data/\\u0000"}[key]
    lines = [f'{name} = ["{text}"]' for name, text in names.items()]
    (tmp_path / "trial.toml").write_text("\n".join(["version = 1", *lines]))
    one_line(trackmark("run", "trial.toml", status=2))


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "--trackers", "static", *SMALL, "--name", "\udcff"),
        ("run", "--trackers", "\udcff.py", *SMALL),
    ],
    ids=["name", "file"],
)
def test_an_argument_that_is_not_utf8_is_one_line(trackmark, one_line, tmp_path, arguments):
    (tmp_path / "knob.py").rename(tmp_path / "\udcff.py")
    line = one_line(trackmark(*arguments, status=2))
    assert "\\udcff" in line
    assert "UTF-8" in line
    assert not (tmp_path / "results").exists()


def test_a_live_page_may_have_a_name_that_is_not_utf8(trackmark, tmp_path):
    trackmark("show", "data/Small", "--live", "static", "--output", "\udcff.html")
    assert "%FF" in (tmp_path / "\udcff.html").read_text()
