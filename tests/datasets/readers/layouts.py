"""Layouts of benchmarks, of three images, as users have them.

Each maker writes into a folder and gives the path to open, the file of truth, and a frame's file.
The target is absent in the last frame.
"""

VOT_MASK = "m3,4,5,3,0,7,1,6,1"


def boxes(*rows):
    return "".join(",".join(map(str, row)) + "\n" for row in rows)


def write(folder, texts):
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def vot_classic(folder, write_images, write_video, size=(48, 32)):
    walk = folder / "walk"
    write_images(walk, [f"{i:08}.jpg" for i in (1, 2, 3)], size)
    polygon = "1,2,9,2,9,8,1,8\n2.5,2,9,3,8,8,1,7\n"
    write(walk, {"groundtruth.txt": f"{polygon}nan,nan,nan,nan,nan,nan,nan,nan\n"})
    write(walk, {"occlusion.label": "0\n1\n1\n", "camera_motion.tag": "1\n"})
    return walk, walk / "groundtruth.txt", walk / "00000002.jpg"


def vot_current(folder, write_images, write_video, size=(48, 32)):
    walk = folder / "walk"
    write_images(walk / "color", [f"{i:08}.jpg" for i in (1, 2, 3)], size)
    write(walk, {"groundtruth.txt": f"{VOT_MASK}\n2,3,8,9\n0\n", "anchor.value": "1\n0\n-1\n"})
    write(walk, {"sequence": "name=walk\nfps=25\nchannels.color=color/%08d.jpg\n"})
    return walk, walk / "groundtruth.txt", walk / "color" / "00000002.jpg"


def got10k(folder, write_images, write_video, size=(48, 32)):
    walk = folder / "walk"
    write_images(walk, [f"{i:08}.jpg" for i in (1, 2, 3)], size)
    info = "[METAINFO]\nanno_fps: 10Hz\nobject_class: dog\nmotion_class: running\n"
    write(walk, {"groundtruth.txt": boxes((2, 3, 8, 9), (3, 3, 8, 9), (4, 3, 8, 9))})
    write(walk, {"meta_info.ini": info, "cover.label": "8\n3\n0\n", "absence.label": "0\n0\n1\n"})
    write(walk, {"cut_by_image.label": "0\n1\n0\n"})
    return walk, walk / "groundtruth.txt", walk / "00000002.jpg"


def lasot(folder, write_images, write_video, size=(48, 32)):
    walk = folder / "walk"
    write_images(walk / "img", [f"{i:08}.jpg" for i in (1, 2, 3)], size)
    write(walk, {"groundtruth.txt": boxes((2, 3, 8, 9), (3, 3, 8, 9), (4, 3, 8, 9))})
    write(walk, {"full_occlusion.txt": "0,0,0", "out_of_view.txt": "0,0,1"})
    write(walk, {"nlp.txt": "a dog that\nwalks\n"})
    return walk, walk / "groundtruth.txt", walk / "img" / "00000002.jpg"


def trackingnet(folder, write_images, write_video, size=(48, 32)):
    shown = folder / "TRAIN_0" / "frames" / "walk"
    write_images(shown, ["0.jpg", "1.jpg", "2.jpg"], size)
    write(folder, {"TRAIN_0/anno/walk.txt": boxes((1, 2, 8, 9), (2, 2, 8, 9), (3, 2, 0, 0))})
    return shown, folder / "TRAIN_0/anno/walk.txt", shown / "1.jpg"


def uav123(folder, write_images, write_video, size=(48, 32)):
    shown = folder / "data_seq" / "UAV123" / "walk"
    write_images(shown, [f"{i:06}.jpg" for i in (1, 2, 3)], size)
    rows = boxes((2, 3, 8, 9), (3, 3, 8, 9), ("NaN",) * 4)
    write(folder, {"anno/UAV123/walk.txt": rows})
    return folder / "walk", folder / "anno/UAV123/walk.txt", shown / "000002.jpg"


def nfs(folder, write_images, write_video, size=(48, 32)):
    walk = folder / "walk"
    write_images(walk / "30" / "walk", [f"{i:05}.jpg" for i in (1, 2, 3)], size)
    rows = [f'0 {1 + i} 2 {9 + i} 11 {8 * i} {int(i == 2)} {i % 2} 0 "a dog"\n' for i in range(3)]
    write(walk, {"30/walk.txt": "".join(rows)})
    return walk, walk / "30" / "walk.txt", walk / "30" / "walk" / "00002.jpg"


def tcolor128(folder, write_images, write_video, size=(48, 32)):
    walk = folder / "walk"
    write_images(walk / "img", [f"{i:04}.jpg" for i in (4, 5, 6)], size)
    write(walk, {"walk_gt.txt": boxes((2, 3, 8, 9), (3, 3, 8, 9), (4, 3, 0, 0))})
    write(walk, {"walk_frames.txt": "4,6\n"})
    return walk, walk / "walk_gt.txt", walk / "img" / "0005.jpg"


def tlp(folder, write_images, write_video, size=(48, 32)):
    walk = folder / "walk"
    write_images(walk / "img", [f"{i:05}.jpg" for i in (1, 2, 3)], size)
    rows = boxes((1, 1, 2, 8, 9, 0), (2, 2, 2, 8, 9, 0), (3, 3, 2, 8, 9, 1))
    write(walk, {"groundtruth_rect.txt": rows})
    return walk, walk / "groundtruth_rect.txt", walk / "img" / "00002.jpg"


def mot(folder, write_images, write_video, size=(48, 32)):
    walk = folder / "walk"
    write_images(walk / "img1", [f"{i:06}.jpg" for i in (1, 2, 3)], size)
    rows = [(1, 7, 2, 3, 8, 9, 1, 1, 1), (2, 7, 3, 3, 8, 9, 1, 1, 0.5)]
    others = [(2, 9, 5, 5, 8, 9, 1, 1, 0.25), (1, 12, 1, 1, 0, 0, 0, 8, 1)]
    write(walk, {"gt/gt.txt": boxes(*rows, *others)})
    write(walk, {"seqinfo.ini": "[Sequence]\nname=walk\nimDir=img1\nframeRate=14\nseqLength=3\n"})
    return walk, walk / "gt" / "gt.txt", walk / "img1" / "000002.jpg"


LAYOUTS = [
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
