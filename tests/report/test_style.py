"""Style of figures."""

import re
from collections import Counter
from pathlib import Path

import pytest
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D

import echotruth
from echotruth.report import palette, style

TRACKERS = ("as_published", "corrected", "window_deformation", "affine_dic", "dis", "dis_fine", "bspline_dic")


@pytest.mark.parametrize(
    ("width", "number", "columns"), [(12.0, 7, 7), (6.5, 7, 4), (5.0, 7, 3), (5.0, 3, 3), (1.0, 3, 1)]
)
def test_legend_has_as_few_rows_as_fit_beside_each_other(width, number, columns):
    @style.styled
    def drawn():
        figure = style.figure(width, 3.0)
        figure.subplots()
        return figure, style.legend_below(figure, [Line2D([], [], label=name) for name in TRACKERS[:number]])

    figure, legend = drawn()
    figure.canvas.draw()
    assert [text.get_text() for text in legend.get_texts()] == list(TRACKERS[:number]) and len(figure.legends) == 1
    assert legend._ncols == columns
    if columns > 1:
        assert legend.get_window_extent().x0 >= 0 and legend.get_window_extent().x1 <= figure.bbox.width


def test_colours_of_quantities_are_their_own():
    """Strain of a contour has the colour of that of the tissue; what is solved and true is in ink."""
    of = {name: quantity.colour for name, quantity in style.QUANTITIES.items() if name not in ("GCS", "GLS")}
    shared = {colour for colour, count in Counter(of.values()).items() if count > 1}
    assert shared <= {style.INK}
    assert not set(of.values()) & set(style.SERIES)
    assert style.QUANTITIES["GCS"].colour == of["CC"] and style.QUANTITIES["GLS"].colour == of["LL"]
    over_images = (style.MOTION, style.FLOW, style.BORDER, *style.SERIES)
    assert len(set(over_images)) == len(over_images)


def test_shortening_is_blue_and_zero_is_white():
    low, zero, high = (colormaps[style.SIGNED](place) for place in (0.1, 0.5, 0.9))
    assert low[2] > 2 * low[0] and high[0] > 2 * high[2] and min(zero[:3]) > 0.95


def test_no_other_module_of_the_package_names_a_colour_of_a_quantity():
    """Not as a number, so that it cannot differ."""
    named = {quantity.colour for quantity in style.QUANTITIES.values()} - {style.INK}
    named |= {style.MOTION, style.FLOW, style.BORDER, *style.SERIES}
    named |= {to_hex(colour) for colour in style.layer_colours(3)}
    sources = [path for path in Path(echotruth.__file__).parent.rglob("*") if path.suffix in (".py", ".js", ".jinja")]
    found = {
        path.name: sorted(colours)
        for path in sources
        if path not in (Path(style.__file__), Path(palette.__file__))
        and (colours := named & set(re.findall(r"#[0-9a-f]{6}\b", path.read_text(encoding="utf-8").lower())))
    }
    assert found == {}


@pytest.mark.parametrize(("largest", "unit", "shown"), [(50e-9, "µL", 50.0), (1.5e-4, "mL", 150.0)])
def test_volume_has_the_unit_of_its_size(largest, unit, shown):
    quantity = style.volume(largest)
    assert quantity.unit == unit and quantity.factor * largest == pytest.approx(shown)


def test_symbols_have_their_index_as_one():
    assert style.QUANTITIES["CC"].tex == "$E_{CC}$" and style.QUANTITIES["GCS"].tex == "GCS"
    assert style.QUANTITIES["CC"].plain == "Circumferential strain E_CC (%)"
