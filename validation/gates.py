"""Gates: a measured value, its threshold, and why the threshold stands where it does."""

import math
from dataclasses import asdict, dataclass
from typing import Literal


@dataclass(frozen=True)
class Gate:
    """Passes when ``value`` is at most, or at least, ``threshold``; a nan never passes."""

    section: str
    subject: str
    quantity: str
    value: float
    bound: Literal["at most", "at least"]
    threshold: float
    reason: str

    @property
    def passed(self) -> bool:
        """Whether the value keeps to its side of the threshold, which belongs to that side."""
        return self.value <= self.threshold if self.bound == "at most" else self.value >= self.threshold

    @property
    def margin(self) -> float:
        """How far the value is on the right side of the threshold; negative when it fails."""
        return self.threshold - self.value if self.bound == "at most" else self.value - self.threshold

    def record(self) -> dict[str, object]:
        """For JSON, which has no nan: a value that is not a number is None."""
        finite = math.isfinite(self.value)
        numbers = {"value": self.value if finite else None, "margin": self.margin if finite else None}
        return asdict(self) | numbers | {"passed": self.passed}


# Pictures. The values are shares and means over pixels, so they do not depend on the resolution.
#
# With the same offset rule only float32 against float64 is left: 1e-7 of a colour, and a pixel whose ray passes
# within that of an edge. 0.02 % is 3 pixels of 128 x 128; a seeded gain of 1.001 already leaves a mean of 1e-4.
MATCHED = {
    "ssim": 0.9999,
    "ssim_foreground": 0.9999,
    "pixel_share": 2e-4,
    "mean_error": 2e-5,
}
# With our own rule spawned rays start up to 1e-4 nearer the surface than Mitsuba's, so shadow and silhouette edges
# of reflections move by as much: a seam of pixels, and nothing outside the fragile ones.
OWN = {
    "ssim": 0.998,
    "ssim_foreground": 0.997,
    "pixel_share": 3e-3,
    "mean_error": 3e-4,
    "max_error": 5e-3,
}
# Above this share the maximum would be judged on too little; 0.24 % was measured for the first such scene.
FRAGILE_SHARE = 0.02
REASONS = {
    "ssim": "structure: an edge, a normal or a bounce out of place",
    "ssim_foreground": "the same over the objects alone, which a flat background cannot raise",
    "pixel_share": "share of pixels off by more than 1/255 in sRGB",
    "mean_error": "brightness, which SSIM does not see; linear radiance",
    "max_error": "one wrong pixel outside the fragile ones; sRGB",
}
# Mitsuba's sensors round film positions to float32, 1e-4 pixel at 1024; a shift of 0.1 pixel is a defect to catch.
CAMERA_PIXELS = 2e-3
# AOVs: a float32 hit errs by 3e-7 + 2e-7 / |n.d| of its distance; below an angle of 0.02 rad that passes 1e-5.
AOV_DEPTH = 1e-5
# An interpolated float32 normal errs by a few 1e-7; 1e-4 rad would show on no picture.
AOV_NORMAL = 1e-4
AOV_SHARE = 2e-4
