import numpy as np
import pytest
from mpl_toolkits.mplot3d import proj3d
from PIL import Image

from echotruth.config import Geometry
from echotruth.mechanics.geometry import left_ventricle
from echotruth.report import heart, style


@pytest.mark.slow
def test_heart_is_drawn(tmp_path):
    mesh = left_ventricle(Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1))
    count = len(mesh.cells)
    fibre, strain = np.tile([1.0, 0.2, 0.1], (count, 1)), np.full((count, 6), -0.2)
    figure = heart.draw(mesh.cells, np.stack([mesh.nodes, mesh.nodes]), fibre, np.zeros(count), strain)
    path = style.save(figure, tmp_path / "heart.png")
    picture = np.asarray(Image.open(path).convert("RGB"))
    blue = picture[..., 2].astype(int) - picture[..., 0] > 60
    assert blue.mean() > 0.05, "shortening is blue"
    assert 0.1 < (picture.min(-1) < 240).mean() < 0.9


def test_apex_is_up_and_the_septum_on_the_left():
    figure = style.figure(4, 4)
    panel = figure.add_subplot(projection="3d")
    heart.show([panel], np.array([[-3e-3, -3e-3, -8e-3], [3e-3, 3e-3, 0]]))
    figure.canvas.draw()

    def on_page(point):
        x, y, _ = proj3d.proj_transform(*point, panel.get_proj())
        return panel.transData.transform((x, y))

    apex, base, septum, free_wall = map(on_page, ((0, 0, -8), (0, 0, 0), (3, 0, -4), (-3, 0, -4)))
    assert apex[1] > base[1] + 50 and septum[0] < free_wall[0] - 50
