"""Colours that figures and images share, as #rrggbb."""

from echotruth.imaging.labels import TissueLabel

MOTION, FLOW, BORDER = "#ffb000", "#7dff6a", "#ff7ab6"
"""Colours over images: of true paths, flow from frame to frame, and the true border of the wall."""

TAB20 = (
    *("#1f77b4", "#aec7e8", "#ff7f0e", "#ffbb78", "#2ca02c", "#98df8a", "#d62728", "#ff9896", "#9467bd", "#c5b0d5"),
    *("#8c564b", "#c49c94", "#e377c2", "#f7b6d2", "#7f7f7f", "#c7c7c7", "#bcbd22", "#dbdb8d", "#17becf", "#9edae5"),
)
"""Matplotlib's colours of that name: full ones, each followed by its pale one."""

_TISSUES = {
    TissueLabel.CAVITY: 6,
    TissueLabel.WALL: 2,
    TissueLabel.LEFT_ATRIUM: 8,
    TissueLabel.RIGHT_VENTRICLE: 0,
    TissueLabel.RIGHT_ATRIUM: 4,
    TissueLabel.RIGHT_FREE_WALL: 1,
    TissueLabel.ATRIAL_WALL: 9,
    TissueLabel.MITRAL_LEAFLET: 16,
    TissueLabel.PAPILLARY_MUSCLE: 3,
    TissueLabel.LUNG: 19,
    TissueLabel.CHEST_WALL: 10,
    TissueLabel.AORTIC_ROOT: 12,
    TissueLabel.AORTIC_WALL: 13,
    TissueLabel.AORTIC_CUSP: 17,
    TissueLabel.TRICUSPID_LEAFLET: 15,
}
"""Tissue to its entry of :data:`TAB20`: blood in a full colour, its wall in a pale one."""

TISSUES = tuple(TAB20[_TISSUES[label]] for label in TissueLabel if label)
"""Colours of the tissues of :class:`echotruth.imaging.labels.TissueLabel` from 1 on."""

SEGMENTS = tuple(TAB20[2 * (3 * number % 10)] for number in range(1, 18))
"""Full colours of the AHA segments from 1 on, those next to each other differently."""
