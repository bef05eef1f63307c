"""Catalogue of sequences: names, paths, specifications with options, and errors."""

import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.spec_string import format_text, parse_text


@pytest.fixture
def workdir(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_names_are_sorted_and_unique():
    names = datasets.names()
    assert names == sorted(set(names))
    assert {"samples/bow-tie", "samples/face"} <= set(names)
    assert datasets.load("samples/face").name == "samples/face"


def test_import_and_descriptions_load_no_heavy_library():
    code = (
        "import sys\nfrom trackmark import datasets\n"
        "for name in datasets.names(): datasets.options(name), datasets.sequence_size(name)\n"
        "heavy = {'cv2', 'av', 'numba', 'pandas', 'matplotlib', 'simplejpeg'}\n"
        "print(heavy & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "set()"


class TestPaths:
    @pytest.mark.parametrize("text", ["./samples/face", "x/../samples/face", "{root}/samples/face"])
    def test_built_in_name_has_priority_over_bare_text(self, workdir, write_images, text):
        (workdir / "x").mkdir()
        write_images(workdir / "samples" / "face", ["1.png"])
        assert len(datasets.load("samples/face")) == 120
        assert len(datasets.load(text.format(root=workdir))) == 1
        assert len(datasets.load((workdir / "samples" / "face").relative_to(workdir))) == 1

    @pytest.mark.parametrize(
        ("folder", "text", "name"),
        [
            ("samples/mine", "samples/mine", "mine"),
            ("take:2=b", "take:2=b", "take:2=b"),
            ("walk", "~/walk", "walk"),
            ("walk", "walk/.", "walk"),
            ("walk", "../{workdir.name}/walk/", "walk"),
        ],
    )
    def test_sequence_of_a_path_is_named_after_the_folder(
        self, workdir, write_images, monkeypatch, folder, text, name
    ):
        monkeypatch.setenv("HOME", str(workdir))
        write_images(workdir / folder, ["1.png"])
        assert datasets.load(text.format(workdir=workdir)).name == name

    @pytest.mark.parametrize("text", [".", "./", "../walk"])
    def test_relative_path_opens_the_current_folder(self, workdir, write_images, monkeypatch, text):
        write_images(workdir / "walk", ["1.png"])
        monkeypatch.chdir(workdir / "walk")
        assert datasets.load(text).name == "walk"

    def test_specific_reader_has_priority_over_image_folder(self, workdir, write_otb):
        folder = write_otb(workdir / "Dog", "1,1,5,5\n" * 3)
        (folder / "img" / "0003.jpg").rename(folder / "preview.jpg")
        (folder / "groundtruth_rect.txt").write_text("1,1,5,5\n" * 2)
        assert datasets.load(folder).present.tolist() == [True, True]


class TestErrors:
    @pytest.mark.parametrize(
        ("text", "closest"),
        [
            ("samples/fase", "samples/face"),
            ("sample/bow-tie", "samples/bow-tie"),
            ("samples/fase:scene=2", "samples/face"),
            ("recorded/wolk", "recorded/walk"),
        ],
    )
    def test_unknown_name_suggests_the_closest(self, workdir, write_images, text, closest):
        write_images(workdir / "recorded" / "walk", ["1.png"])
        with pytest.raises(SequenceError) as error:
            datasets.load(text)
        message = str(error.value)
        assert f"unknown sequence '{text}'. Did you mean '{closest}'?" in message
        assert str(workdir / text) in message
        assert "\n" not in message

    @pytest.mark.parametrize(
        ("text", "truth", "message"),
        [
            ("qqqqqq", None, r"unknown sequence 'qqqqqq'\. It is not"),
            ("samples/face:x", None, "sequence 'samples/face:x': 'x' is not key=value"),
            ("walk", "gone.csv", r"gone\.csv: this ground-truth file does not exist"),
            ("samples/face", "t.csv", r"samples/face: .* own ground truth\. Omit t\.csv"),
            ("empty", None, r"empty: this is not in a format .* contains nothing\. .*list formats"),
            ("almost", None, r"almost: this is an inc.* contains 'img/, truth\.mat'\. .*\(OTB\)"),
            ("notes.txt", None, r"notes\.txt: .*_rect\.txt.*\.mp4.*\.png.*truth\.csv"),
        ],
    )
    def test_unreadable_sequence_names_the_reason(
        self, workdir, write_images, text, truth, message
    ):
        write_images(workdir / "walk", ["1.png"])
        (workdir / "notes.txt").write_text("")
        (workdir / "empty").mkdir()
        (workdir / "almost" / "img").mkdir(parents=True)
        (workdir / "almost" / "truth.mat").write_text("")
        with pytest.raises(SequenceError, match=message) as error:
            datasets.load(text, truth)
        assert ("(VOT)" in str(error.value)) == (text == "notes.txt")

    def test_summary_and_identity_of_unknown_names_are_refused(self):
        with pytest.raises(SequenceError, match="wang2010/cup"):
            datasets.sequence_size("wang2010/cupp")
        with pytest.raises(SequenceError, match="scene"):
            datasets.name_and_fingerprint("plain/target:scnee=3")
        with pytest.raises(SequenceError, match="nowhere"):
            datasets.name_and_fingerprint("nowhere/to-be-found")


@pytest.mark.parametrize(
    "text",
    ["plain/target", "plain/target:scene=3:noise=4", "samples/face", "plain/target:filter.noise=4"],
)
def test_identity_agrees_with_the_opened_sequence(text):
    sequence = datasets.load(text)
    assert datasets.name_and_fingerprint(text) == (sequence.name, sequence.fingerprint)


WORDS = st.text("abcdefghij-_/.0123456789", min_size=1)


@given(name=WORDS, options=st.dictionaries(WORDS, WORDS))
def test_formatted_text_is_parsed_back(name, options):
    assert parse_text(format_text(name, options)) == (name, options)


def test_options_keep_their_order_and_values():
    assert list(parse_text("a:z=1:b=2:m=3")[1]) == ["z", "b", "m"]
    assert parse_text("a:b=c=d:e=") == ("a", {"b": "c=d", "e": ""})


@pytest.mark.parametrize("text", ["a:b", "a:", "a:=3", "a:b=1::c=2"])
def test_option_without_key_or_value_is_refused(text):
    with pytest.raises(ValueError, match=r"is not key=value"):
        parse_text(text)
    with pytest.raises(ValueError, match=r"'b' is given twice"):
        parse_text("a:b=1:b=1")


@pytest.mark.parametrize(
    ("value", "text"),
    [(True, "true"), (False, "false"), (3.0, "3"), (0.25, "0.25"), (1e300, "1e+300"), (7, "7")],
)
def test_values_are_formatted_as_short_as_possible(value, text):
    assert format_text("a", {"k": value}) == f"a:k={text}"
