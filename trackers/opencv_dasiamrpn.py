"""OpenCV's DaSiamRPN: a Siamese network that proposes regions; its models are files of yours."""

from trackmark.trackers.base.opencv import (
    ModelFile,
    ModelParameters,
    ModelTracker,
    factory,
    model_file,
)

__all__ = ["DaSiamRPN"]

SOURCE = "which OpenCV's sample of DaSiamRPN names, and trackmark has not [path]"


class DaSiamRPNParameters(ModelParameters):
    """Parameters of `DaSiamRPN`."""

    model: ModelFile = model_file(f"ONNX file of DaSiamRPN's network, {SOURCE}")
    kernel_cls1: ModelFile = model_file(f"ONNX file of its kernel for classes, {SOURCE}")
    kernel_r1: ModelFile = model_file(f"ONNX file of its kernel for regions, {SOURCE}")


class DaSiamRPN(ModelTracker):
    """OpenCV's DaSiamRPN: a Siamese network that proposes regions.

    Kernels made from the target in the first frame are laid over what lies around the last place;
    it follows changes of size and shape, and never says that it lost the target.
    """

    paper = (
        "Z. Zhu, Q. Wang, B. Li, W. Wu, J. Yan, W. Hu, Distractor-aware Siamese networks for "
        "visual object tracking, ECCV 2018"
    )
    Parameters = DaSiamRPNParameters
    create_tracker = factory("DaSiamRPN", "install OpenCV 4.5.1 or later")
    opencv_parameters = "TrackerDaSiamRPN_Params"
