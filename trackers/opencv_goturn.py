"""OpenCV's GOTURN: regression by a deep network, in OpenCV 4; its models are files of yours."""

from typing import Any

from trackmark.trackers.base.opencv import (
    ModelFile,
    ModelParameters,
    ModelTracker,
    factory,
    model_file,
)

__all__ = ["GOTURN"]

SOURCE = "which OpenCV's sample of GOTURN names, and trackmark has not [path]"


class GOTURNParameters(ModelParameters):
    """Parameters of `GOTURN`."""

    network: ModelFile = model_file(f"Caffe's description of GOTURN's network, {SOURCE}")
    weights: ModelFile = model_file(f"Caffe file of the network's weights, {SOURCE}")


class GOTURN(ModelTracker):
    """OpenCV's GOTURN: regression by a deep network.

    A network that has learnt how things move says where the last box has gone to; it keeps nothing
    of the first frame. OpenCV 5 has it no more.
    """

    paper = "D. Held, S. Thrun, S. Savarese, Learning to track at 100 FPS, ECCV 2016"
    Parameters = GOTURNParameters
    create_tracker = factory("GOTURN", "it is in OpenCV 4 (from 4.5.1), and no more in OpenCV 5")
    opencv_parameters = "TrackerGOTURN_Params"

    def _opencv_values(self) -> dict[str, Any]:
        values = super()._opencv_values()
        return {"modelTxt": values["network"], "modelBin": values["weights"]}
