"""Recordings of the sequence `walk` in all formats.

Each function writes a recording into a folder. In benchmarks, the target is absent in the last of
three frames.
"""

from typing import NamedTuple

import numpy as np
from PIL import Image

SIZE = (24, 16)
VOT_MASK = "m3,4,5,3,0,7,1,6,1"
TRUTH_CSV = (
    "frame,x,y,width,height,visibility,source\n0,1,2,8,9,0.5,marked\n1,2,2,8,9,,\n2,3,2,8,9,,\n"
)


class Recording(NamedTuple):
    """Paths of a recording: the path to open, its ground truth, and its second frame."""

    path: object
    truth: object
    frame: object


def write(folder, texts):
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def rows_text(*rows):
    return "".join(",".join(map(str, row)) + "\n" for row in rows)


def images(folder, write_images, write_video):
    walk = folder / "walk"
    write_images(walk, ["1.png", "2.jpg", "10.bmp", "11.tif", "12.ppm"], SIZE)
    write(walk, {"truth.csv": TRUTH_CSV})
    return Recording(walk, walk / "truth.csv", walk / "2.jpg")


def otb(folder, write_images, write_video):
    walk = folder / "walk"
    write_images(walk / "img", ["0001.png", "0002.jpg", "0003.png"], SIZE)
    write(
        walk, {"groundtruth_rect.txt": "2,3,8,9\n3\t3\t8\t9\n4 3 8 9\n", "attrs.txt": "OCC, SV\n"}
    )
    return Recording(walk, walk / "groundtruth_rect.txt", walk / "img" / "0002.jpg")


def davis(folder, write_images, write_video, n=3):
    frames, masks = (folder / kind / "480p" / "walk" for kind in ("JPEGImages", "Annotations"))
    write_images(frames, [f"{i:05}.jpg" for i in range(n)], SIZE)
    masks.mkdir(parents=True)
    for i in range(n):
        mask = np.zeros(SIZE[::-1], np.uint8)
        mask[4:9, 3 + i : 8 + i] = 1
        image = Image.fromarray(mask, "P")
        image.putpalette([0, 0, 0, 128, 0, 0])
        image.save(masks / f"{i:05}.png")
    return Recording(frames, masks / f"{n - 1:05}.png", frames / f"{n - 1:05}.jpg")


def video(folder, write_images, write_video):
    write(folder, {"walk.csv": TRUTH_CSV})
    file = write_video(folder / "walk.mp4", n=3, b_frames=0)
    return Recording(file, folder / "walk.csv", file)


def vot_classic(folder, write_images, write_video):
    walk = folder / "walk"
    write_images(walk, [f"{i:08}.jpg" for i in (1, 2, 3)], SIZE)
    polygon = "1,2,9,2,9,8,1,8\n2.5,2,9,3,8,8,1,7\n"
    write(walk, {"groundtruth.txt": f"{polygon}nan,nan,nan,nan,nan,nan,nan,nan\n"})
    write(walk, {"occlusion.label": "0\n1\n1\n", "camera_motion.tag": "1\n"})
    return Recording(walk, walk / "groundtruth.txt", walk / "00000002.jpg")


def vot_current(folder, write_images, write_video):
    walk = folder / "walk"
    write_images(walk / "color", [f"{i:08}.jpg" for i in (1, 2, 3)], SIZE)
    write(walk, {"groundtruth.txt": f"{VOT_MASK}\n2,3,8,9\n0\n", "anchor.value": "1\n0\n-1\n"})
    write(walk, {"sequence": "name=walk\nfps=25\nchannels.color=color/%08d.jpg\n"})
    return Recording(walk, walk / "groundtruth.txt", walk / "color" / "00000002.jpg")


def got10k(folder, write_images, write_video):
    walk = folder / "walk"
    write_images(walk, [f"{i:08}.jpg" for i in (1, 2, 3)], SIZE)
    info = "[METAINFO]\nanno_fps: 10Hz\nobject_class: dog\nmotion_class: running\n"
    write(walk, {"groundtruth.txt": rows_text((2, 3, 8, 9), (3, 3, 8, 9), (4, 3, 8, 9))})
    write(walk, {"meta_info.ini": info, "cover.label": "8\n3\n0\n", "absence.label": "0\n0\n1\n"})
    write(walk, {"cut_by_image.label": "0\n1\n0\n"})
    return Recording(walk, walk / "groundtruth.txt", walk / "00000002.jpg")


