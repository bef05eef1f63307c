"""Outputs of commands that are equal, or equal to an input, are refused before any run."""

import shlex

import pytest

from tests.bench.conftest import messages
from trackmark.bench.commands._output_files import check_outputs

BASELINE = """
format = 1
repetitions = 6
detectable_drop = 0.05
[environment]
[trackers."knob.py:Knob"]
"data/Small" = { fingerprint = "00000000", overlap = [0.5], box_digests = ["00000000"] }
"""
SMALL = "--sequences data/Small"

# A line is a command and a part of its message.
MESSAGES = f"""
baseline trackers.toml --trackers trackers.toml:mine {SMALL} --force | trackers.toml is an input
baseline data/Small/a.toml --trackers static {SMALL} --force | data/Small/a.toml is an input
check own.toml --markdown out.md --junit ./out.md | --markdown and --junit name the same file
check own.toml --markdown out.md --junit link.md | --markdown and --junit name the same file
check own.toml --markdown own.toml | own.toml is an input of this command
check own.toml --junit knob.py | knob.py is an input of this command
check own.toml --junit linked.xml | linked.xml is an input of this command
check own.toml --junit data/Small/groundtruth_rect.txt | groundtruth_rect.txt is an input
reproduce multipart --page results/multipart/report.json | --page and results/multipart/report.json
annotate data/Small/img --key-frames keys.csv --output keys.csv --force | keys.csv is an input
compare static camshift {SMALL} --published comparison.csv --output . | comparison.csv is an input
""".strip().splitlines()


@pytest.mark.parametrize("line", MESSAGES)
def test_output_that_is_an_input_is_refused(trackmark, workspace, line):
    files = {
        "own.toml": BASELINE,
        "trackers.toml": '[mine]\npython = "python3"\nfile = "knob.py"\n',
        "keys.csv": "frame,x,y,width,height\n0,5,6,10,12\n4,5,6,10,12\n",
        "comparison.csv": "tracker,sequence,mean_overlap\n",
        "data/Small/a.toml": "",
    }
    for name, text in files.items():
        (workspace / name).write_text(text)
    (workspace / "linked.xml").hardlink_to(workspace / "own.toml")
    (workspace / "link.md").symlink_to("out.md")
    command, _, words = line.rpartition(" | ")
    done = trackmark(*shlex.split(command), status=2)
    assert words in messages(done)[-1]
    assert not (workspace / "results").exists()
    for name, text in files.items():
        assert (workspace / name).read_text() == text


def test_new_file_in_a_folder_and_a_device_are_allowed(tmp_path):
    check_outputs({"--markdown": tmp_path / "new.md", "--junit": None}, [tmp_path])
    null = tmp_path / "null"
    null.symlink_to("/dev/null")
    check_outputs({"--markdown": null, "--junit": null})
