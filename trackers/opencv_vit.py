"""OpenCV's VitTrack: a light vision transformer; the user supplies its model."""

from pydantic import Field

from trackmark.trackers.base.opencv import (
    ModelFile,
    ModelFileParameters,
    ModelFileTracker,
    find_factory,
)
from trackmark.trackers.base.parameters import fraction

__all__ = ["Vit"]


class VitParameters(ModelFileParameters):
    """Parameters of `Vit`."""

    net: ModelFile = Field(
        description="ONNX file of VitTrack, published in OpenCV's model zoo, not included in "
        "trackmark [path]"
    )
    tracking_score_threshold: float = fraction(
        0.2, "the target counts as lost if the score is lower [score]"
    )


class Vit(ModelFileTracker):
    """OpenCV's VitTrack: a light vision transformer.

    One transformer processes the target in the first frame and the region around the last box. It
    adapts to changes of size and reports a lost target.

    OpenCV 5.0 normalises colours differently from the model's training: it inverts the three
    standard deviations as one quaternion, which negates two channels. This class does not correct
    the error.
    """

    paper = "P. Liu, VitTrack, OpenCV Zoo, 2023: a model without a paper"
    Parameters = VitParameters
    create_tracker = find_factory("Vit", "install OpenCV 4.9 or later")
    opencv_parameters = "TrackerVit_Params"
