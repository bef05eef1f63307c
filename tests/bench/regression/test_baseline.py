"""Baselines as files: what is written, read and refused."""

import hashlib
import struct
import tomllib
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import cv2
import numba
import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from trackmark import trackers
from trackmark.bench.experiments.experiment import ExperimentError, SequenceSpec
from trackmark.bench.regression.baseline import (
    Baseline,
    BaselineError,
    BaselineScore,
    baseline_path,
    box_digest,
    check_equal_scores,
    current_environment,
    read_baseline,
    write_baseline,
)

N_REPETITIONS = 6
ENVIRONMENT = {"platform": "Linux x86_64", "numpy": "2.1"}


def entry(overlap=(0.5,) * N_REPETITIONS, path="s0", **options):
    boxes = tuple(f"{repetition:08x}" for repetition in range(len(overlap)))
    return BaselineScore(SequenceSpec(path, **options), "9f31c2aa", tuple(overlap), boxes)


def baseline(**entries):
    return Baseline(
        {"mine": {"s0": entry(), **entries}, "static": {"s0": entry((0.25,))}},
        {"mine": "a.py:as=mine", "static": "static"},
        N_REPETITIONS,
        0.05,
        ENVIRONMENT,
    )


def test_written_baseline_is_read_unchanged(tmp_path):
    video = entry((0.81234, 0.0, 1.0, 1e-05, 0.3, 0.4), "clips/cup.mp4", truth=Path("cup.csv"))
    stored = baseline(**{"cup.mp4": video, "tracker": entry()})
    stored = stored.with_accepted("mine", stored.scores, 'a "better" update', "2026-11-22")
    write_baseline(stored, tmp_path / "own.toml")
    read = read_baseline(tmp_path / "own.toml")
    assert read.scores == stored.scores
    assert (read.specs, read.n_repetitions, read.detectable_drop) == (
        stored.specs,
        stored.n_repetitions,
        stored.detectable_drop,
    )
    assert read.environment == ENVIRONMENT
    assert read.accepted[0]["reason"] == 'a "better" update'
    write_baseline(read, tmp_path / "again.toml")
    assert (tmp_path / "again.toml").read_bytes() == (tmp_path / "own.toml").read_bytes()


@pytest.mark.parametrize("sign", ["\x7f", "\x1b", "\n", '"', "\\"])
def test_control_character_in_a_text_is_read_unchanged(tmp_path, sign):
    name = f"cup{sign}"
    stored = baseline(**{name: entry(path=f"data/{name}")})
    stored = stored.with_accepted("mine", stored.scores, f"because {sign}", "2026-11-22")
    write_baseline(stored, tmp_path / "own.toml")
    read = read_baseline(tmp_path / "own.toml")
    assert read.scores["mine"][name].source.spec == f"data/{name}"
    assert read.accepted[0]["reason"] == f"because {sign}"


def test_text_that_is_not_utf8_is_refused(tmp_path):
    stored = baseline(s1=entry(path="data/\udcff"))
    with pytest.raises(BaselineError, match=r"own\.toml: .*udcff.* is not valid UTF-8\. Rename"):
        write_baseline(stored, tmp_path / "own.toml")
    assert not list(tmp_path.iterdir())


MINE = "tracker 'mine', sequence 's0', "
LONG = "9" * 400

REFUSED = [
    ("overlap = [0.5,", "overlap = [7.5,", f"{MINE}overlap.0: 7.5. Input should be less than"),
    ("overlap = [0.5,", "overlap = [nan,", f"{MINE}overlap.0: nan. Input should be a finite"),
    ("overlap = [0.5,", "overlap = [", f"{MINE}overlap: [0.5, 0.5, 0.5, 0.5, 0.5]. 5 values; exp"),
    ('box_digests = ["00000000",', "box_digests = [", f"{MINE}box_digests: ['00000001'"),
    ('{ fingerprint = "9f31c2aa", ', "{ ", f"{MINE}fingerprint: 'missing'. Field required"),
    ("repetitions = 6", "repetitions = 7", f"{MINE}overlap: [0.5, 0.5"),
    ("repetitions = 6", "repetitions = 5", "repetitions: 5. Input should be greater"),
    ("repetitions = 6", f"repetitions = {LONG * 11}", "own.toml: not valid TOML: Exceeds the"),
    ('"numpy" = "2.1"', '"numpy" = 2.1', "environment.numpy: 2.1. Input should be a valid string"),
    ("date = ", "date = 2026-11-22 # ", "accepted.0.date: datetime.date(2026, 11, 22). Input sh"),
    ("format = 1", "format = 7", "format: 7. This version reads format 1"),
    ("[specifications]", "[speeds]", "speeds: {'mine': 'a.py:as=mine'}. Extra inputs"),
    ("date = ", 'date = "2026-02-30" # ', "accepted.0.date: '2026-02-30'. Value error"),
    ('[trackers."static"]', '[trackers.""]', "String should have at least 1"),
    (
        '[trackers."static"]\n"s0" = { fingerprint = "9f31c2aa"',
        '[trackers."static"]\n"s0" = { fingerprint = "00000000"',
        "tracker 'static', sequence 's0', fingerprint: '00000000'. Tracker 'mine' has '9f31c2aa'.",
    ),
    (
        '[trackers."static"]\n"s0" = { ',
        '[trackers."static"]\n"s0" = { path = "data/other", ',
        "tracker 'static', sequence 's0', path: 'data/other'. Tracker 'mine' has None.",
    ),
    ('"mine" = "a', '"your" = "a', "specifications: 'your'. The file has no scores of this"),
    ("format", "\udc80", "own.toml: not valid TOML: 'utf-8' codec"),
    ("]", "", "own.toml: "),
]


