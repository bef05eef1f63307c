"""`trackmark annotate`: a truth that runs, and what is wrong with what was marked."""

import statistics

import pytest

import bench

BOTH = ("--box", "0:4,5,10,12", "--box", "4:8,5,10,12")


def test_annotate_writes_a_truth_that_runs(trackmark, here):
    source = here / "data" / "Small" / "img"
    said = trackmark("annotate", source, *BOTH, "--output", "truth.csv").stdout
    assert "truth.csv" in said
    assert "interpolated" in (here / "truth.csv").read_text()
    trackmark("run", "--trackers", "static", "--sequences", source, "--truth", "truth.csv")
    scores = bench.load_results(here / "results").iloc[0]
    assert scores["centre_error"] == pytest.approx(statistics.mean([1, 2, 3, 4]))
    assert (here / "truth-check.png").is_file()


def test_annotating_again_reaches_beyond_the_last_row_of_the_old_truth(trackmark, one_line, here):
    source = here / "data" / "Small" / "img"
    trackmark("annotate", source, "--box", "0:4,5,10,12", "--box", "2:8,5,10,12")
    assert len((source / "truth.csv").read_text().splitlines()) > 3
    again = ("annotate", source, *BOTH)
    assert "--force" in one_line(trackmark(*again, status=2))
    trackmark(*again, "--force", "--absent", "2-3")
    assert "3 of 5 frames" in trackmark("describe", source).stdout
    assert (source.parent / "img-check.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--box", "0:1,2,3"), "FRAME:X,Y,WIDTH,HEIGHT"),
        (("--box", "x"), "FRAME:X,Y,WIDTH,HEIGHT"),
        (("--box", "0:1,2,3,4"), "at least two"),
        (("--box", "0:1,2,3,4", "--box", "1:1,2,3,4", "--output", "a.jpg"), ".csv"),
        (("--box", "0:1,2,3,4", "--box", "9:1,2,3,4"), "frame 9"),
        (("--box", "0:1,2,3,0", "--box", "1:1,2,3,4"), "frame 0"),
        (("--box", "0:1,2,3,4", "--box", "1:1,2,3,4", "--absent", "x"), "FIRST-LAST"),
        ((), "key frames"),
    ],
)
def test_annotate_names_what_is_wrong(trackmark, here, arguments, words):
    said = trackmark("annotate", here / "data" / "Small" / "img", *arguments, status=2).stderr
    assert words in said
    assert not (here / "data" / "Small" / "img" / "truth.csv").exists()
