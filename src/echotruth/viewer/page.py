"""The page of the viewer: what can be chosen, the pictures, the curves, and what is known of the case."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from html import escape
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.layouts import column, row
from bokeh.models import CheckboxButtonGroup, ColumnDataSource, Div, Range1d, Select, Slider, Toggle
from numpy.typing import NDArray

from echotruth.report import style
from echotruth.repository import estimates
from echotruth.repository.reader import Repository
from echotruth.viewer import curves, facts, script
from echotruth.viewer.choice import NOTHING, TRUTH, Choice, inputs
from echotruth.viewer.clip import PARTS, Clip
from echotruth.viewer.graph import Graph
from echotruth.viewer.panel import PATHS, Panel
from echotruth.viewer.paths import paths
from echotruth.viewer.points import Points
from echotruth.viewer.tint import component_name, components, tint

KEPT_CLIPS = 3
"""Clips that stay in memory."""
RATES = ("5", "10", "20", "40")
"""Frames per second."""
MARGIN = 1.3
"""Half of the side of what is shown of a picture, over half of that of the wall in it."""


class Page:
    """What one person sees.

    Parameters
    ----------
    repository : Repository
    choice : Choice
        What is shown at first.
    unknown : str
        What was asked for and is not there, which is said until something else is chosen.
    document : Document
    """

    def __init__(self, repository: Repository, choice: Choice, unknown: str, document: Document) -> None:
        self.repository, self.choice, self.unknown, self.document = repository, choice, unknown, document
        self.points = lru_cache(KEPT_CLIPS)(lambda case, view, size: Points(Clip(repository, case, view, size)))
        self._shown: dict[str, Any] = {}
        self._problems: dict[str, None] = {}
        self.clip = ColumnDataSource({"grey": [np.zeros((0, 0, 0), np.uint8)]}, name="clip")
        self.times = ColumnDataSource({"time": [0.0], "text": [""]}, name="times")
        self.address = ColumnDataSource({"query": [""]})
        frames = repository.config.loop.frames
        self.frame = Slider(start=0, end=frames - 1, value=choice.frame or 0, title="Frame", name="frame")
        self.frame.update(sizing_mode="stretch_width", max_width=380)
        self.side = Slider(start=0, end=1e6, value=1, visible=False)
        self.opacity = Slider(start=0, end=1, step=0.05, value=style.OPACITY, title="Opacity", width=110)
        ranges = Range1d(-1, 1), Range1d(2, 0)
        self.pointer, sliders = Div(name="pointer", height=20), (self.frame, self.side)
        self.panels = [Panel(self.clip, sliders, ranges, self.pointer, name) for name in ("first", "second")]
        self.colours = {name: style.series_colour(number) for number, name in enumerate(repository.trackers)}
        self.graphs = {name: Graph(name, self.colours) for name in ("strain", "rotation", "volume")}
        self._widgets()
        self._scripts()
        document.add_root(self._layout())
        document.title = f"{repository.config.name} - echotruth"
        # Sent as a change, arrays travel as they are; within the page at first they would be text.
        document.on_event("document_ready", lambda _event: self._begin())

    def _widgets(self) -> None:
        """What can be chosen."""
        self.inputs = inputs(self.repository, self.choice)
        for name, widget in self.inputs.items():
            widget.name = name
            widget.on_change("value", lambda _attribute, _old, value, name=name: self._choose(name, value))
        self.paths = CheckboxButtonGroup(labels=[f"{kind} paths" for kind in PATHS], active=[0, 1], name="paths")
        self.paths.on_change("active", lambda _attribute, _old, _active: self.show())
        self.play = Toggle(label="▶ Play", width=90, name="play", button_type="primary")
        self.rate = Select(title="", value="20", options=[(rate, f"{rate} frames/s") for rate in RATES], width=125)
        self.message = Div(name="message", visible=False, styles={"color": "#a33", "font-weight": "bold"})
        self.facts = Div(name="facts", sizing_mode="stretch_width")

    def _scripts(self) -> None:
        """What happens in the browser alone."""
        positions = [panel.positions[kind] for panel in self.panels for kind in PATHS]
        draw = script.callback(
            "draw",
            slider=self.frame,
            opacity=self.opacity,
            clip=self.clip,
            times=self.times,
            colours=[panel.colour for panel in self.panels],
            palettes=[panel.palette for panel in self.panels],
            pictures=[panel.picture for panel in self.panels],
            labels=[panel.label for panel in self.panels],
            figures=[panel.figure for panel in self.panels],
            positions=positions,
            paths=[panel.paths[kind] for panel in self.panels for kind in PATHS],
            cursors=[graph.cursor for graph in self.graphs.values()],
        )
        for slider in (self.frame, self.opacity):
            slider.js_on_change("value", draw)
        for source in (self.clip, self.times, *(panel.colour for panel in self.panels), *positions):
            source.js_on_change("data", draw)
        for panel in self.panels:
            panel.figure.js_on_change("visible", draw)
        play = script.callback("play", button=self.play, slider=self.frame, rate=self.rate)
        self.play.js_on_change("active", play)
        self.rate.js_on_change("value", play)
        address = script.callback("address", address=self.address, slider=self.frame, button=self.play)
        self.address.js_on_change("data", address)
        self.play.js_on_change("active", address)
        self.frame.js_on_change("value_throttled", address)
        figures, graphs = ([one.figure for one in shown] for shown in (self.panels, self.graphs.values()))
        fit = script.callback("fit", figures=figures, graphs=graphs, facts=self.facts)
        self.document.js_on_event("document_ready", fit)

    def _layout(self) -> Any:
        chosen = self.inputs
        apart = {"flex-wrap": "wrap", "gap": "4px"}
        switches = column(Div(text="Motion", margin=(5, 5, 0, 5)), self.paths)
        clip = row(*(chosen[name] for name in ("case", "view", "size", "tracker", "other")), styles=apart)
        for widget in clip.children:  # narrower where the window is
            widget.styles = {"flex": f"1 1 {0.7 * widget.width:.0f}px", "max-width": f"{widget.width}px"}
        drawn = row(chosen["colour"], chosen["component"], self.opacity, switches, styles=apart)
        pictures = row(*(panel.figure for panel in self.panels), styles=apart)
        player = row(self.play, self.frame, self.rate, sizing_mode="stretch_width", styles={"align-items": "center"})
        plots = row(*(chosen[name] for name in ("curve", "measure", "part")), styles=apart)
        graphs = [graph.figure for graph in self.graphs.values()]
        left = column(pictures, self.pointer, player, self.side, self.facts, styles={"max-width": "100%"})
        right = column(plots, *graphs, styles={"flex": "1 1 450px", "min-width": "min(450px, 100%)"})
        body = row(left, right, sizing_mode="stretch_width", styles=apart)
        return column(clip, drawn, self.message, body, sizing_mode="stretch_width", styles={"padding": "8px"})

    def _choose(self, name: str, value: str) -> None:
        """Take over what was chosen, and show it."""
        chosen = int(value) if name == "size" else value
        if chosen == getattr(self.choice, name):  # the page set it itself
            return
        if name == "case" and value not in self.repository.rows:
            self._say(f"There is no case {value}: choose one from the list.")
            return
        self.choice = replace(self.choice, **{name: chosen})  # type: ignore[arg-type]  # each has its type
        self.unknown = ""
        self._say("Reading ...")
        self.document.add_next_tick_callback(self.show)

    def _begin(self) -> None:
        """Show what was asked for, and play it unless a frame was."""
        self.show()
        self.play.active = self.choice.frame is None

    def show(self) -> None:
        """Show what is chosen; what is shown already stays."""
        self.document.hold("combine")  # so that the browser draws once
        try:
            self._show()
        except Exception as error:  # a damaged file fails in many ways, and the page must go on
            self._blank()
            place = f"{self.choice.case}, {self.choice.view}"
            said = str(error).partition("\n")[0] or type(error).__name__
            self._say(f"{place} cannot be shown: {said}. Run: echotruth check {self.repository.location}")
        finally:
            self.document.unhold()

    def _show(self) -> None:
        choice = self.choice
        points = self.points(choice.case, choice.view, choice.size)
        clip, self._problems = points.clip, dict.fromkeys([self.unknown] if self.unknown else [])
        self._fit(clip)
        place = (choice.case, choice.view, choice.size)
        self._once("clip", place, lambda: self._show_clip(points))
        for number, tracker in enumerate((choice.tracker, choice.other)):
            self._show_panel(number, points, tracker)
        found = self._once("found", (*place, choice.tracker, choice.other), lambda: self._curves(clip))
        self._show_graphs(clip, found)
        self.facts.text = facts.text(clip, [choice.tracker, choice.other])
        if lacking := ", ".join(name for part, name in PARTS.items() if part not in clip.parts):
            said = f"Not made for this case and view: {lacking}. The run is not finished, or the heart not complete."
            self._problems[said] = None
        self._say(" ".join(self._problems))
        self.address.data = {"query": [self.choice.address]}

    def _blank(self) -> None:
        """Show nothing, rather than what was chosen before."""
        self._shown.clear()
        self.clip.data = {"grey": [np.zeros_like(self.clip.data["grey"][0])]}
        for panel in self.panels:
            panel.clear()
        for graph in self.graphs.values():
            graph.show(curves.Plot("no curves", {}), np.array([0.0, 1.0]), None)
        self.facts.text = ""

    def _once(self, part: str, key: Any, make: Callable[[], Any]) -> Any:
        """What is made for a key, made again only if the key is another."""
        if self._shown.get(part, (None,))[0] != key:
            self._shown[part] = key, make()
        return self._shown[part][1]

    def _show_clip(self, points: Points) -> None:
        """Grey levels and times, and the pictures about the wall; the tool of the picture resets them to the whole."""
        clip, side = points.clip, 1e3 * points.clip.side
        self.side.value = side
        for panel in self.panels:
            panel.size(clip.size, side)
        shown = self.panels[0].figure
        for axis, start, end in ((shown.x_range, -side / 2, side / 2), (shown.y_range, side, 0)):
            axis.update(start=start, end=end, reset_start=start, reset_end=end)
        if "tracking" in clip.parts:
            lateral, axial, half = (1e3 * value for value in points.extent)
            half = min(MARGIN * half, side / 2)
            lateral = min(max(lateral, half - side / 2), side / 2 - half)
            axial = min(max(axial, half), side - half)
            shown.x_range.update(start=lateral - half, end=lateral + half)
            shown.y_range.update(start=axial + half, end=axial - half)
        black = np.zeros((clip.frames, clip.size, clip.size), np.uint8)
        self.clip.data = {"grey": [clip.image if "bmode" in clip.parts else black]}
        time = 1e3 * clip.time
        self.times.data = {"time": time, "text": [f"{value:.1f} ms" for value in time]}

    def _show_panel(self, number: int, points: Points, tracker: str) -> None:
        """Colours and paths of one picture."""
        choice, panel = self.choice, self.panels[number]
        panel.figure.visible = tracker != NOTHING or number == 0
        if not panel.figure.visible:
            return
        followed = None if tracker in (TRUTH, NOTHING) else tracker
        panel.follow(self.colours.get(tracker, style.SERIES[0]))
        panel.figure.title.text = "Truth" if tracker == TRUTH else tracker or "no tracker"
        place = (choice.case, choice.view, choice.size, tracker)
        try:
            colour = (choice.colour, choice.component)
            self._once(
                f"colour {number}", (*place, *colour), lambda: panel.tint(tint(points.clip, points, *colour, followed))
            )
            wanted = [kind for index, kind in enumerate(PATHS) if index in self.paths.active]
            self._once(f"paths {number}", (*place, *wanted), lambda: _draw_paths(panel, points, followed, wanted))
        except ValueError as error:  # a tracker from outside that was not evaluated on this clip
            self._problems[str(error)] = None
            panel.clear()
            for part in ("colour", "paths"):
                self._shown.pop(f"{part} {number}", None)

    def _curves(self, clip: Clip) -> dict[str, Any]:
        """Tracker -> curves, of those that have any."""
        found = {}
        for tracker in (self.choice.tracker, self.choice.other) if "tracking" in clip.parts else ():
            with suppress(ValueError):  # not evaluated on this clip, which the picture says
                if tracker not in (TRUTH, NOTHING):
                    found[tracker] = self.repository.curves(clip.case, clip.view, tracker, clip.size)
        return found

    def _show_graphs(self, clip: Clip, found: dict[str, Any]) -> None:
        choice = self.choice
        segments = curves.segments(next(iter(found.values()))) if found else []
        parts = curves.parts(clip, choice.curve, segments)
        if choice.part not in parts:
            self.choice = choice = replace(choice, part=parts[0])
        names = [(kind, curves.strain_name(clip, kind)) for kind in (curves.LINE, "TT", "RR", "RT")]
        self.inputs["curve"].update(options=names, value=choice.curve)
        self.inputs["part"].update(options=parts, value=choice.part)
        self.inputs["measure"].visible = choice.curve != curves.LINE
        plots = {
            "strain": curves.strain(clip, found, choice.curve, choice.measure, choice.part),
            "rotation": curves.rotation(clip, found),
            "volume": curves.volume(clip),
        }
        for tracker in found:
            failure = estimates.failures(self.repository, clip.case, clip.view).get((tracker, clip.size), "")
            if why := curves.no_estimate(clip, plots["strain"], tracker, failure):
                self._problems[f"{tracker} has no estimate of this strain: {why}."] = None
        for name, plot in plots.items():
            self.graphs[name].show(plot, 1e3 * clip.time, clip.es_frame)

    def _fit(self, clip: Clip) -> None:
        """Offer the components that the colour has, in the words of the view."""
        known = components(self.choice.colour)
        if self.choice.component not in known:
            along = "LL" if "LL" in known and not clip.is_short_axis else known[1] if known else ""
            self.choice = replace(self.choice, component=along)
        names = [(name, component_name(name, clip)) for name in known]
        self.inputs["component"].update(options=names, value=self.choice.component, visible=bool(known))

    def _say(self, text: str) -> None:
        self.message.text = escape(text)
        self.message.visible = bool(text)


def _draw_paths(panel: Panel, points: Points, tracker: str | None, wanted: list[str]) -> None:
    """Draw the paths that are wanted, if what they are made of is written."""
    drawn = dict[str, NDArray[np.float32]]()
    if "tracking" in points.clip.parts:
        if "true" in wanted:
            drawn["true"] = paths(points, points.true_displacement)
        if tracker and "tracked" in wanted:
            drawn["tracked"] = paths(points, points.tracked_displacement(tracker))
    for kind in PATHS:
        panel.draw(kind, drawn.get(kind))
