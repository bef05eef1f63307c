"""Tracker that uses the library vot-trax: returns the init region. Usage: library.py IMAGE REGION.

Its confidence is the grey level of the centre of the image divided by 255.
"""

import sys

import cv2
import numpy as np


def pixels(image):
    """Return the BGR pixels of an image in any form."""
    if hasattr(image, "path"):
        return cv2.imread(image.path())
    if hasattr(image, "array"):
        return image.array()[:, :, ::-1]
    return cv2.imdecode(np.frombuffer(image.buffer(), np.uint8), cv2.IMREAD_COLOR)


def main():
    import trax  # may not be installed where doctests are collected

    regions, images = [sys.argv[2]], [sys.argv[1]]
    with trax.Server(regions, images, tracker_name="library") as server:
        while (request := server.wait()).type != "quit":
            if request.type == "initialize":
                region, _ = request.objects[0]
            image = pixels(request.image["color"])
            sys.stdout.write("a log line\n")
            blue = int(image[image.shape[0] // 2, image.shape[1] // 2, 0])
            server.status([(region, {"confidence": blue / 255})])


if __name__ == "__main__":
    main()
