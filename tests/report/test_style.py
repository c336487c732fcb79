"""Style of figures."""

import re
from pathlib import Path

import pytest
from matplotlib import colormaps
from matplotlib.colors import to_hex

import echotruth
from echotruth.report import palette, style


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
