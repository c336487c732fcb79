"""Style of figures."""

import pytest
from matplotlib.lines import Line2D

from echotruth.report import style

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
