"""The wall that was drawn: its pixels, depth, directions and AHA segments, and what is refused."""

import numpy as np
import pytest
from contracting_ring import CENTRE, ENDO, EPI, SIDE
from PIL import Image

import echotruth as et
from echotruth.echo.failure import EchoError


def at(angles_deg, radius=48.0):
    angle = np.radians(angles_deg)
    return CENTRE + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def test_ring_has_its_area_thickness_depth_and_directions(ring):
    wall = ring.wall()
    assert wall.mask((SIDE, SIDE)).sum() == pytest.approx(np.pi * (EPI**2 - ENDO**2), rel=0.01)
    assert wall.thickness() == pytest.approx(EPI - ENDO, rel=0.01)
    angles = np.arange(0, 360, 7)
    depth, normal = wall.depth(at(angles, ENDO + 0.25 * (EPI - ENDO)))
    np.testing.assert_allclose(depth, 0.25, atol=0.02)
    np.testing.assert_allclose(normal, at(angles, 1.0) - CENTRE, atol=0.05)


def test_segments_follow_the_insertions(ring):
    """Insertions at the left, above and below: the septum is the left third, and the numbers run from its top down."""
    wall = ring.wall("mid")
    assert wall.segment(at([210, 150, 90, 30, -30, -90])).tolist() == [8, 9, 10, 11, 12, 7]
    assert ring.wall("basal").segment(at([210, 150])).tolist() == [2, 3]
    assert ring.wall("apical").segment(at([180, 80, 0, -80])).tolist() == [14, 15, 16, 13]
    assert not ring.wall("short_axis").segment(at([210, 30])).any()


def test_mirrored_insertions_turn_the_numbers_round(ring):
    wall = ring.wall("mid")
    mirrored = et.Wall(wall.endocardium, wall.epicardium, "mid", wall.insertions[::-1])
    assert mirrored.segment(at([150, 210, -90, 90])).tolist() == [8, 9, 10, 7]


def arch(width, height):
    """From the base, by way of the apex at the top of the image, to the base."""
    angle = np.linspace(np.pi, 2 * np.pi, 50)
    return np.column_stack([80 + width * np.cos(angle), 120 + height * np.sin(angle)])


@pytest.mark.parametrize("reverse", [False, True])
def test_apical_view_has_six_segments_from_left_to_right(reverse):
    endo, epi = arch(30, 80), arch(42, 92)
    wall = et.Wall(endo[::-1] if reverse else endo, epi, "four_chamber")
    area = np.pi / 2 * (42 * 92 - 30 * 80)
    assert wall.mask((160, 160)).sum() == pytest.approx(area, rel=0.03)
    places = arch(36, 86)[[2, 9, 18, 31, 40, 47]]
    assert wall.segment(places).tolist() == [3, 9, 14, 16, 12, 6]
    assert et.Wall(endo, epi, "two_chamber").segment(places).tolist() == [4, 10, 15, 13, 7, 1]


def test_table_and_mask_give_the_same_wall(ring, tmp_path):
    wall = ring.wall()
    lines = ["part,lateral_px,axial_px"]
    lines += [f"endocardium,{x},{y}" for x, y in wall.endocardium] + [f"epicardium,{x},{y}" for x, y in wall.epicardium]
    names = ("anterior_insertion", "inferior_insertion")
    lines += [f"{name},{x},{y}" for name, (x, y) in zip(names, wall.insertions, strict=True)]
    (tmp_path / "wall.csv").write_text("\n".join(lines))
    read = et.read_wall(tmp_path / "wall.csv", "mid")
    np.testing.assert_array_equal(read.mask((SIDE, SIDE)), wall.mask((SIDE, SIDE)))
    np.testing.assert_allclose(read.insertions, wall.insertions)
    Image.fromarray(wall.mask((SIDE, SIDE)).astype(np.uint8) * 255).save(tmp_path / "ring.png")
    traced = et.read_wall(tmp_path / "ring.png", "short_axis")
    apart = traced.mask((SIDE, SIDE)) ^ wall.mask((SIDE, SIDE))
    assert apart.sum() < 0.02 * wall.mask((SIDE, SIDE)).sum()
    for line, radius in zip(traced.contours(), (ENDO, (ENDO + EPI) / 2, EPI), strict=True):
        length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
        assert length == pytest.approx(2 * np.pi * radius, rel=0.01)  # not along the edges of pixels


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "is no table that can be read"),
        ("a,b\n1,2", "has no column part"),
        ("part,lateral_px,axial_px\nendo,1,2", "part = endo: use endocardium"),
        ("part,lateral_px,axial_px\nendocardium,1,x", "row 1 has no two numbers"),
        ("part,lateral_px,axial_px\nendocardium,1,2", "endocardium: give three points or more"),
        ("part,lateral_px,axial_px\nanterior_insertion,1,2", "give one anterior and one inferior insertion, or none"),
    ],
)
def test_bad_table_is_told(tmp_path, text, sentence):
    path = tmp_path / "wall.csv"
    path.write_text(text)
    with pytest.raises(EchoError, match=f"wall.csv: {sentence}"):
        et.read_wall(path, "mid")


def test_mask_that_is_no_ring_is_told(tmp_path):
    np.save(tmp_path / "disc.npy", np.ones((20, 20), bool))
    with pytest.raises(EchoError, match=r"disc.npy: the mask is no closed ring"):
        et.read_wall(tmp_path / "disc.npy", "mid")


def test_impossible_walls_are_told(ring):
    wall = ring.wall()
    with pytest.raises(EchoError, match="the endocardium is not inside the epicardium"):
        et.Wall(wall.epicardium, wall.endocardium).mask((SIDE, SIDE))
    with pytest.raises(EchoError, match="enclose no pixel"):
        et.Wall(wall.endocardium + 500, wall.epicardium + 500).mask((SIDE, SIDE))
    with pytest.raises(EchoError, match="view = 'middle': use one of basal"):
        et.Wall(wall.endocardium, wall.epicardium, "middle")
