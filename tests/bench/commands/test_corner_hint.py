"""Hint on boxes that look like corners, in every output with scores."""

import pytest

import trackmark as tm

HINT = "corners.py:Corners: the boxes look like [x1, y1, x2, y2]."
CORNERS = """
class Corners:
    def init(self, image, box):
        self.box = box

    def update(self, image):
        x, y, width, height = self.box
        return x, y, x + width, y + height
"""
RUN = ("--trackers", "corners.py,static", "--sequences", "data/Small")


@pytest.fixture
def corners(workspace):
    (workspace / "corners.py").write_text(CORNERS)
    return workspace


STORED = [
    ("run", *RUN, "--name", "mine"),
    ("run", *RUN, "--name", "mine", "--json"),
    ("report", "results/mine", "--metrics", "otb"),
    ("report", "results/mine", "--format", "csv"),
    ("compare", "--results", "results/mine"),
]
OTHER = [
    ("run", *RUN, "--name", "mine", "--protocol", "supervised"),
    ("baseline", "mine", *RUN),
    ("check", "mine"),
    ("stress", "corners.py", "--difficulty", "noise", "--runs", "20"),
]


@pytest.mark.parametrize("commands", [STORED, pytest.param(OTHER, marks=pytest.mark.slow)])
def test_commands_with_scores_print_the_corner_hint(trackmark, corners, commands):
    for command in commands:
        done = trackmark(*command)
        assert done.stderr.count(HINT) == 1, (command, done.stderr)


@pytest.mark.slow
def test_page_of_results_has_the_corner_hint(trackmark, corners):
    trackmark("run", *RUN, "--name", "mine")
    trackmark("report", "results/mine", "--output", "out")
    assert HINT in (corners / "out" / "report.html").read_text("utf-8")


def test_printed_results_have_the_corner_hint(corners, monkeypatch):
    monkeypatch.chdir(corners)
    results = tm.evaluate(["corners.py", "static"], "data/Small")
    for text in (str(results), str(tm.compare(results)), results._repr_html_()):
        assert HINT in " ".join(text.split())
    assert HINT not in str(tm.evaluate("static", "data/Small"))


@pytest.mark.parametrize(
    ("box", "is_warned"), [((5, 6, 15, 18), True), ((5, 6, 15, 17.5), True), ((5, 6, 9, 12), False)]
)
def test_constant_boxes_give_the_hint_if_they_are_corners(corners, monkeypatch, box, is_warned):
    monkeypatch.chdir(corners)
    constant = type("Constant", (), {"init": lambda *_: None, "update": lambda *_: box})
    printed = " ".join(str(tm.evaluate(constant, "data/Small")).split())
    assert ("Constant: the boxes look like [x1, y1, x2, y2]." in printed) == is_warned
