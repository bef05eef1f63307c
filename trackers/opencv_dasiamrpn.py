"""OpenCV's DaSiamRPN: a Siamese region proposal network; the user supplies its models."""

from pydantic import Field

from trackmark.trackers.base.opencv import (
    ModelFile,
    ModelFileParameters,
    ModelFileTracker,
    find_factory,
)

__all__ = ["DaSiamRPN"]

SOURCE = "named in OpenCV's sample of DaSiamRPN, not included in trackmark [path]"


class DaSiamRPNParameters(ModelFileParameters):
    """Parameters of `DaSiamRPN`."""

    model: ModelFile = Field(description=f"ONNX file of DaSiamRPN's network, {SOURCE}")
    kernel_cls1: ModelFile = Field(description=f"ONNX file of the classification kernel, {SOURCE}")
    kernel_r1: ModelFile = Field(description=f"ONNX file of the regression kernel, {SOURCE}")


class DaSiamRPN(ModelFileTracker):
    """OpenCV's DaSiamRPN: a Siamese region proposal network.

    Kernels computed from the target in the first frame are correlated with the region around the
    last box. The tracker adapts to changes of size and shape, and never reports a lost target.
    """

    paper = (
        "Z. Zhu, Q. Wang, B. Li, W. Wu, J. Yan, W. Hu, Distractor-aware Siamese networks for "
        "visual object tracking, ECCV 2018"
    )
    Parameters = DaSiamRPNParameters
    create_tracker = find_factory("DaSiamRPN", "install OpenCV 4.5.1 or later")
    opencv_parameters = "TrackerDaSiamRPN_Params"
