"""Names of sequences and of their result files."""

import pytest

from trackmark.bench.exchange.names import file_name, files_of_sequences, is_same_name


@pytest.mark.parametrize(
    ("sequence", "file"),
    [
        ("Jogging.1", "jogging-1"),
        ("Jogging.1", "Jogging_1"),
        ("FleetFace", "fleetface"),
        ("bird1_1", "uav_bird1_1"),
        ("uav1_1", "uav_uav1_1"),
        ("Gymnastics", "nfs_Gymnastics"),
        ("Pool_ce3", "tpl_Pool_ce3"),
        ("samples/face:filter.noise=20", "samples_face_filter.noise=20"),
        ("汽车", "汽车"),
        ("cafe\u0301", "café"),
    ],
)
def test_spellings_of_one_name_match(sequence, file):
    assert files_of_sequences([sequence, "other"], [file, "another"]) == {sequence: file}


@pytest.mark.parametrize(
    ("sequence", "file"),
    [
        ("car1_1", "car11"),
        ("Jogging.1", "Jogging1"),
        ("汽车", "行人"),
        ("汽车1", "行人1"),
        ("машина", "человек"),
        ("Maß", "Mass"),
        ("कि", "की"),
        ("a", "a_"),
        ("uav_1", "nfs_1"),
        ("bird1_1", "xyz_bird1_1"),
        ("!", "?"),
    ],
)
def test_different_names_do_not_match(sequence, file):
    assert files_of_sequences([sequence], [file]) == {}
    assert not is_same_name(sequence, file)


@pytest.mark.parametrize(
    ("sequences", "files", "chosen"),
    [
        (["a-b", "a_b"], ["a-b"], {"a-b": "a-b"}),
        (["a-b", "a_b"], ["A.b"], {}),
        (["a-b"], ["a.b", "a_b"], {}),
        (["Car", "car"], ["car"], {"car": "car"}),
        (["bird1"], ["bird1", "uav_bird1"], {"bird1": "bird1"}),
    ],
)
def test_file_belongs_to_one_sequence(sequences, files, chosen):
    assert files_of_sequences(sequences, files) == chosen


def test_file_names_keep_letters_of_all_scripts():
    names = ["汽车", "行人", "कि", "की", "café"]
    assert [file_name(name) for name in names] == names
    assert file_name("knob.py:Knob/a b") == "knob.py_Knob_a_b"
