"""`trackmark --help`, `list`, `describe`, `doctor`, `demo`: their texts, and what they import."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.bench.commands.conftest import TINY, unwrapped
from tests.bench.pages.reading import size_without_frames
from trackmark import bench, trackers
from trackmark.bench.commands import describe
from trackmark.bench.commands.results import command as results_command

COMMANDS = sorted(file.stem for file in (Path(bench.__file__).parent / "commands").glob("[!_]*.py"))


def test_every_command_is_listed_and_has_complete_help(trackmark):
    overview = trackmark("--help").stdout
    results = [f"results {name}" for name in sorted(results_command.commands)]
    for command in [*COMMANDS, *results]:
        text = trackmark(*command.split(), "--help").stdout
        usage, blank, summary, *lines = text.splitlines()
        assert usage.startswith(f"Usage: trackmark {command}")
        assert blank == ""
        assert len(summary.strip()) <= 70
        if command != "results":
            assert f"  For example:\n    trackmark {command}" in text
            assert "  Exit codes: 0 " in text
            assert "Options:" not in lines
        if command in COMMANDS:
            assert f"{command} {summary.strip()}" in unwrapped(overview)


HEAVY = {"numba", "pandas", "matplotlib", "av", "scipy"}
IMPORTS = [  # each command runs in the process of those before it
    (["--help"], {*HEAVY, "numpy", "cv2"}),
    (["compare", "--help"], {*HEAVY, "cv2"}),
    (["list"], HEAVY),
    (["describe", "multipart/1"], HEAVY - {"scipy"}),
]


def test_command_imports_only_what_it_needs():
    code = (
        "import sys\nfrom trackmark.bench import cli\n"
        f"for arguments, heavy in {IMPORTS!r}:\n"
        "    try: cli.main(arguments)\n"
        "    except SystemExit as ended: assert not ended.code\n"
        "    assert not heavy & set(sys.modules), (arguments, heavy & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


# Parts of the output of commands.
TEXTS = {
    "list": ["static", "camshift", "opencv-kcf", "samples/bow-tie", "plain/target", "demo", "otb"],
    "list metrics": ["otb ", "Also called vot"],
    "list attributes": ["clutter "],
    "list protocols": ["supervised "],
    "list formats": ["got10k ", "(GOT-10k)", "(OTB)"],
    "describe camshift": ["Bradski", "as-written", "recommended", "window=fixed", "hue_bins=32"],
    "describe knob.py": ["knob.py:Knob Draws.", "knob=1 knob [frames]"],
    "describe knob.py:Knob": ["knob.py:Knob Draws.", "knob=1 knob [frames]"],
    "describe knob.py:as=mine": ["mine Draws."],
    "describe samples/face": ["fps 29.97", "176x144", "120 of 120 frames"],  # 30000 / 1001
    "describe plain/target": ["320x240"],
    "describe data/Small": ["(OTB)", "Wu, Lim, Yang", "licence not stated with the data"],
    "describe data/Small/img": ["truth none"],
    "describe vot": ["vot-supervised Accuracy, robustness", "vot-toolkit 0.7.1"],
    "describe clutter": ["Bhattacharyya", "0 to 1"],
    "describe supervised": ["skip_frames=5", "metrics vot-supervised"],
    "describe long-term": ["harmonic mean", "protocol long-term"],  # a preset and a protocol
    "describe data": ["(OTB)", "sequences 1", "data/Small"],
    "describe stress": ["built-in", "stress/pillar", "stress/twin"],
}


def test_lists_and_descriptions_have_their_texts(trackmark):
    for arguments, parts in TEXTS.items():
        text = " ".join(trackmark(*shlex.split(arguments)).stdout.split())
        for part in parts:
            assert part in text, arguments


def test_lists_and_descriptions_have_their_data(trackmark):
    def data(*arguments):
        return json.loads(trackmark(*arguments, "--json").stdout)

    assert list(data("list", "trackers")) == ["trackers"]
    camshift = data("describe", "camshift")
    assert {parameter["name"] for parameter in camshift["parameters"]} >= {"window", "hue_bins"}
    assert data("describe", "data/Small")["format"].endswith("(OTB)")
    assert data("describe", "otb")["metrics"]["success_auc"]["best_value"] == 20 / 21
    assert data("describe", "stress")["sequence_names"] == ["stress/pillar", "stress/twin"]
    prints = [
        re.search("fingerprint.*", trackmark("describe", f"{TINY}{scene}").stdout)[0]
        for scene in ("", ":scene=1")
    ]
    assert prints[0] != prints[1]
    measured = data("describe", "data/Small", "--attributes")["measured_attributes"]
    assert measured["motion"]["frames"] == [None, 0, 0, 0, 0]
    assert measured["motion"]["value"] == 0
    assert measured["visibility"]["value"] is None
    assert "measured_attributes" not in data("describe", "data/Small")


def test_doctor_finds_no_problem_and_lists_versions(trackmark):
    data = json.loads(trackmark("doctor", "--json").stdout)
    assert data["problems"] == []
    assert re.match(r"\d+ in /", data["caches"]["compiled kernels"])
    assert data["trackers"]["static"] == "ready"
    names = {"opencv-python-headless", "opencv-contrib-python-headless"}
    assert names & data["versions"].keys()


@pytest.mark.slow
def test_demo_runs_and_draws_its_pictures(trackmark_process, workspace):
    import cv2

    text = trackmark_process("demo", "--output", "out").stdout
    papers = ("moreno2005", "multipart", "nguyen2002", "nummiaro2003", "wang2010")
    assert all(f"\n{tracker} " in text for tracker in (*papers, "camshift", "static"))
    assert re.search(r"static +0.\d\d +\[0", text)  # enough sequences for intervals
    folder = workspace / "out" / "demo"
    assert text.splitlines()[-1].startswith(f"Report  {Path('out', 'demo', 'report.html')}")
    assert len(text.splitlines()) <= 20
    page = (folder / "report.html").read_text()
    assert "nummiaro2003/students" in page
    assert size_without_frames(page) < 240_000  # with the font
    pictures = [cv2.imread(str(path)) for path in folder.glob("*.png")]
    assert len(pictures) == 12  # four charts and a film strip per sequence
    assert all(picture is not None for picture in pictures)
    assert (folder / "sequences.csv").is_file()


def test_tracker_without_library_is_described_with_remedy(monkeypatch):
    def describe_nothing(name):
        raise trackers.TrackerError(f"tracker {name!r} cannot be used: install a library.")

    monkeypatch.setattr(trackers, "describe", describe_nothing)
    done = CliRunner().invoke(describe.command, ["opencv-kcf"])
    assert done.exit_code == 0
    assert "kernelised correlation filters" in done.output
    assert "install a library" in done.output
    assert CliRunner().invoke(describe.command, ["no-tracker"]).exit_code != 0
