"""OpenCV's GOTURN: regression by a deep network (OpenCV 4); the user supplies its models."""

from typing import Any

from pydantic import Field

from trackmark.trackers.base.opencv import (
    ModelFile,
    ModelFileParameters,
    ModelFileTracker,
    find_factory,
)

__all__ = ["GOTURN"]

SOURCE = "named in OpenCV's sample of GOTURN, not included in trackmark [path]"


class GOTURNParameters(ModelFileParameters):
    """Parameters of `GOTURN`."""

    network: ModelFile = Field(description=f"Caffe's description of GOTURN's network, {SOURCE}")
    weights: ModelFile = Field(description=f"Caffe file of the network's weights, {SOURCE}")


class GOTURN(ModelFileTracker):
    """OpenCV's GOTURN: regression by a deep network.

    A network predicts the new box from the image around the last box in two consecutive frames. It
    does not use the first frame's appearance. OpenCV 5 does not include this tracker.
    """

    paper = "D. Held, S. Thrun, S. Savarese, Learning to track at 100 FPS, ECCV 2016"
    Parameters = GOTURNParameters
    create_tracker = find_factory(
        "GOTURN", "install OpenCV 4 (4.5.1 or newer); OpenCV 5 does not include it"
    )
    opencv_parameters = "TrackerGOTURN_Params"

    def _opencv_values(self) -> dict[str, Any]:
        values = super()._opencv_values()
        return {"modelTxt": values["network"], "modelBin": values["weights"]}