def lasot(folder, write_images, write_video):
    walk = folder / "walk"
    write_images(walk / "img", [f"{i:08}.jpg" for i in (1, 2, 3)], SIZE)
    write(walk, {"groundtruth.txt": rows_text((2, 3, 8, 9), (3, 3, 8, 9), (4, 3, 8, 9))})
    write(walk, {"full_occlusion.txt": "0,0,0", "out_of_view.txt": "0,0,1"})
    write(walk, {"nlp.txt": "a dog that\nwalks\n"})
    return Recording(walk, walk / "groundtruth.txt", walk / "img" / "00000002.jpg")


def trackingnet(folder, write_images, write_video):
    frames = folder / "TRAIN_0" / "frames" / "walk"
    write_images(frames, ["0.jpg", "1.jpg", "2.jpg"], SIZE)
    write(folder, {"TRAIN_0/anno/walk.txt": rows_text((1, 2, 8, 9), (2, 2, 8, 9), (3, 2, 0, 0))})
    return Recording(frames, folder / "TRAIN_0/anno/walk.txt", frames / "1.jpg")


def uav123(folder, write_images, write_video):
    frames = folder / "data_seq" / "UAV123" / "walk"
    write_images(frames, [f"{i:06}.jpg" for i in (1, 2, 3)], SIZE)
    rows = rows_text((2, 3, 8, 9), (3, 3, 8, 9), ("NaN",) * 4)
    write(folder, {"anno/UAV123/walk.txt": rows})
    return Recording(folder / "walk", folder / "anno/UAV123/walk.txt", frames / "000002.jpg")


def nfs(folder, write_images, write_video):
    walk = folder / "walk"
    write_images(walk / "30" / "walk", [f"{i:05}.jpg" for i in (1, 2, 3)], SIZE)
    rows = [f'0 {1 + i} 2 {9 + i} 11 {8 * i} {int(i == 2)} {i % 2} 0 "a dog"\n' for i in range(3)]
    write(walk, {"30/walk.txt": "".join(rows)})
    return Recording(walk, walk / "30" / "walk.txt", walk / "30" / "walk" / "00002.jpg")


def tcolor128(folder, write_images, write_video):
    walk = folder / "walk"
    write_images(walk / "img", [f"{i:04}.jpg" for i in (4, 5, 6)], SIZE)
    write(walk, {"walk_gt.txt": rows_text((2, 3, 8, 9), (3, 3, 8, 9), (4, 3, 0, 0))})
    write(walk, {"walk_frames.txt": "4,6\n"})
    return Recording(walk, walk / "walk_gt.txt", walk / "img" / "0005.jpg")


def tlp(folder, write_images, write_video):
    walk = folder / "walk"
    write_images(walk / "img", [f"{i:05}.jpg" for i in (1, 2, 3)], SIZE)
    rows = rows_text((1, 1, 2, 8, 9, 0), (2, 2, 2, 8, 9, 0), (3, 3, 2, 8, 9, 1))
    write(walk, {"groundtruth_rect.txt": rows})
    return Recording(walk, walk / "groundtruth_rect.txt", walk / "img" / "00002.jpg")


def mot(folder, write_images, write_video):
    walk = folder / "walk"
    write_images(walk / "img1", [f"{i:06}.jpg" for i in (1, 2, 3)], SIZE)
    rows = [(1, 7, 2, 3, 8, 9, 1, 1, 1), (2, 7, 3, 3, 8, 9, 1, 1, 0.5)]
    others = [(2, 9, 5, 5, 8, 9, 1, 1, 0.25), (1, 12, 1, 1, 0, 0, 0, 8, 1)]
    write(walk, {"gt/gt.txt": rows_text(*rows, *others)})
    write(walk, {"seqinfo.ini": "[Sequence]\nname=walk\nimDir=img1\nframeRate=14\nseqLength=3\n"})
    return Recording(walk, walk / "gt" / "gt.txt", walk / "img1" / "000002.jpg")


BENCHMARKS = [
    vot_classic,
    vot_current,
    got10k,
    lasot,
    trackingnet,
    uav123,
    nfs,
    tcolor128,
    tlp,
    mot,
]
LAYOUTS = [images, otb, davis, video, *BENCHMARKS]
