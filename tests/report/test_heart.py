import numpy as np
import pytest
from PIL import Image

from echotruth.config import Geometry
from echotruth.mechanics.geometry import left_ventricle
from echotruth.report import heart, style


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
