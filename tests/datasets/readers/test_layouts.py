"""Layouts of data sets, written as the data sets are: names, separators and rows of real files."""

import json
import os

import cv2
import numpy as np
import pytest

from tests.datasets.readers.layouts import SIZE, write
from tests.datasets.readers.test_mutations import mutate
from trackmark import datasets
from trackmark.bench.cli import main
from trackmark.datasets import SequenceError
from trackmark.datasets.layouts import LAYOUT_VARIABLE, layouts

NAN = [np.nan] * 4
EVERY = object()  # all frames are annotated


def numbered(pattern, *numbers):
    return [pattern.format(number) for number in numbers]


# Layout: path to open, folder and names of the images, text files, boxes from 0, annotated frames.
# Rows are real, with the separators and line ends of their files, unless a comment states
# otherwise. Sequences are shortened. A comment names the repository and commit of the rows.
CASES = {
    # Not a file of the data set: the first box is that of vision4robotics/AutoTrack at e9b34ae,
    # results_OPE/UAVDT, whose rows are centred; also in the next two cases.
    "uavdt": (
        "S0101",
        ("UAV-benchmark-S/S0101", numbered("img{:06}.jpg", 1, 2)),
        {"UAV-benchmark-SOT_v1.0/anno/S0101_gt.txt": "622,348,190,191\n622,349,190,191\n"},
        [[621, 347, 190, 191], [621, 348, 190, 191]],
        EVERY,
    ),
    "visdrone": (
        "uav0000011_00000_s",
        ("sequences/uav0000011_00000_s", numbered("img{:07}.jpg", 1, 2)),
        {"annotations/uav0000011_00000_s.txt": "478,223,48,39\n0,0,0,0\n"},
        [[477, 222, 48, 39], NAN],
        EVERY,
    ),
    "uav123_10fps": (
        "bird1_2",
        ("data_seq/UAV123_10fps/bird1", numbered("{:06}.jpg", *range(1, 494))),
        {"anno/UAV123_10fps/bird1_2.txt": "102,442,70,26\n" + "NaN,NaN,NaN,NaN\n" * 234},
        [[101, 441, 70, 26]] + [NAN] * 234,
        EVERY,
    ),
    # opacity-black/RGBT_toolkit at 33da1eb, also the next case
    "gtot": (
        "BlackCar",
        ("BlackCar/v", numbered("{:05}v.png", 1, 2)),
        {"BlackCar/groundTruth_v.txt": "209 155 309 218\n203 154 298 217\n"},
        [[209, 155, 100, 63], [203, 154, 95, 63]],
        EVERY,
    ),
    "rgbt": (
        "afterrain",
        ("afterrain/visible", numbered("{:05}v.jpg", 1, 2)),
        {
            "afterrain/visible.txt": "144,53,10,80\r\n144,53,24,45\r\n",
            "afterrain/infrared.txt": "147,53,24,45\r\n147,53,24,45\r\n",
            "afterrain/init.txt": "144,53,24,45\r\n144,53,24,45\r\n",
        },
        [[144, 53, 10, 80], [144, 53, 24, 45]],
        EVERY,
    ),
    # Invented: no file was found, but several programs read these names and keys.
    "antiuav": (
        "20190925_101846_1_1",
        ("20190925_101846_1_1/visible", numbered("visibleI{:04}.jpg", 0, 1, 2)),
        {
            "20190925_101846_1_1/visible.json": json.dumps(
                {"exist": [1, 0, 1], "gt_rect": [[874, 492, 70, 38], [], []]}
            )
        },
        [[874, 492, 70, 38], NAN, NAN],
        [True, True, False],
    ),
    # Rows of HwangBo94/Anti-UAV410 at 8a8eb04, annos/test, which has rows without the flags; keys
    # and spaces of a file in IVPLaboratory/SCINet at efdfbb9, whose target is always present
    "antiuav410": (
        "02_6319_1500-2999",
        ("02_6319_1500-2999", numbered("{:06}.jpg", 1, 2, 3)),
        {
            "02_6319_1500-2999/IR_label.json": """{
  "exist": [1, 1, 0]
  ,"gt_rect": [[206, 314, 8, 8], [206, 311, 8, 9], [0, 0, 0, 0]]}
"""
        },
        [[206, 314, 8, 8], [206, 311, 8, 9], NAN],
        EVERY,
    ),
    # whluo/MILTracker_Matlab_Version at ec96056
    "mil": (
        "david",
        ("david/imgs", numbered("img{:05}.png", *range(1, 8))),
        {
            "david/david_gt.txt": "122,58,75,97\n"
            + "0,0,0,0\n" * 4
            + "87.586,40.153,75,97\n0,0,0,0\n",
            "david/david_frames.txt": "1,7\r\n",
        },
        [[122, 58, 75, 97], *[NAN] * 4, [87.586, 40.153, 75, 97], NAN],
        [frame % 5 == 0 for frame in range(7)],
    ),
    # oxuva/long-term-tracking-benchmark at fd49bed, dataset/. Here, object 1 is of another video,
    # and the task has another last frame.
    "oxuva": (
        "vid0005_obj0000",
        ("images/dev/vid0005", numbered("{:06}.jpeg", *range(65))),
        {
            "annotations/dev.csv": ""
            "vid0005,obj0000,12,knife,false,false,0,present,0.0,1.0,0.20833333,0.5933333\r\n"
            "vid0005,obj0000,12,knife,false,false,30,present,0.163,1.0,0.0,0.30833334\r\n"
            "vid0005,obj0000,12,knife,false,false,60,absent,0.0,0.0,0.0,0.0\r\n"
            "vid0005,obj0001,12,knife,false,false,0,present,0.622,0.787,0.165,0.5883333\r\n"
        },
        [
            [0, 0.20833333 * 16, 24, 0.38499997 * 16],
            *[NAN] * 29,
            [0.163 * 24, 0, 0.837 * 24, 0.30833334 * 16],
            *[NAN] * 30,
        ],
        [True, *[False] * 29, True, *[False] * 29, True],
    ),
    "oxuva_test": (
        "vid0028_obj0000",
        ("images/test/vid0028", numbered("{:06}.jpeg", *range(8))),
        {"tasks/test.csv": "vid0028,obj0000,0,4,0.662,0.902,0.33166668,1.0\r\n"},
        [[0.662 * 24, 0.33166668 * 16, 0.24 * 24, 0.66833332 * 16], *[NAN] * 4],
        [True, *[False] * 4],
    ),
    # ZhaoJ9014/Anti-UAV at eeb82f4, anti_uav_jittor/pysot_toolkit/testing_dataset: OTB100.json,
    # with a polygon of VOT2018.json and a row of absence of UAV20L.json
    "pysot": (
        "Basketball",
        ("Basketball/img", numbered("{:04}.jpg", 1, 2, 3)),
        {
            "SET.json": json.dumps(
                {
                    "Basketball": {
                        "video_dir": "Basketball",
                        "init_rect": [198, 214, 34, 81],
                        "img_names": numbered("Basketball/img/{:04}.jpg", 1, 2, 3),
                        "gt_rect": [
                            [198, 214, 34, 81],
                            [137.21, 458.36, 156.83, 460.78, 148.35, 529.41, 128.72, 526.99],
                            NAN,
                        ],
                        "attr": ["Occlusion"],
                    }
                }
            )
        },
        [[197, 213, 34, 81], [127.72, 457.36, 28.11, 71.05], NAN],
        EVERY,
    ),
    # Invented: no file was found.
    "tld": (
        "01_david",
        ("01_david", numbered("{:05}.jpg", 1, 2)),
        {"01_david/gt.txt": "165,93,216,147\nNaN,NaN,NaN,NaN\n"},
        [[164, 92, 51, 54], NAN],
        EVERY,
    ),
    # wangxiao5791509/TNL2K_evaluation_toolkit at 1a96f6e, annos.tar.gz, rows 808 and 809, where the
    # toolkit's flags of absence are 0 and 1
    "tnl2k": (
        "BF5_Blade_video_03_done",
        ("BF5_Blade_video_03_done/imgs", numbered("{:05}.png", 0, 1)),
        {
            "BF5_Blade_video_03_done/groundtruth.txt": "559,253,194,466\n0,0,0,0\n",
            "BF5_Blade_video_03_done/language.txt": "the man\n",
        },
        [[559, 253, 194, 466], NAN],
        EVERY,
    ),
    # HengLan/VastTrack at 15b3543, MatlabEvaluationToolkit/annos, rows 34 and 35
    "vasttrack": (
        "Aardwolf-2",
        ("Aardwolf/Aardwolf-2/imgs", numbered("{:05}.jpg", 1, 2)),
        {"Aardwolf/Aardwolf-2/Groundtruth.txt": "331,490,211,84\n0,0,0,0\n"},
        [[331, 490, 211, 84], NAN],
        EVERY,
    ),
    # Invented: no file was found, but the names are those of pytracking's readers.
    "webuav3m": (
        "AICV_000123",
        ("AICV_000123/img", numbered("{:06}.jpg", 1, 2)),
        {
            "AICV_000123/groundtruth_rect.txt": "636,367,57,52\n0,0,0,0\n",
            "AICV_000123/absent.txt": "0\n1\n",
            "AICV_000123/language.txt": "a car",
        },
        [[636, 367, 57, 52], NAN],
        EVERY,
    ),
}


