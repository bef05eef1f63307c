"""OpenCV's CSRT: a correlation filter with channel and spatial reliability."""

from typing import Any, Literal

from pydantic import Field

from trackmark.trackers.base.opencv import OpenCVParameters, OpenCVTracker, find_factory
from trackmark.trackers.base.parameters import (
    TrackerError,
    choice,
    fraction,
    nonnegative,
    positive,
    whole,
)

__all__ = ["CSRT"]


class CSRTParameters(OpenCVParameters):
    """Parameters of `CSRT`: OpenCV's, by its names, with its defaults."""

    psr_threshold: float = nonnegative(
        0.035, "where the filter's answer is below, the target counts as lost [answer]"
    )
    use_hog: bool = choice(True, "whether gradients (HOG) are features")
    use_color_names: bool = choice(True, "whether colour names are features")
    use_gray: bool = choice(True, "whether the grey value is a feature")
    use_rgb: bool = choice(False, "whether the three colours are features")
    num_hog_channels_used: int = whole(18, "channels of HOG that are used [count]", most=31)
    hog_orientations: float = positive(9.0, "orientations of HOG, as OpenCV has it [count]")
    hog_clip: float = positive(0.2, "largest value of HOG, as OpenCV has it [share]")
    use_channel_weights: bool = choice(True, "whether channels count by their reliability")
    use_segmentation: bool = choice(True, "whether pixels count by a segmentation")
    histogram_bins: int = whole(16, "bins a colour of the segmentation [count]", most=256)
    background_ratio: int = whole(2, "how far the background reaches, over the target [ratio]")
    histogram_lr: float = fraction(0.04, "share of a frame in the histograms [fraction]")
    filter_lr: float = fraction(0.02, "share of a frame in the filter [fraction]")
    weights_lr: float = fraction(0.02, "share of a frame in the channels' weights [fraction]")
    admm_iterations: int = whole(4, "steps by which a filter is found [count]")
    padding: float = positive(3.0, "what is searched around the target, over its size [ratio]")
    template_size: float = positive(200.0, "side that what is searched is scaled to [pixels]")
    gsl_sigma: float = positive(1.0, "width of the answer that is learnt [cells]")
    window_function: Literal["hann", "cheb", "kaiser"] = choice("hann", "how borders fade")
    cheb_attenuation: float = positive(45.0, "attenuation of the window cheb [decibels]")
    kaiser_alpha: float = nonnegative(3.75, "shape of the window kaiser [alpha]")
    number_of_scales: int = whole(33, "sizes that are tried, an odd number [count]")
    scale_step: float = Field(1.02, ge=1.0, description="from one size to the next [ratio]")
    scale_lr: float = fraction(0.025, "share of a frame in the filter of sizes [fraction]")
    scale_sigma_factor: float = positive(
        0.25, "width of the answer that is learnt over sizes [ratio]"
    )
    scale_model_max_area: float = Field(
        512.0, ge=16.0, description="largest patch for the filter of sizes [square pixels]"
    )


class CSRT(OpenCVTracker):
    """OpenCV's CSRT: a correlation filter with channel and spatial reliability.

    A correlation filter on colour names and gradients, restricted to the target by a spatial
    reliability map. It adapts to changes of size.

    The paper has no `psr_threshold`: the maximum of the filter response is the target in every
    frame. OpenCV skips frames whose maximum is below 0.035: it neither moves the box nor updates
    the filter. `recommended` disables the threshold (0). That changes boxes only if the target is
    nearly invisible. OTB's Crossing has no such frame (mean overlap 0.71 with both).
    """

    paper = (
        "A. Lukežič, T. Vojíř, L. Čehovin Zajc, J. Matas, M. Kristan, Discriminative "
        "correlation filter with channel and spatial reliability, CVPR 2017"
    )
    Parameters = CSRTParameters
    presets = {"opencv": {}, "recommended": {"psr_threshold": 0.0}}
    create_tracker = find_factory("CSRT")
    opencv_parameters = "TrackerCSRT_Params"
    smallest_side = 2

    def _make(self) -> Any:
        settings = self.parameters
        kinds = settings.use_hog, settings.use_color_names, settings.use_gray, settings.use_rgb
        if not any(kinds):  # OpenCV would terminate the process
            raise TrackerError(
                "opencv-csrt needs features: one of use_hog, use_color_names, use_gray and use_rgb."
            )
        return super()._make()
