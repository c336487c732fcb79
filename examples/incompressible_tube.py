"""Image a tube that contracts and shortens by a formula: it keeps its volume, so its cross-section grows."""

import echotruth as et

shortening = 0.15
heart = et.beat(
    {
        "geometry": {"shape": "tube", "endo_length_mm": 3, "base_mm": 1, "circumferential_elements": 24,
                     "longitudinal_elements": 4, "transmural_elements": 2},
        "motion": {"kind": "tube", "tube": {"shortening": shortening}},
        "loop": {"frames": 4},
        "bmode": {"size_px": 256, "downsampling": (1,)},
        "rf": {"lines": 64},
        "phantom": {"density_per_mm3": 300.0},
    }
)  # fmt: skip
clip = et.image(heart, "mid")
area = clip["mask"].sum(["axial", "lateral"])
area_ratio = float(area[heart.es] / area[0])
print(f"area of the wall at end-systole over that at end-diastole: {area_ratio:.3f}, 1 / {1 - shortening} is due")
