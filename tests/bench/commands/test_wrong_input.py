"""Wrong usage and input of every command: exit status 2 and a message, without a traceback."""

import shlex

import pytest

from tests.bench.commands.conftest import TINY, unwrapped
from tests.bench.conftest import messages
from trackmark.bench.commands._terminal import COMMAND, _in_columns

SMALL = "--sequences data/Small"
SCENES = f"{TINY},{TINY}:scene=1"
STRESS = f"stress static --runs 20 --jobs 1 --sequences {TINY} --difficulty noise"
STATIC = f"run --trackers static {SMALL}"
SUPERVISED = f"compare static camshift --sequences {SCENES} --protocol supervised --metrics vot"
COMPARE = f"compare static --results-of MINE=theirs --sequences {SCENES}"
ANNOTATE = "annotate data/Small/img"
BOXES = "--box 0:1,2,3,4 --box 1:1,2,3,4"

# A line is a command and a part of its message.
MESSAGES = f"""
run --trackers statik {SMALL} | Did you mean 'static'?
run --trackers static:preset=x {SMALL} | preset of static 'x'
run --trackers camshift:bins=3 {SMALL} | 'hue_bins'
run --trackers camshift:hue_bins=0 {SMALL} | hue_bins=0
run --trackers camshift:hue_bins=many {SMALL} | hue_bins=many
run --trackers static --sequences samples/fce | 'samples/face'
run --trackers static --sequences samples/*,nothing/* | 'nothing/*' matches no sequence
run --trackers , {SMALL} | no tracker or no sequence
run --trackers static --sequences , | no tracker or no sequence
{STATIC} data/Small/img | data/Small/img is not an experiment.
run --trackers static --sequences data data/Small knob.py | quotes, so that the shell
run demo demo | Give one experiment
run --trackers static --sequences plain/target:sped=3 | 'speed'
run --trackers static --sequences nowhere | nowhere
{STATIC} --frame-limit 0 | a value above 0
{STATIC} --backend dusk | Did you mean 'dask'
{STATIC} --address tcp://nowhere:1 | --address is only valid with
{STATIC} --repetitions 0 | x>=1
{STATIC} --quiet --verbose | exclude each other
rum --trackers static {SMALL} | unknown command 'rum'. Did you mean 'run'?
{STATIC} --memory-limit much | 'much' is not a valid size
{STATIC} --memory-limit 4,5GB | '4,5GB' is not a valid size
{STATIC} --protocol supervise | Did you mean 'supervised'?
{STATIC} --protocol tre:starts=none | parameter starts=none
{STATIC} --protocol sre --timing | timing runs are one-pass
{STATIC} --results-root file/results | --results-root
run nonsense | unknown experiment 'nonsense'
run missing.toml | missing.toml
run sweep.toml | sequences expands to 1000000000 combinations
run many.toml | an experiment has at most 1000000
run --trackers static,knob.py:Knob {SMALL} --repetitions 1000000000000 | 1000000000001 runs are
run lists.toml | nested too deeply
run tables.toml | nested too deeply
run nul-tracker.toml | a\\u0000.py: this tracker file does not exist
run nul-sequence.toml | a path cannot contain a NUL character
describe nonsense | nonsense
describe camshit | Did you mean the tracker 'camshift'?
describe kcf:preset=as-written | Did you mean the tracker 'opencv-kcf'?
describe '' | empty
describe data/Small/img --attributes | there is no ground truth
report nowhere | nowhere
report data --metrics '' | name at least one
report data --metrics otbb | Did you mean 'otb'?
report | Give RESULTS
report --results-of A=theirs | Give RESULTS
report --sequences data/Small | Give RESULTS
report data --json --format csv | exclude each other
report data --format pdf | --output
report data --json --frames | --output
report data --no-pictures --frames | --output
results list nowhere | nowhere
compare static camshift | Give either --sequences or --results
compare --sequences {SCENES} | at least two trackers
compare static --results nowhere | at least two trackers
compare static static --sequences {SCENES} | twice
compare --results nowhere | contains no results
compare --results nowhere --margin nan | not a finite number
{COMPARE} --metric nonsense | native has no score
{COMPARE} --metrics otb --metric centre_error | otb has no score 'centre_error'
{COMPARE} --metrics vot --metric failures | --margin
{COMPARE} --results-of MINE=theirs | the name MINE is given twice
{SUPERVISED} --metric eao | eao is a score of all sequences together
{SUPERVISED} --metric eao | Choose one of accuracy, failures, robustness
{STRESS}=0..9,noise | a name is given twice
{STRESS} --difficulty '' | the list is empty
{STRESS} --difficulty nois | Did you mean 'noise'
{STRESS} --sequences nowhere | nowhere
{STRESS} --difficulty occlusion | is too long
{STRESS}=0..900 | Expected: a number from 0 to 255
{STRESS} --runs 3 | 20
reproduce multi-part | Did you mean 'multipart'?
reproduce | Give one PAPER (moreno2005,
reproduce multipart --all-papers | Give one PAPER
reproduce --all-papers --page page.md | --page requires one PAPER
reproduce multipart --quick --all | either --quick or --all
{ANNOTATE} --box 0:1,2,3 | FRAME:X,Y,WIDTH,HEIGHT
{ANNOTATE} --box x | FRAME:X,Y,WIDTH,HEIGHT
{ANNOTATE} --box 0:1,2,3,4 | two frames or more
{ANNOTATE} {BOXES} --output a.jpg | .csv
{ANNOTATE} --box 0:1,2,3,4 --box 9:1,2,3,4 | frame 9
{ANNOTATE} --box 0:1,2,3,0 --box 1:1,2,3,4 | frame 0
{ANNOTATE} --box 0:50,2,3,4 --box 1:1,2,3,4 | frame 0: [50.0, 2.0, 3.0, 4.0] lies out
{ANNOTATE} --box 0:1,2,3,4 --box 4:1,-4,3,4 | outside the image (50x40)
{ANNOTATE} --box 0:1,2,1e300,4 --box 4:1,4,3,4 | frame 0
{ANNOTATE} {BOXES} --absent x | FIRST-LAST
{ANNOTATE} | no key frames are given. Mark the target in two frames or more. Use --draw
run --trackers static | for example: trackmark run --trackers camshift,static
show data/Small | Use --output FILE
show data/Small --output a.gif | neither .png nor .mp4
show data/Small --output a.png --first-frame 9 | not among 0 to 4
show data/Small --output a.png --trajectory revised | requires --results
show data/Small --live static --first-frame 1 | exclude each other
check nowhere | baseline not found
baseline a/b --trackers static {SMALL} | 'a/b' is not a valid name of a baseline
baseline own --trackers static {SMALL} --detectable-drop nan | nan is not a finite number
{STATIC} --memory-limit 511.9MB | is 511,900,000, below the minimum of 512,000,000 (512 MB)
{STATIC} --name '' | '' is not a valid name of a results folder
{STATIC} --name ' ' | ' ' is not a valid name of a results folder
{STATIC} --frame-limit nan | a value above 0
compare static camshift {SMALL} --name '' | '' is not a valid name of a results folder
{STRESS} --name a/b | 'a/b' is not a valid name of a results folder
results import A=theirs {SMALL} --name ../x | '../x' is not a valid name of a results folder
""".strip().splitlines()

