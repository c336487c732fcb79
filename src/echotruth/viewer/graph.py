"""A graph on the page: curves over the cycle, with a line at the frame that is shown."""

import numpy as np
from bokeh.models import BasicTicker, ColumnDataSource, Legend, LegendItem, Range1d, Span
from bokeh.plotting import figure

from echotruth.arrays import Floats
from echotruth.report import style
from echotruth.viewer.curves import TRUE, Plot

_COLUMNS = tuple(f"y{number}" for number in range(4))
"""Of the true curve, and of those of trackers."""
HEIGHT = 180
"""Of a graph on the screen until the window's is known, px."""


class Graph:
    """One graph.

    Parameters
    ----------
    name : str
        Under which it is found in the document.
    colours : dict
        Tracker -> its colour.
    """

    def __init__(self, name: str, colours: dict[str, str]) -> None:
        self._colours = {TRUE: style.TRUTH} | {key: one.colour for key, one in style.QUANTITIES.items()} | colours
        # On the layer above the curves, which then need not be drawn again when it moves.
        upright = {"dimension": "height", "location": 0}
        self.cursor = Span(**upright, line_color="#cc3311", line_width=1.5, level="overlay", name=f"cursor_{name}")
        self._es = Span(**upright, line_color="#999999", line_dash="dashed", visible=False)
        self.source = ColumnDataSource({name: [] for name in ("time", *_COLUMNS)}, name=f"curves_{name}")
        self.figure = figure(
            height=HEIGHT,
            sizing_mode="stretch_width",
            x_range=Range1d(0, 1),
            y_range=Range1d(0, 1),
            tools="",
            toolbar_location=None,
            x_axis_label="time since end-diastole (ms)",
            name=f"graph_{name}",
        )
        self.figure.yaxis.ticker = BasicTicker(desired_num_ticks=4, num_minor_ticks=0)
        self.figure.xaxis.ticker = BasicTicker(num_minor_ticks=0)
        self.figure.add_layout(self.cursor)
        self.figure.add_layout(self._es)
        self._lines = [
            self.figure.line("time", name, source=self.source, line_width=2, visible=False) for name in _COLUMNS
        ]
        self._names: list[str] = []
        self._legend = Legend(items=[], orientation="horizontal", location="top_left", spacing=12, padding=2, margin=2)
        self._legend.update(label_text_font_size="11px", border_line_color=None, background_fill_alpha=0)
        self.figure.add_layout(self._legend, "above")

    def show(self, plot: Plot, time: Floats, es_frame: int | None) -> None:
        """Show other curves.

        Parameters
        ----------
        plot : Plot
        time : ndarray of shape (frame,), ms
        es_frame : int or None
            Frame of end-systole.
        """
        curves = {name: values for name, values in plot.curves.items() if np.isfinite(values).any()}
        first = [TRUE] if TRUE in curves else []
        names = first + [name for name in curves if name != TRUE]
        columns = {name: np.full(len(time), np.nan) for name in _COLUMNS}
        columns |= {column: np.asarray(curves[name], float) for column, name in zip(_COLUMNS, names, strict=False)}
        self.source.data = {"time": time} | columns
        self._fit(time, list(curves.values()))
        for number, line in enumerate(self._lines):
            line.visible = number < len(names)
            line.glyph.line_color = self._colours[names[number] if number < len(names) else TRUE]
        if names != self._names:  # other models make Bokeh look through the whole page
            self._names = names
            self._legend.items = [LegendItem(label=name, renderers=[self._lines[n]]) for n, name in enumerate(names)]
        self.figure.title.text = plot.title[0].upper() + plot.title[1:] + ("" if names else ": none yet")
        self._legend.visible = len(names) > 1
        self._es.visible = es_frame is not None
        self._es.location = float(time[es_frame or 0])

    def _fit(self, time: Floats, curves: list[Floats]) -> None:
        """Axes about the curves; they stay while the cursor moves, which spares the browser work."""
        values = np.concatenate([*curves, [0.0]])
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        margin = 0.06 * (high - low) or 1.0
        self.figure.y_range.update(start=low - margin, end=high + margin)
        self.figure.x_range.update(start=float(time[0]), end=float(time[-1]) if len(time) > 1 else float(time[0]) + 1)