@pytest.mark.parametrize(("old", "new", "words"), REFUSED)
def test_damaged_baseline_is_refused_in_one_line(tmp_path, old, new, words):
    file = tmp_path / "own.toml"
    stored = baseline()
    write_baseline(stored.with_accepted("mine", stored.scores, "x", "2026-11-22"), file)
    assert old in file.read_text() or old == "]"
    text = file.read_text().replace(old, new, 1)
    file.write_text(text, errors="surrogateescape")
    with pytest.raises(BaselineError) as error:
        read_baseline(file)
    message = str(error.value)
    assert message.startswith(f"{file}: ")
    assert words in message
    assert "`trackmark baseline" in message
    assert "\n" not in message
    assert len(message) < len(str(file)) + 330


def test_missing_baseline_is_named():
    assert baseline_path("own") == Path("baselines/own.toml")
    assert baseline_path("tests/own.toml") == Path("tests/own.toml")
    assert baseline_path("v1.2") == Path("baselines/v1.2.toml")
    with pytest.raises(BaselineError, match="trackmark baseline"):
        read_baseline(Path("nowhere.toml"))


@pytest.mark.parametrize(
    "name", ["", " ", "a/b", "../own", ".", "own ", "a\nb", "_own", ".toml", "x/.toml", "x/ .toml"]
)
def test_invalid_name_of_a_baseline_is_refused(name):
    with pytest.raises(ExperimentError, match=r"not a valid name of a baseline\..* in \.toml\."):
        baseline_path(name)


def test_changed_overlap_of_equal_boxes_is_refused():
    before = baseline().scores
    check_equal_scores(Path("own.toml"), before, {**before, "static": {"s0": entry((0.25004,))}})
    # A tracker that draws random numbers now has the boxes of its old run with one repetition.
    now = {**before, "static": {"s0": entry((0.26,) * N_REPETITIONS)}}
    for entries in ({**before, "static": {"s0": entry((0.26,))}}, now):
        message = (
            r"own.toml: tracker 'static', sequence 's0', overlap.0: 0.25. Runs with these boxes "
            r"have a mean overlap of 0.26 now. Restore the file"
        )
        with pytest.raises(BaselineError, match=message):
            check_equal_scores(Path("own.toml"), before, entries)


@pytest.fixture(scope="module")
def valid(tmp_path_factory):
    file = tmp_path_factory.mktemp("baseline") / "own.toml"
    stored = baseline(s1=entry(path="data/s1", truth=Path("s1.csv")))
    write_baseline(stored.with_accepted("mine", stored.scores, "x", "2026-11-22"), file)
    return file.read_bytes(), file.with_name("mutated.toml")


def assert_read_as_written_or_refused(file):
    try:
        read = read_baseline(file)
    except BaselineError:
        return
    table = tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    assert (read.n_repetitions, read.detectable_drop) == (
        table["repetitions"],
        table["detectable_drop"],
    )
    assert list(read.accepted) == table.get("accepted", [])
    for tracker, entries in table["trackers"].items():
        for name, entry in entries.items():
            stored = read.scores[tracker][name]
            assert list(stored.overlap) == entry["overlap"]
            assert list(stored.box_digests) == entry["box_digests"]
            assert stored.fingerprint == entry["fingerprint"]
            assert all(0 <= score <= 1 for score in stored.overlap)
    again = file.with_name("again.toml")
    write_baseline(read, again)
    assert read_baseline(again) == read


@given(data=st.data())
def test_mutated_bytes_are_read_exactly_or_refused(valid, data):
    content, file = valid
    start = data.draw(st.integers(0, len(content)))
    length = data.draw(st.integers(0, 12))
    piece = data.draw(st.binary(max_size=4) | st.sampled_from([b"9", b"-", b'"', b"inf", b"\x7f"]))
    file.write_bytes(content[:start] + piece + content[start + length :])
    assert_read_as_written_or_refused(file)


def test_surroundings_need_no_name_of_a_distribution(monkeypatch):
    """OpenCV is installed under many names, by Conda without any."""

    def version(name):
        raise PackageNotFoundError(name)

    monkeypatch.setattr("importlib.metadata.version", version)
    libraries = {"numpy": np, "numba": numba, "opencv": cv2, "scipy": scipy}
    expected = {name: module.__version__ for name, module in libraries.items()}
    assert expected.items() <= current_environment().items()


def test_box_digest_equals_slow_definition():
    boxes = np.array([[1.0004, 2.0006, 3, 4], [np.nan] * 4, [-1e300, 1e9, 5e6, 0.1]])
    numbers = [1000, 2001, 3000, 4000, *[-(2**31)] * 4, -(2**31), 2**31 - 1, 2**31 - 1, 100]
    digest = hashlib.sha256(struct.pack("<12i", *numbers)).hexdigest()[:8]
    assert box_digest(boxes) == digest


def test_project_baseline_has_all_distinct_presets():
    """A preset whose parameters equal those of an earlier one is left out: it gives equal runs."""
    stored = read_baseline(Path(__file__).parents[2] / "baseline.toml")
    labels = {"opencv-camshift", "opencv-mil"}
    for name in trackers.names():
        if not name.startswith("opencv-"):
            by_parameters = {}
            for preset in trackers.describe(name)["presets"]:
                label = name if preset == "recommended" else f"{name}:preset={preset}"
                by_parameters.setdefault(
                    repr(trackers.resolve(name, preset=preset).parameters), label
                )
            labels |= set(by_parameters.values())
    assert set(stored.scores) == labels
    assert len({tuple(entries) for entries in stored.scores.values()}) == 1
