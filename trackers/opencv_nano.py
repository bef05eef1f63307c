"""OpenCV's NanoTrack: a light Siamese network; its models are files of yours."""

from trackmark.trackers.base.opencv import (
    ModelFile,
    ModelParameters,
    ModelTracker,
    factory,
    model_file,
)

__all__ = ["Nano"]

SOURCE = "which comes with the NanoTrack project, not with trackmark [path]"


class NanoParameters(ModelParameters):
    """Parameters of `Nano`."""

    backbone: ModelFile = model_file(f"ONNX file of NanoTrack's features, {SOURCE}")
    neckhead: ModelFile = model_file(f"ONNX file of NanoTrack's comparison, {SOURCE}")


class Nano(ModelTracker):
    """OpenCV's NanoTrack: a light Siamese network.

    Features of the target in the first frame are compared with those around the last place; it
    follows changes of size, and never says that it lost the target.
    """

    paper = "H. Chu, NanoTrack, 2021: a project without a paper"
    Parameters = NanoParameters
    create_tracker = factory("Nano", "install OpenCV 4.7 or later")
    opencv_parameters = "TrackerNano_Params"
