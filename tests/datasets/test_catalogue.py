"""Names of sequences, and where each comes from."""

import subprocess
import sys

import pytest

from trackmark import datasets
from trackmark.datasets import SequenceError


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_names_are_sorted_and_each_stands_once():
    names = datasets.names()
    assert names == sorted(set(names))
    assert {"samples/bow-tie", "samples/face"} <= set(names)


def test_a_sequence_is_named_as_it_was_asked_for():
    assert datasets.load("samples/face").name == "samples/face"


def test_importing_is_cheap():
    heavy = "{'cv2', 'av', 'numba', 'pandas', 'matplotlib', 'simplejpeg'}"
    code = "import sys; from trackmark import datasets; "
    code += f"sys.exit(str({heavy} & set(sys.modules) or ''))"
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert answer.stderr.strip() == ""


class TestPaths:
    def test_a_built_in_name_wins_over_a_path_of_the_same_text(self, here, write_images):
        write_images(here / "samples" / "face", ["1.png"])
        assert len(datasets.load("samples/face")) == 120

    @pytest.mark.parametrize("prefix", ["./", "../x/", "{here}/"])
    def test_unless_it_is_written_as_a_path(self, here, write_images, prefix):
        (here / "x").mkdir()
        write_images(here / "samples" / "face", ["1.png"])
        text = prefix.replace("../x/", "x/../").format(here=here) + "samples/face"
        assert len(datasets.load(text)) == 1

    def test_a_path_object_is_a_path(self, here, write_images):
        write_images(here / "samples" / "face", ["1.png"])
        assert len(datasets.load((here / "samples" / "face").relative_to(here))) == 1

    def test_a_folder_may_be_called_as_a_suite(self, here, write_images):
        write_images(here / "samples" / "mine", ["1.png"])
        assert datasets.load("samples/mine").name == "mine"

    def test_a_path_may_hold_colons(self, here, write_images):
        write_images(here / "take:2=b", ["1.png"])
        assert datasets.load("take:2=b").name == "take:2=b"

    @pytest.mark.parametrize("text", [".", "../walk", "./", "../walk/"])
    def test_the_name_is_the_folders_own(self, here, write_images, monkeypatch, text):
        write_images(here / "walk", ["1.png"])
        monkeypatch.chdir(here / "walk")
        assert datasets.load(text).name == "walk"

    def test_the_home_folder_is_known(self, here, write_images, monkeypatch):
        monkeypatch.setenv("HOME", str(here))
        write_images(here / "walk", ["1.png"])
        assert datasets.load("~/walk").name == "walk"

    def test_what_several_readers_know_goes_to_the_one_that_knows_more(self, here, write_otb):
        folder = write_otb(here / "Dog", "1,1,5,5\n" * 3)
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
    def test_an_unknown_name_tells_the_closest_and_where_it_was_looked_for(
        self, here, write_images, text, closest
    ):
        write_images(here / "recorded" / "walk", ["1.png"])
        with pytest.raises(SequenceError) as caught:
            datasets.load(text)
        message = str(caught.value)
        assert f"unknown sequence '{text}'. Did you mean '{closest}'?" in message
        assert str(here / text) in message
        assert "\n" not in message

    def test_without_anything_close_nothing_is_suggested(self, here):
        with pytest.raises(SequenceError, match=r"unknown sequence 'qqqqqq'\. It is no"):
            datasets.load("qqqqqq")

    def test_a_path_that_no_reader_knows_tells_what_they_expect(self, here):
        (here / "notes.txt").write_text("")
        with pytest.raises(SequenceError) as caught:
            datasets.load("notes.txt")
        for expected in ("notes.txt: ", "groundtruth_rect.txt", ".mp4", ".png", "truth.csv"):
            assert expected in str(caught.value)

    def test_an_empty_folder_is_nothing_that_a_reader_knows(self, here):
        (here / "walk").mkdir()
        with pytest.raises(
            SequenceError, match=r"walk: this is nothing .* there is nothing in it\."
        ):
            datasets.load("walk")

    def test_of_a_layout_that_is_nearly_known_what_is_there_and_what_is_missing_are_told(
        self, here
    ):
        (here / "walk" / "img").mkdir(parents=True)
        (here / "walk" / "truth.mat").write_text("")
        with pytest.raises(SequenceError, match=r"there is 'img/, truth\.mat'.*\(OTB\)") as caught:
            datasets.load("walk")
        assert "(VOT)" not in str(caught.value)

    def test_an_option_that_is_none_is_named(self):
        with pytest.raises(SequenceError, match="sequence 'samples/face:x': 'x' is not key=value"):
            datasets.load("samples/face:x")

    def test_a_truth_that_is_not_there_is_named(self, here, write_images):
        write_images(here / "walk", ["1.png"])
        with pytest.raises(SequenceError, match=r"gone\.csv: there is no such truth file"):
            datasets.load("walk", "gone.csv")

    def test_a_built_in_sequence_takes_no_other_truth(self, here):
        with pytest.raises(SequenceError, match=r"samples/face: .* has its own truth; omit t\.csv"):
            datasets.load("samples/face", "t.csv")


@pytest.mark.parametrize(
    "text",
    ["plain/target", "plain/target:scene=3:noise=4", "samples/face", "plain/target:filter.noise=4"],
)
def test_identity_is_what_an_opened_sequence_says_of_itself(text):
    sequence = datasets.load(text)
    assert datasets.identity(text) == (sequence.name, sequence.fingerprint)


def test_an_identity_of_what_cannot_be_opened_says_why():
    with pytest.raises(datasets.SequenceError, match="scene"):
        datasets.identity("plain/target:scnee=3")
    with pytest.raises(datasets.SequenceError, match="nowhere"):
        datasets.identity("nowhere/to-be-found")
