"""OpenCV's GOTURN: regression by a deep network (OpenCV 4); the user supplies its models."""

from typing import Any

from trackmark.trackers.base.opencv import (
    ModelFile,
    ModelFileParameters,
    ModelFileTracker,
    find_factory,
    model_file,
)

__all__ = ["GOTURN"]

SOURCE = "which OpenCV's sample of GOTURN names, and trackmark has not [path]"


class GOTURNParameters(ModelFileParameters):
    """Parameters of `GOTURN`."""

    network: ModelFile = model_file(f"Caffe's description of GOTURN's network, {SOURCE}")
    weights: ModelFile = model_file(f"Caffe file of the network's weights, {SOURCE}")


class GOTURN(ModelFileTracker):
    """OpenCV's GOTURN: regression by a deep network.

    A network predicts the new box from the image around the last box in two consecutive frames. It
    keeps no appearance of the first frame. OpenCV 5 does not include it.
    """

    paper = "D. Held, S. Thrun, S. Savarese, Learning to track at 100 FPS, ECCV 2016"
    Parameters = GOTURNParameters
    create_tracker = find_factory(
        "GOTURN", "it is in OpenCV 4 (from 4.5.1), and no more in OpenCV 5"
    )
    opencv_parameters = "TrackerGOTURN_Params"

    def _opencv_values(self) -> dict[str, Any]:
        values = super()._opencv_values()
        return {"modelTxt": values["network"], "modelBin": values["weights"]}
