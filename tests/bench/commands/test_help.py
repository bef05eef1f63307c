"""`trackmark` itself, `list`, `describe`, `doctor`: what they say, and what they don't wait for."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from trackmark import bench, trackers
from trackmark.bench.commands import describe

SCRIPT = Path(sys.executable).parent / "trackmark"
COMMANDS = sorted(file.stem for file in (Path(bench.__file__).parent / "commands").glob("[!_]*.py"))


def test_help_lists_every_command(trackmark):
    said = trackmark("--help").stdout
    for name in COMMANDS:
        assert f"\n  {name} " in said


@pytest.mark.parametrize(
    ("arguments", "heavy"),
    [
        (["--help"], {"numpy", "cv2", "numba", "pandas", "pyarrow", "matplotlib"}),
        (["list"], {"numba", "pandas", "pyarrow", "matplotlib", "av", "scipy"}),
        (["describe", "multipart/1"], {"numba", "pandas", "pyarrow", "matplotlib", "av"}),
    ],
)
def test_what_a_command_does_not_need_is_not_imported_and_no_rendered_sequence_opened(
    arguments, heavy
):
    code = (
        "import sys\nfrom trackmark.bench import cli\n"
        f"try: cli.main({arguments!r})\n"
        "except SystemExit as ended: assert not ended.code\n"
        f"print(sorted({heavy!r} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(trackmark, command):
    usage, blank, *_ = trackmark(command, "--help").stdout.splitlines()
    assert usage.startswith(f"Usage: trackmark {command}")
    assert blank == ""


def test_list_names_everything(trackmark):
    said = trackmark("list").stdout
    for name in ("static", "camshift", "opencv-kcf", "samples/bow-tie", "plain/target", "demo"):
        assert f"  {name} " in said
    found = json.loads(trackmark("list", "trackers", "--json").stdout)
    assert list(found) == ["trackers"]
    assert "static" in found["trackers"]


def test_describe_a_tracker_gives_paper_presets_and_parameters(trackmark):
    said = trackmark("describe", "camshift").stdout
    for word in ("Bradski", "as-written", "recommended", "window=fixed", "hue_bins=32", "[pixels]"):
        assert word in said
    about = json.loads(trackmark("describe", "camshift", "--json").stdout)
    assert {parameter["name"] for parameter in about["parameters"]} >= {"window", "hue_bins"}


def test_describe_calls_a_tracker_as_run_does(trackmark, here):
    assert trackmark("describe", "knob.py").stdout.startswith("knob.py:Knob\n")
    assert trackmark("describe", "knob.py:as=mine").stdout.startswith("mine\n")


def test_describe_a_sequence_gives_size_and_truth(trackmark):
    said = trackmark("describe", "samples/face").stdout
    assert re.search(r"^fps +29\.97$", said, re.M)  # 30000 / 1001
    assert "176x144" in said
    assert "120 of 120 frames" in said
    rendered = trackmark("describe", "multipart/1").stdout
    assert "640x480" in rendered
    variant = trackmark("describe", "multipart/1:scene=1").stdout
    assert variant.splitlines()[0].endswith("multipart/1:scene=1")
    assert rendered.partition("fingerprint")[2] != variant.partition("fingerprint")[2]


def test_describe_tells_what_a_path_is_taken_for_its_licence_and_whom_to_cite(trackmark):
    about = json.loads(trackmark("describe", "data/Small", "--json").stdout)
    assert about["taken for"].endswith("(OTB)")
    assert "Wu, Lim, Yang" in about["cite"]
    assert about["licence"] == "not stated with the data"


def test_presets_are_described_and_asked_for_by_their_names(trackmark):
    assert "\n  otb " in trackmark("list", "metrics").stdout
    said = trackmark("describe", "vot").stdout
    assert said.startswith("vot-supervised\n\nAccuracy, robustness")
    assert "vot-toolkit 0.7.1" in said
    about = json.loads(trackmark("describe", "otb", "--json").stdout)
    assert about["columns"]["success_auc"]["perfect"] == 20 / 21
    asked = ("run", "--trackers", "static", "--sequences", "data/Small")
    assert "metrics preset otb." in trackmark(*asked, "--metrics", "otb").stdout
    assert "metrics preset lasot." in trackmark("report", "results", "--metrics", "lasot").stdout
    refused = trackmark("report", "results", "--metrics", "otbb", status=2).stderr
    assert "Did you mean 'otb'?" in refused


def test_describe_takes_a_file_as_run_does(trackmark):
    (said,) = {
        trackmark("describe", text).stdout for text in ("knob.py", "knob.py:Knob", "knob.py:knob=3")
    }
    assert said.startswith("knob.py:Knob\n\nDraws.\n")
    assert "  knob=1  knob [frames]" in said


@pytest.mark.parametrize(
    ("name", "meant"), [("camshit", "camshift"), ("kcf:preset=as-written", "opencv-kcf")]
)
def test_describe_suggests_trackers_too(trackmark, one_line, name, meant):
    said = one_line(trackmark("describe", name, status=2))
    assert said.startswith(f"trackmark: unknown sequence {name!r}.")
    assert said.endswith(f"Did you mean the tracker {meant!r}?")


def test_doctor_is_content_and_says_what_is_installed(trackmark):
    about = json.loads(trackmark("doctor", "--json").stdout)
    assert about["problems"] == []
    assert about["trackers"]["static"] == "ready"
    names = {"opencv-python-headless", "opencv-contrib-python-headless"}
    assert names & about["versions"].keys()


def test_a_reader_that_goes_away_is_no_error():
    done = subprocess.run(
        f"{SCRIPT} list | head -1", shell=True, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""


@pytest.mark.slow
def test_the_demo_runs_and_draws_its_pictures(typed, here):
    import cv2

    said = typed("demo", "--output", "out").stdout
    for tracker in ("static", "camshift", "camshift:window=adaptive", "opencv-mil"):
        assert f"{tracker} " in said
    assert "18 of 18 runs" in said
    folder = here / "out" / "demo"
    assert f"Open {Path('out', 'demo', 'report.html')}" in said
    assert "camshift:window=adaptive" in (folder / "report.html").read_text()
    drawn = [cv2.imread(str(path)) for path in folder.glob("*.png")]
    assert len(drawn) in (11, 12)  # speed is drawn where load disturbed no timing run
    assert all(picture is not None for picture in drawn)
    assert (folder / "times.csv").is_file()


def test_further_names_of_presets_are_listed_and_known(trackmark):
    assert "Also called vot" in " ".join(trackmark("list", "metrics").stdout.split())
    said = trackmark("report", "results", "--metrics", "nonesuch", status=2).stderr
    assert " vot, " in said


def test_formats_of_recorded_data_are_listed(trackmark):
    said = json.loads(trackmark("list", "formats", "--json").stdout)["formats"]
    assert "(GOT-10k)" in said["got10k"]
    assert "(OTB)" in said["otb"]


@pytest.mark.parametrize("arguments", [("describe", ""), ("report", "results", "--metrics", "")])
def test_an_empty_name_is_refused(trackmark, arguments):
    said = trackmark(*arguments, status=2).stderr
    assert "empty" in said or "one preset at least" in said


def test_a_tracker_that_cannot_be_used_here_is_described_and_says_what_to_install(monkeypatch):
    def lacking(name):
        raise trackers.TrackerError(f"tracker {name!r} can't be used here: install a library.")

    monkeypatch.setattr(trackers, "describe", lacking)
    said = CliRunner().invoke(describe.command, ["opencv-kcf"])
    assert said.exit_code == 0
    assert "kernelised correlation filters" in said.output
    assert "install a library" in said.output
    assert CliRunner().invoke(describe.command, ["nobody"]).exit_code != 0


@pytest.mark.parametrize("name", [name for name in trackers.names() if ":" not in name])
def test_what_is_read_of_a_trackers_file_is_what_it_says_of_itself(name):
    try:
        said = trackers.describe(name)["summary"]
    except trackers.TrackerError as error:
        said = describe._unusable(name, error)["summary"]
        assert said.startswith("OpenCV's ")
    assert describe._unusable(name, ValueError())["summary"] == said
