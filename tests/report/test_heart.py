import numpy as np
import pytest
from PIL import Image

from echotruth.config import Geometry
from echotruth.mechanics.geometry import left_ventricle
from echotruth.report import heart, style
from echotruth.report.raster import Camera, Surface, render


def square(depth, colour):
    """Four points that face the eye, which looks along -y."""
    points = np.array([[-1, depth, -1], [1, depth, -1], [1, depth, 1], [-1, depth, 1]], float)
    return points, np.tile([0.0, 1.0, 0.0], (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]), np.tile(colour, (4, 1))


def test_nearest_surface_is_seen():
    near, far = square(1, [1.0, 0, 0]), square(0, [0, 1.0, 0])
    near[0][:, 0] += 1
    joined = [np.concatenate([a, b]) for a, b in zip(near, far, strict=True)]
    joined[2][2:] += 4
    camera = Camera(np.array([0, 1.0, 0]), np.zeros(3), 2.0, (80, 80))
    image, alpha = render(Surface(*joined), camera)
    # From +y, with z up, +x is on the left.
    np.testing.assert_allclose(image[40, 30], [1, 0, 0])
    np.testing.assert_allclose(image[40, 55], [0, 1, 0])
    assert alpha[40, 75] == 0 and alpha[5, 40] == 0
    assert alpha.sum() == pytest.approx(40 * 60, rel=0.02)


@pytest.mark.slow
def test_heart_with_filling_is_drawn(tmp_path):
    mesh = left_ventricle(Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1))
    count = len(mesh.cells)
    cells = np.concatenate([mesh.cells, np.zeros((3, 10), int)])
    nodes = np.concatenate([mesh.nodes, np.full((2, 3), np.nan)])
    fibre = np.tile([1.0, 0.2, 0.1], (count + 3, 1))
    states = [heart.State(name, nodes, fibre, np.linspace(-0.2, 0.1, count + 3)) for name in ("ED", "ES")]
    path = style.save(heart.draw(cells, np.zeros(count + 3), states), tmp_path / "heart.png")
    picture = np.asarray(Image.open(path).convert("RGB"))
    assert 0.1 < (picture.min(-1) < 240).mean() < 0.9