TOML = 'version = 1\ntrackers = ["{}"]\nsequences = ["{}"]\n'
FILES = {
    "file": "",
    "lists.toml": "trackers = " + "[" * 5000,
    "tables.toml": "trackers = " + "{a=" * 5000,
    "many.toml": TOML.format("knob.py:Knob", "data/Small") + "repetitions = 1000000000000",
    "nul-tracker.toml": TOML.format("a\\u0000.py", "data/Small"),
    "nul-sequence.toml": TOML.format("static", "data/\\u0000"),
    "sweep.toml": 'version = 1\ntrackers = ["static"]\nsequences = [{ name = "plain/target", '
    + ", ".join(f"{key} = {list(range(1000))}" for key in ("scene", "noise", "blur"))
    + " }]\n",
}


def message_of(done):
    """Return the message of a refused command, which is one line, also after a usage text."""
    lines = messages(done)
    usage = [line for line in lines if line.startswith(("Usage:", "Try ")) or not line]
    (message,) = [line for line in lines if line not in usage]
    assert message.startswith("Error: " if usage else "trackmark: ")
    assert done.stdout == ""
    return message


@pytest.mark.parametrize("command", sorted({line.split()[0] for line in MESSAGES}))
def test_wrong_input_is_one_message_and_exit_status_2(trackmark, workspace, command):
    for name, text in FILES.items():
        (workspace / name).write_text(text)
    (workspace / "theirs").mkdir()
    (workspace / "theirs" / "Small.txt").write_text("5,6,10,12\n" * 5)
    for line in MESSAGES:
        arguments, _, words = line.rpartition(" | ")
        if arguments.split()[0] == command:
            message = message_of(trackmark(*shlex.split(arguments), status=2))
            assert words in message, line
            assert "Did you mean" not in message or message.count(",") < 20, line
    assert not (workspace / "results").exists()


LONG = "x" * 5000
LOOPS = ("loop", "loop.toml", "loop.py", "loop.png", "loop.csv", "loop.html")

# With a name of 5000 characters, and with a loop of symbolic links, in place of NAME.
NAMES = f"""
run NAME.toml
run --trackers static --sequences NAME
run --trackers NAME.py {SMALL}
{STATIC} --results-root NAME
describe NAME
describe NAME/tracker.py
show data/Small --output NAME.png
show data/Small --results NAME --output shown.png
{ANNOTATE} --box 0:1,1,9,9 --box 4:1,1,9,9 --output NAME.csv
report NAME
compare --results NAME
results list NAME
baseline NAME.toml --trackers static {SMALL}
check NAME.toml
""".strip().splitlines()
LONG_NAMES = f"""
run NAME
run --trackers NAME {SMALL}
run --trackers static --sequences NAME/*
{STATIC} --name NAME
show NAME --output shown.png
reproduce NAME
results check NAME
""".strip().splitlines()


