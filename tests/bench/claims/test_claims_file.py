"""Reading claims: what is accepted, and what an error says."""

from pathlib import Path

import pytest

from bench.claims.claims_file import read_claims
from bench.experiments.experiment import ExperimentError

CLAIM = """
[AB-1]
source = "Fig. 1"
quote = "it tracks"
short = "it tracks"
says = "The target is tracked."
paper = "1 of 1"
sequences = "ball"
{sides}
measure = "kept"
test = "{test}"
falsified = "It is lost."
reason = "The figure shows the end."
{further}
"""


def write_claim(folder: Path, sides: str, test: str, further: str = "") -> Path:
    """Write a claims file with one claim."""
    path = folder / "claims.toml"
    path.write_text(CLAIM.format(sides=sides, test=test, further=further), "utf-8")
    return path


def test_names_may_be_one_text_or_a_list(tmp_path: Path) -> None:
    path = write_claim(
        tmp_path, 'better = "A"\nworse = ["B", "C"]', "order", "margin = 0.02\nscenes = 12"
    )
    claim = read_claims("any", path)["AB-1"]
    assert claim.trackers == ("A", "B", "C")
    assert claim.sequences == ("ball",)
    assert claim.n_scenes == 12


@pytest.mark.parametrize(
    ("test", "scenes"), [("share", 24), ("order", 32), ("no-worse", 36), ("number", 24)]
)
def test_scenes_follow_from_the_kind_of_test(tmp_path: Path, test: str, scenes: int) -> None:
    sides = 'of = "A"' if test in ("share", "number") else 'better = "A"\nworse = "B"'
    claim = read_claims("any", write_claim(tmp_path, sides, test, "margin = 0.02"))["AB-1"]
    assert claim.n_scenes == scenes


@pytest.mark.parametrize(
    ("sides", "test", "further", "message"),
    [
        ('better = "A"', "order", "margin = 0.02", "`better` and `worse` together"),
        ('better = "A"\nworse = "B"', "order", "", "needs a `margin`"),
        ('better = "A"\nworse = "B"', "share", "", "takes `of`"),
        ('of = "A"', "share", "colour = 3", "colour: Extra inputs"),
        ('of = "A"', "sharing", "", "test: Input should be"),
        ('of = "A"', "share", "margin = -1", "margin: Input should be greater than 0"),
    ],
)
def test_error_names_file_claim_and_field(
    tmp_path: Path, sides: str, test: str, further: str, message: str
) -> None:
    path = write_claim(tmp_path, sides, test, further)
    with pytest.raises(ExperimentError) as caught:
        read_claims("any", path)
    assert str(path) in str(caught.value)
    assert "claim AB-1" in str(caught.value)
    assert message in str(caught.value)
