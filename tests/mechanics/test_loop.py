"""The shipped loop, its sampling, and what is said about files that hold none."""

import numpy as np
import pytest

from echotruth.config import Loop
from echotruth.mechanics.loop import LoopError, read_loop

MMHG, UL = 133.322387415, 1e-9
HEAD = "time_ms,pressure_mmHg,volume_uL\n"
GOOD = ["0,4,50", "30,100,40", "60,100,20", "90,5,25", "120,4,50"]


def written(tmp_path, rows, head=HEAD):
    path = tmp_path / "loop.csv"
    path.write_text("# a comment\n" + head + "\n".join(rows) + "\n")
    return Loop(file=str(path), frames=8)


def test_shipped_loop_is_a_mouse():
    loop = read_loop(Loop(frames=1000))
    slope = np.gradient(loop.pressure, loop.time) / MMHG
    assert loop.period == pytest.approx(0.12)
    assert loop.pressure[0] == pytest.approx(4 * MMHG)
    assert loop.volume[0] == pytest.approx(50 * UL)
    assert loop.volume.min() == pytest.approx(18 * UL)
    assert loop.pressure.max() == pytest.approx(105 * MMHG, rel=1e-3)
    assert loop.pressure[loop.es_frame] == pytest.approx(100 * MMHG, rel=0.01)
    assert slope.max() == pytest.approx(10_000, rel=0.03)
    assert slope.min() == pytest.approx(-8_500, rel=0.03)


def test_pressure_relaxes_with_nine_milliseconds():
    loop = read_loop(Loop(frames=1000))
    falling = (loop.time > 0.066) & (loop.time < 0.082)
    rate = np.polyfit(loop.time[falling], np.log(loop.pressure[falling]), 1)[0]
    assert -1 / rate == pytest.approx(9e-3, rel=0.03)


def test_default_frames_reach_from_ed_to_es_in_about_twenty():
    loop = read_loop(Loop())
    assert len(loop.time) == 40
    assert 18 <= loop.es_frame <= 20
    np.testing.assert_allclose(loop.time, np.arange(40) * 3e-3)


def test_isovolumic_phases_keep_their_volume():
    loop = read_loop(Loop())
    np.testing.assert_allclose(loop.volume[:4], 50 * UL, rtol=1e-6)
    np.testing.assert_allclose(loop.volume[20:29], 18 * UL, rtol=1e-6)


def test_volumes_and_heart_rate_are_mapped():
    loop = read_loop(Loop(edv_uL=60.0, esv_uL=24.0, heart_rate_per_min=600.0, frames=400))
    assert (loop.volume[0], loop.volume.min()) == pytest.approx((60 * UL, 24 * UL))
    assert loop.period == pytest.approx(0.1)
    assert loop.time[-1] == pytest.approx(0.1 * 399 / 400)


def test_sampling_goes_through_the_rows_without_overshoot(tmp_path):
    loop = read_loop(written(tmp_path, GOOD))
    np.testing.assert_allclose(loop.pressure[::2] / MMHG, [4, 100, 100, 5])
    assert loop.pressure.max() / MMHG <= 100 * (1 + 1e-12)
    assert loop.pressure.min() / MMHG >= 4 * (1 - 1e-12)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["0,4,50", "30,x,40", *GOOD[2:]], "line 4: pressure_mmHg is 'x'; give a finite number"),
        (["0,4,50", "30,nan,40", *GOOD[2:]], "line 4: pressure_mmHg is 'nan'"),
        (["0,4,50", "30,100", *GOOD[2:]], "line 4: volume_uL is ''"),
        (GOOD[:3], "there are 3 rows"),
        (["5,4,50", *GOOD[1:]], "row 1: time_ms is 5; begin at 0"),
        (["0,4,50", "30,100,40", "30,100,20", *GOOD[3:]], "row 3: time_ms is 30 and must increase"),
        (["0,4,50", "30,-1,40", *GOOD[2:]], "row 2: pressure_mmHg is -1 and must be positive"),
        (["0,4,50", "30,100,0", *GOOD[2:]], "row 2: volume_uL is 0 and must be positive"),
        ([*GOOD[:4], "120,9,50"], "pressure_mmHg begins at 4 and ends at 9"),
        (["0,4,50", "30,100,50", "60,100,50", "90,5,50", "120,4,50"], "must not be flat"),
        (["0,4,30", "30,100,50", "60,100,20", "90,5,25", "120,4,30"], "begin the loop at end-diastole"),
    ],
)
def test_what_is_no_loop_is_refused_in_one_sentence(tmp_path, rows, said):
    with pytest.raises(LoopError) as caught:
        read_loop(written(tmp_path, rows))
    assert said in str(caught.value)
    assert "loop.csv" in str(caught.value)
    assert str(caught.value).endswith(".")


def test_missing_column_and_missing_file_are_named(tmp_path):
    with pytest.raises(LoopError, match="column volume_uL is missing"):
        read_loop(written(tmp_path, GOOD, head="time_ms,pressure_mmHg,volume_ml\n"))
    with pytest.raises(LoopError, match=r"no readable loop of this name; .*\(mouse\)"):
        read_loop(Loop(file="rat"))


def test_volumes_that_do_not_eject_are_refused():
    with pytest.raises(LoopError, match="set edv_uL and esv_uL so that the heart ejects"):
        read_loop(Loop(edv_uL=15.0))