@pytest.fixture
def create(tmp_path, write_images):
    """Write the files of a data set, and return their folder."""

    def create(name):
        _, (folder, images), texts, *_ = CASES[name]
        root = tmp_path / "SET"
        write_images(root / folder, images, SIZE)
        write(root, texts)
        return root

    return create


@pytest.mark.parametrize("name", CASES)
def test_data_set_is_read_as_published(create, name):
    sequence_name, _, _, boxes, annotated = CASES[name]
    root = create(name)
    paths = datasets.matching(str(root))
    (path,) = [path for path in paths if path.endswith(f"/{sequence_name}")]
    assert len(paths) == 1 + (name == "oxuva")
    sequence = datasets.load(path)
    assert sequence.name == sequence_name
    assert sequence.origin.format == layouts()[name].in_words
    np.testing.assert_allclose(sequence.boxes, boxes)
    expected = [True] * len(boxes) if annotated is EVERY else annotated
    assert sequence.annotated.tolist() == expected
    assert len(sequence.fingerprint) == 64
    assert sequence[-1].shape == (*SIZE[::-1], 3)


@pytest.mark.parametrize("name", CASES)
def test_damaged_file_is_read_or_refused(create, name):
    root = create(name)
    files = [root / file for file in CASES[name][2]]
    random = np.random.default_rng(sum(name.encode()))
    outcomes, messages = set(), []
    for file in files * (30 // len(files)):
        content = file.read_bytes()
        file.write_bytes(mutate(content, random))
        try:
            for path in datasets.matching(str(root)):
                datasets.load(path).check_runnable()
            outcomes.add("read")
        except SequenceError as error:
            outcomes.add("refused")
            messages.append(str(error))
        file.write_bytes(content)
    assert "refused" in outcomes
    # A target that is present in no frame is named by its sequence.
    assert all(str(root) in text or "there is no ground truth" in text for text in messages)


def test_every_layout_of_the_table_has_a_recording(create):
    from tests.datasets.readers.layouts import LAYOUTS

    assert {layout.__name__.partition("_")[0] for layout in LAYOUTS} | {*CASES} == {*layouts()}


class TestOneFile:
    def test_frame_twice_is_refused_with_its_line(self, create):
        root = create("oxuva")
        file = root / "annotations/dev.csv"
        lines = file.read_text().splitlines(keepends=True)
        file.write_text("".join([lines[0], lines[3], *lines[1:3], lines[1]]))
        with pytest.raises(SequenceError, match=r"dev\.csv: line 5: frame 30 follows frame 60"):
            datasets.load(root / "vid0005_obj0000")

    @pytest.mark.parametrize(
        ("content", "message"),
        [
            ("{", "Expecting property name"),
            ('{"exist": [1], "gt_rect": [[1, 2, 3]]}', "gt_rect of frame 0 is '.1, 2, 3.'"),
            ('{"exist": [2], "gt_rect": [[1, 2, 3, 4]]}', "exist has 1 values for 1 boxes"),
            ('{"exist": [1]}', "there is no list 'gt_rect'"),
        ],
    )
    def test_mistake_in_json_is_refused(self, create, content, message):
        root = create("antiuav410")
        (root / "02_6319_1500-2999/IR_label.json").write_text(content)
        with pytest.raises(SequenceError, match=rf"IR_label\.json: .*{message}"):
            datasets.load(root / "02_6319_1500-2999")


def test_infrared_images_are_an_option(create, write_images):
    root = create("rgbt")
    write_images(root / "afterrain/infrared", numbered("{:05}i.jpg", 1, 2), SIZE)
    sequence = datasets.load(f"{root}/afterrain:modality=infrared")
    assert sequence.name == "afterrain:modality=infrared"
    assert sequence.boxes.tolist() == [[147, 53, 24, 45]] * 2
    (root / "afterrain/infrared.txt").unlink()
    sequence = datasets.load(f"{root}/afterrain:modality=infrared")
    assert sequence.boxes.tolist() == [[144, 53, 24, 45]] * 2  # of init.txt
    assert datasets.load(root / "afterrain/infrared").name == sequence.name
    assert datasets.load(root / "afterrain").frame_name(0) == "00001v.jpg"


@pytest.mark.parametrize(("layout", "video"), [("tld", "david.mpg"), ("antiuav", "visible.mp4")])
def test_video_replaces_the_images(create, write_video, layout, video):
    root = create(layout)
    folder = root / CASES[layout][0]
    n = 0
    for image in [*folder.rglob("*.jpg")]:
        image.unlink()
        n += 1
    if (folder / "visible").is_dir():
        (folder / "visible").rmdir()
    write_video(
        folder / video, "mpeg2video" if video.endswith("mpg") else "libx264", n=n, b_frames=0
    )
    sequence = datasets.load(folder)
    assert (sequence.name, len(sequence)) == (folder.name, n)
    assert sequence.fps == (None if layout == "tld" else 25)  # MPEG-2 streams state no rate here
    np.testing.assert_allclose(sequence.boxes, CASES[layout][3])
    assert sequence[n - 1].ndim == 3


def test_masks_of_some_images_annotate_these_frames(tmp_path, write_images):
    write_images(tmp_path / "JPEGImages/w", numbered("{:05}.jpg", 0, 5, 10, 15), SIZE)
    (tmp_path / "Annotations/w").mkdir(parents=True)
    for number, value in ((0, 1), (10, 2)):
        mask = np.zeros(SIZE[::-1], np.uint8)
        mask[4:9, 3:8] = value
        cv2.imwrite(str(tmp_path / f"Annotations/w/{number:05}.png"), mask)
    paths = datasets.matching(str(tmp_path))
    first, second = map(datasets.load, paths)
    assert (first.name, second.name) == ("w", "w:object=2")
    assert first.annotated.tolist() == second.annotated.tolist() == [True, False, True, False]
    assert first.present.tolist() == [True, False, False, False]
    assert second.present.tolist() == [False, False, True, False]
    assert second.mask(2).sum() == 25
    assert second.mask(1) is None
    assert datasets.matching(str(tmp_path / "JPEGImages")) == [
        f"{tmp_path}/JPEGImages/w:object={number}" for number in (1, 2)
    ]


class TestLayoutOfTheUser:
    """Layouts in a file of the user: any folder of images and any text file of rows."""

    MINE = """
        [mine]
        images = "frames/NAME"
        image_names = "cam_#"
        truth = "boxes/NAME.txt"
        columns = "frame x1 y1 x2 y2 x3 y3 x4 y4 occluded"
        frames = "sparse"
        """

    @pytest.fixture
    def recording(self, tmp_path, write_images, monkeypatch):
        """Write a recording of the layout, and let readers use the layout."""
        write_images(tmp_path / "set/frames/walk", numbered("cam_{:03}.png", 7, 8, 9), SIZE)
        write(tmp_path, {"set/boxes/walk.txt": "7 1 2 9 2 9 8 1 8 0\n9 3 2 9 2 9 8 3 8 1\n"})
        write(tmp_path, {"mine.toml": self.MINE})
        monkeypatch.setenv(LAYOUT_VARIABLE, str(tmp_path / "mine.toml"))
        return tmp_path / "set"

    def test_recording_is_read_and_listed(self, recording):
        (path,) = datasets.matching(str(recording))
        sequence = datasets.load(path)
        assert (sequence.name, sequence.frame_name(0)) == ("walk", "cam_007.png")
        np.testing.assert_array_equal(sequence.boxes, [[1, 2, 8, 6], NAN, [3, 2, 6, 6]])
        assert sequence.annotated.tolist() == [True, False, True]
        assert sequence.attributes["occluded"].tolist() == [False, False, True]
        assert sequence.origin.format == "a folder with frames/NAME/ and boxes/NAME.txt (mine)"

    def test_edited_layout_is_read_again(self, recording, tmp_path):
        assert datasets.load(recording / "walk").origin.first_pixel == 0
        (tmp_path / "mine.toml").write_text(self.MINE + "first_pixel = 1\n")
        assert datasets.load(recording / "walk").boxes[0].tolist() == [0, 1, 8, 6]

    @pytest.mark.parametrize(
        ("row", "message"),
        [
            ("7 1 2 9 2 9 8 1 8\n", "line 1: .* is not a row of mine. Expected: frame x1"),
            ("7 1 2 9 2 9 8 1 8 2\n", "line 1: .* is not a row of mine"),
            ("6 1 2 9 2 9 8 1 8 0\n", "line 1: frame 6 is the first. Expected: .* from 7"),
            ("12 1 2 9 2 9 8 1 8 0\n", "6 ground-truth rows for 3 images"),
        ],
    )
    def test_mistake_in_a_row_is_refused(self, recording, row, message):
        (recording / "boxes/walk.txt").write_text(row)
        with pytest.raises(SequenceError, match=rf"walk\.txt: {message}"):
            datasets.load(recording / "walk")

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("[mine]\nimages = 3", r"\[mine\] images"),
            ("[mine]\nimage = 'a'", r"\[mine\] image: Extra inputs"),
            ("[mine]\nimages = 'NAME'", r"\[mine\] .*paths of the images and the truth"),
            (
                "[mine]\nimages='NAME'\ntruth='t'\ncolumns='x y'",
                "columns is 'x y'. Expected: x y w",
            ),
            ("mine = 3", r"mine is not a table. Expected: \[mine\]"),
            ("[mine", "mine.toml: "),
        ],
    )
    def test_wrong_layout_is_refused_with_its_field(self, recording, tmp_path, text, message):
        (tmp_path / "mine.toml").write_text(text)
        with pytest.raises(SequenceError, match=message):
            datasets.load(recording / "walk")

    def test_option_of_commands_selects_the_layout(self, recording, tmp_path, monkeypatch, capsys):
        monkeypatch.delenv(LAYOUT_VARIABLE)
        arguments = ["--layout", str(tmp_path / "mine.toml")]
        with pytest.raises(SystemExit) as ended:
            main(["describe", str(recording / "walk"), *arguments])
        assert not ended.value.code
        assert "boxes/NAME.txt (mine)" in capsys.readouterr().out
        assert LAYOUT_VARIABLE not in os.environ
        root = ["--name", "own", "--results-root", str(tmp_path)]
        with pytest.raises(SystemExit) as ended:
            main(["run", "--trackers", "static", "--sequences", str(recording), *arguments, *root])
        assert not ended.value.code
        assert "1 of 1 runs are in" in capsys.readouterr().out


def test_absent_txt_without_files_of_webuav_is_otb(create):
    root = create("webuav3m")
    (root / "AICV_000123/language.txt").unlink()
    (root / "AICV_000123").rename(root / "s")
    sequence = datasets.load(root / "s")
    assert "(OTB)" in sequence.origin.format
    assert sequence.origin.unread_files == ("absent.txt",)
