"""OpenCV's VitTrack: a light vision transformer; its model is a file of yours."""

from trackmark.trackers.base.opencv import (
    ModelFile,
    ModelParameters,
    ModelTracker,
    factory,
    model_file,
)
from trackmark.trackers.base.parameters import fraction

__all__ = ["Vit"]


class VitParameters(ModelParameters):
    """Parameters of `Vit`."""

    net: ModelFile = model_file(
        "ONNX file of VitTrack, which comes with OpenCV's model zoo, not with trackmark [path]"
    )
    tracking_score_threshold: float = fraction(
        0.2, "where the score is below, the target counts as lost [score]"
    )


class Vit(ModelTracker):
    """OpenCV's VitTrack: a light vision transformer.

    The target in the first frame and what lies around the last place go through one transformer;
    it follows changes of size, and says when it has lost the target.

    OpenCV 5.0 does not scale colours as the model was trained: it inverts their three deviations as
    if they were one quaternion, so that two colours change their sign. That is left as it is.
    """

    paper = "P. Liu, VitTrack, OpenCV Zoo, 2023: a model without a paper"
    Parameters = VitParameters
    create_tracker = factory("Vit", "install OpenCV 4.9 or later")
    opencv_parameters = "TrackerVit_Params"
