"""A picture on the page: a frame of the clip with its colours and paths, axes in mm, and the scale of its colour."""

import numpy as np
from bokeh import models
from bokeh.events import MouseMove
from bokeh.plotting import figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from echotruth.report import style
from echotruth.viewer import script
from echotruth.viewer.tint import Tint

SIDE = 520
"""Of a picture on the screen until the window's width is known, px."""
PATHS = {"true": style.MOTION, "tracked": style.SERIES[0]}
"""Kind of paths to their colour; tracked ones have that of their tracker."""
EMPTY = np.zeros(0, np.float32)
NO_COLOUR = np.zeros((0, 0, 0), np.uint8)


class Panel:
    """One picture, of the truth or of a tracker.

    Parameters
    ----------
    clip : ColumnDataSource
        Grey levels of the clip.
    sliders : tuple of Slider
        The frame, and (never shown) the length of a side, mm.
    ranges : tuple of Range1d
        Lateral and axial: both panels share them.
    said : Div
        Where it is written what is under the pointer.
    name : str
        Under which the picture is found in the document.
    """

    def __init__(
        self,
        clip: models.ColumnDataSource,
        sliders: tuple[models.Slider, models.Slider],
        ranges: tuple[models.Range1d, models.Range1d],
        said: models.Div,
        name: str,
    ) -> None:
        frame, side = sliders
        self.picture = models.ColumnDataSource({"image": [np.zeros((1, 1), np.uint32)]}, name=f"picture_{name}")
        self.colour = models.ColumnDataSource({"index": [NO_COLOUR]}, name=f"colour_{name}")
        self.palette = models.ColumnDataSource({"red": EMPTY, "green": EMPTY, "blue": EMPTY})
        self.names = models.ColumnDataSource({"name": [""]})
        self.positions = {kind: models.ColumnDataSource({"x": EMPTY, "y": EMPTY}) for kind in PATHS}
        steps = dict.fromkeys(("x0", "y0", "x1", "y1", "head_x"), EMPTY)
        self.paths = {kind: models.ColumnDataSource(dict(steps), name=f"{kind}_{name}") for kind in PATHS}
        self.label = models.Label(
            x=8, y=8, x_units="screen", y_units="screen", text_color="white", text_font_size="13px"
        )
        scale = models.LinearColorMapper(palette=["#ffffff"], low=0, high=1)
        self.bar = models.ColorBar(
            color_mapper=scale,
            ticker=models.FixedTicker(),  # of which a bar sees new ticks, as it does not see another ticker
            width=12,
            visible=False,
            title_standoff=8,
            major_label_policy=models.AllLabels(),
        )
        self.figure = _figure(ranges, name)
        # Rows run downwards as depth does: the first is at depth 0, where the axis begins.
        self._image = self.figure.image_rgba("image", x=-1, y=0, dw=2, dh=2, source=self.picture, origin="bottom_left")
        self._renderers = {kind: self._glyphs(kind) for kind in PATHS}
        self.figure.add_layout(self.label)
        self.figure.add_layout(self.bar, "right")
        parts = {"picture": self.picture, "colour": self.colour, "bar": self.bar, "names": self.names}
        pointer = script.callback("pointer", clip=clip, slider=frame, side=side, said=said, **parts)
        self.figure.js_on_event(MouseMove, pointer)

    def _glyphs(self, kind: str) -> list[models.GlyphRenderer]:
        source, colour = self.paths[kind], PATHS[kind]
        width = 3 if kind == "true" else 1.5  # so that it is seen below what is drawn over it
        line = self.figure.segment("x0", "y0", "x1", "y1", source=source, line_color=colour, line_width=width)
        head = self.figure.scatter("head_x", "y1", size=5, source=source, color=colour, line_color=None)
        for renderer in (line, head):
            renderer.visible = False
        return [line, head]

    def size(self, pixels: int, side: float) -> None:
        """Make room for images of another size.

        Parameters
        ----------
        pixels : int
            Along a side.
        side : float
            mm.
        """
        self.picture.data = {"image": [np.zeros((pixels, pixels), np.uint32)]}
        self._image.glyph.update(x=-side / 2, y=0, dw=side, dh=side)

    def clear(self) -> None:
        """Show neither colours nor paths."""
        self.tint(None)
        for kind in PATHS:
            self.draw(kind, None)

    def tint(self, tint: Tint | None) -> None:
        """Show other colours, or none."""
        if tint is None:
            self.colour.data = {"index": [NO_COLOUR]}
            self.bar.visible = False
            return
        rgb = np.array([[int(colour[place : place + 2], 16) for place in (1, 3, 5)] for colour in tint.palette])
        self.palette.data = dict(zip(("red", "green", "blue"), rgb.astype(np.float32).T.copy(), strict=True))
        self.names.data = {"name": ["", *tint.names.values()]}
        self.bar.color_mapper.update(palette=tint.palette, low=tint.low, high=tint.high)
        self.bar.ticker.ticks = list(tint.names) or MaxNLocator(6, steps=(1, 2, 5, 10)).tick_values(tint.low, tint.high)
        self.bar.update(title=tint.title, visible=True, major_label_overrides=tint.names)
        self.colour.data = {"index": [tint.index]}

    def follow(self, colour: str) -> None:
        """Give tracked paths the colour of another tracker."""
        line, head = self._renderers["tracked"]
        line.glyph.line_color = head.glyph.fill_color = colour

    def draw(self, kind: str, position: NDArray[np.float32] | None) -> None:
        """Draw other paths of a kind, given the positions (frame, n, 2) of their points in mm, or none."""
        x, y = (EMPTY, EMPTY) if position is None else (position[..., 0].ravel(), position[..., 1].ravel())
        self.positions[kind].data = {"x": x, "y": y}
        for renderer in self._renderers[kind]:
            renderer.visible = position is not None


def _figure(ranges: tuple[models.Range1d, models.Range1d], name: str) -> figure:
    """Empty axes in mm, depth downwards."""
    lateral, axial = ranges
    drawn = figure(
        x_range=lateral,
        y_range=axial,
        frame_width=SIDE,
        frame_height=SIDE,
        styles={"flex": "none"},  # it overflows rather than be squeezed, until fit.js knows the room
        tools="pan,wheel_zoom,box_zoom,reset,save",
        active_drag=None,
        toolbar_location="above",
        background_fill_color="black",
        name=f"figure_{name}",
        x_axis_label="lateral (mm)",
        y_axis_label="depth (mm)",
    )
    drawn.grid.visible = False
    drawn.toolbar.logo = None
    return drawn
