"""OpenCV's NanoTrack: a light Siamese network; the user supplies its models."""

from pydantic import Field

from trackmark.trackers.base.opencv import (
    ModelFile,
    ModelFileParameters,
    ModelFileTracker,
    find_factory,
)

__all__ = ["Nano"]

SOURCE = "published by the NanoTrack project, not included in trackmark [path]"


class NanoParameters(ModelFileParameters):
    """Parameters of `Nano`."""

    backbone: ModelFile = Field(description=f"ONNX file of NanoTrack's features, {SOURCE}")
    neckhead: ModelFile = Field(description=f"ONNX file of NanoTrack's comparison, {SOURCE}")


class Nano(ModelFileTracker):
    """OpenCV's NanoTrack: a light Siamese network.

    Features of the target in the first frame are correlated with those around the last box. It
    adapts to changes of size and never reports a lost target.
    """

    paper = "H. Chu, NanoTrack, 2021: a project without a paper"
    Parameters = NanoParameters
    create_tracker = find_factory("Nano", "install OpenCV 4.7 or later")
    opencv_parameters = "TrackerNano_Params"
