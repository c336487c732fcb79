import numpy as np
import pytest

from echotruth.tracking.similarity import even_contrast, similarity

SIZE, SHIFT = 64, np.array([1.5, -0.7])


@pytest.fixture
def frames(speckle):
    return np.stack([speckle(SIZE, lambda place, t=t: place + t * SHIFT) for t in range(4)])


def places(step):
    """Of points of the middle that move by a step in each frame."""
    first = np.argwhere(np.ones((24, 24)))[:, ::-1] + 20.0
    return first + np.arange(4)[:, None, None] * step


def test_images_are_most_alike_along_the_true_motion(frames):
    images = even_contrast(frames, 24)
    found = [similarity(images, places(SHIFT + [0, more])) for more in (-0.5, -0.25, 0, 0.25, 0.5)]
    assert np.argmax(found) == 2 and found[2] > 1.1 * max(found[1], found[3])


def test_it_is_the_logarithm_of_the_correlation_of_pairs():
    """Two frames are compared twice: with each other, and with the first."""
    noise = np.random.default_rng(0).normal(size=(2, SIZE, SIZE))
    images = [noise[0], 0.8 * noise[0] + 0.6 * noise[1]]
    whole = np.argwhere(np.ones((SIZE, SIZE)))[:, ::-1].astype(float)
    r = np.corrcoef(images[0].ravel(), images[1].ravel())[0, 1]
    assert similarity(images, np.stack([whole, whole])) == pytest.approx(-np.log(1 - r))


def test_contrast_is_the_same_in_bright_and_dark_parts(speckle):
    image = speckle(SIZE, lambda place: place).astype(float)
    image[:, SIZE // 2 :] = 100 + 0.3 * image[:, SIZE // 2 :]
    (even,) = even_contrast(image[None], 24)
    left, right = even[:, :24].std(), even[:, -24:].std()
    assert right == pytest.approx(left, rel=0.2)


def test_images_without_texture_are_not_alike():
    assert similarity(even_contrast(np.full((4, SIZE, SIZE), 7, np.uint8), 24), places(SHIFT)) == 0