@pytest.mark.parametrize("name", [LONG, "loop"], ids=["long", "loop"])
def test_name_that_cannot_be_a_file_is_one_short_message(trackmark, one_line, workspace, name):
    for file in LOOPS:
        (workspace / file).symlink_to(file)
    for line in [*NAMES, *(LONG_NAMES if name == LONG else ())]:
        message = one_line(trackmark(*shlex.split(line.replace("NAME", name)), status=2))
        assert message.startswith("trackmark: "), line
        assert len(message) < 1000, line
        assert "loop" in message or name == LONG, line
    for command, option in (("describe", "--truth"), ("annotate", "--key-frames")):
        message = trackmark(command, "data", option, LONG, status=2).stderr
        assert "does not exist" in message
        assert max(map(len, message.splitlines())) < 1000


def test_argument_that_is_not_utf8_is_one_message(trackmark, one_line, workspace):
    (workspace / "knob.py").rename(workspace / "\udcff.py")
    for options in (("static", "--name", "\udcff"), ("\udcff.py",)):
        message = one_line(
            trackmark("run", "--sequences", "data/Small", "--trackers", *options, status=2)
        )
        assert "\\udcff" in message
        assert "UTF-8" in message
    assert not (workspace / "results").exists()


def test_oserror_without_a_file_name_is_one_message(trackmark, one_line, monkeypatch):
    def fail(*_):
        raise OSError(24, "Too many open files")

    monkeypatch.setattr("trackmark.bench.store.database.experiment_folders", fail)
    line = one_line(trackmark("results", "list", "results", status=2))
    assert line == "trackmark: Too many open files."


def test_removed_working_directory_is_one_line(trackmark, tmp_path, monkeypatch):
    (tmp_path / "removed").mkdir()
    monkeypatch.chdir(tmp_path / "removed")
    (tmp_path / "removed").rmdir()
    printed = trackmark("run", "--trackers", "static", "--sequences", "samples/face", status=2)
    assert "trackmark: the working directory was removed. Change to an" in unwrapped(printed.stderr)


@pytest.mark.parametrize("damage", ["truth", "image"])
def test_unusable_trackers_and_sequences_are_named_together(
    trackmark, otb, workspace, monkeypatch, damage
):
    monkeypatch.chdir(workspace)
    for name in ("cup", "dog"):
        folder = otb(workspace / "data" / name, 3)
    if damage == "truth":  # seen while sequences are selected
        (folder / "groundtruth_rect.txt").unlink()
    else:  # seen when the sequence is opened
        for image in (folder / "img").iterdir():
            image.write_bytes(b"no image")
    trackers = "static,opencv-vit,camshift,no-tracker.py"
    options = "--results-root", "none", "--name", "two words"
    error = trackmark("run", "--trackers", trackers, "--sequences", "data", *options, status=2)
    for part in (
        "2 of 4 trackers cannot be used.",
        "opencv-vit: the parameter net is missing.",
        "no-tracker.py: ",
        "data/dog",
        "\n  trackmark run --trackers static,camshift --sequences 'data,!dog' --results-root none "
        "--name 'two words'\n",
    ):
        assert part in error.stderr
    assert not (workspace / "none").exists()


@pytest.mark.parametrize(
    ("typed", "remaining"),
    [
        ("compare static no-tracker.py --sequences=A,B", "compare static --sequences=A"),
        (
            "run --sequences A,B --trackers static,no-tracker.py",
            "run --sequences A --trackers static",
        ),
        ("run --trackers no-tracker.py --sequences A,B", None),
        ("compare static --against no-tracker.py --sequences A", None),
        ("run experiment.toml", None),  # the tracker is not among the arguments
    ],
)
def test_command_without_unusable_input_is_printed(
    trackmark, otb, workspace, monkeypatch, typed, remaining
):
    monkeypatch.chdir(workspace)
    for name in ("A", "B"):
        otb(workspace / name, 3)
    (workspace / "B/groundtruth_rect.txt").write_text("no box")
    experiment = 'version = 1\ntrackers = ["static", "no-tracker.py"]\nsequences = ["A"]\n'
    (workspace / "experiment.toml").write_text(experiment)
    error = trackmark(*typed.split(), status=2).stderr
    assert "no-tracker.py: this tracker file does not exist" in error
    assert error.count("\n  trackmark ") == (remaining is not None)
    if remaining:
        assert f"\nTo go on without the above:\n  trackmark {remaining}\n" in error


def test_command_is_neither_wrapped_nor_shortened(monkeypatch):
    command = f"{COMMAND}run --trackers static {'x ' * 600}end"
    assert _in_columns(f"A problem.\n{command}") == f"A problem.\n{command}"
