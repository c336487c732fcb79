"""The shipped cycles, the columns of the prescribed quantities, the sampling, and the errors about invalid files."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from echotruth.config import Loop
from echotruth.loop.cycle import LoopError, read_loop
from echotruth.loop.phases import es_frame

MMHG, UL = 133.322387415, 1e-9
HEAD = "time_ms,pressure_mmHg,volume_uL\n"
GOOD = ["0,4,50", "30,100,40", "60,100,20", "90,5,25", "120,4,50"]


def written(tmp_path, rows, head=HEAD):
    path = tmp_path / "loop.csv"
    path.write_text("# a comment\n" + head + "\n".join(rows) + "\n")
    return Loop(file=str(path), frames=8)


@pytest.mark.parametrize(
    ("name", "period", "pressures", "volumes", "slopes"),
    [
        ("mouse", 0.12, (4, 100, 105), (50, 18), (11_600, -9_800)),
        ("rat", 0.16, (4, 124, 130), (230, 80), (9_700, -7_050)),
        ("human", 0.8, (7, 115, 120), (150_000, 63_000), (1_580, -1_980)),
    ],
)
def test_shipped_loops_have_the_values_at_their_head(name, period, pressures, volumes, slopes):
    loop = read_loop(Loop(file=name, frames=1000))
    slope = np.gradient(loop.pressure, loop.time) / MMHG
    es = es_frame(loop.pressure, loop.volume)
    assert loop.period == pytest.approx(period)
    measured = (loop.pressure[0], loop.pressure[es], loop.pressure.max())
    assert np.array(measured) / MMHG == pytest.approx(pressures, rel=0.01)
    assert np.array([loop.volume[0], loop.volume.min()]) / UL == pytest.approx(volumes, rel=1e-6)
    assert (slope.max(), slope.min()) == pytest.approx(slopes, rel=0.03)


def test_twitch_has_the_volume_of_the_mouse_and_the_tension_solved_for_it():
    twitch, mouse = read_loop(Loop(file="twitch", prescribed="volume")), read_loop(Loop())
    assert twitch.pressure is None
    np.testing.assert_allclose(twitch.volume, mouse.volume, rtol=1e-4)
    pressed = read_loop(Loop(file="twitch", prescribed="pressure"))
    np.testing.assert_allclose(pressed.pressure, mouse.pressure, rtol=1e-3)
    assert twitch.tension[0] == 0
    assert twitch.tension[es_frame(mouse.pressure, mouse.volume)] == pytest.approx(46.9e3, rel=0.01)


def test_volumes_and_heart_rate_are_mapped():
    loop = read_loop(Loop(edv_uL=60.0, esv_uL=24.0, heart_rate_per_min=600.0, frames=400))
    assert (loop.volume[0], loop.volume.min()) == pytest.approx((60 * UL, 24 * UL))
    assert loop.period == pytest.approx(0.1)
    assert loop.time[-1] == pytest.approx(0.1 * 399 / 400)


BEATS = [{}, {"length": 0.8, "stroke": 0.7}, {"length": 1.2, "stroke": 1.1}]


def test_beats_follow_one_another_with_their_lengths_and_strokes():
    one, cycle = read_loop(Loop(frames=300)), read_loop(Loop(frames=900, beats=BEATS))
    assert cycle.starts == (0, 300, 540, 900) and cycle.period == pytest.approx(3 * 0.12)
    np.testing.assert_allclose(np.diff(cycle.time), 0.12 / 300)
    np.testing.assert_allclose(cycle.volume[list(cycle.starts[:-1])], 50 * UL, rtol=1e-12)
    smallest = [cycle.volume[beat].min() / UL for beat in cycle.beats]
    assert smallest == pytest.approx([18, 50 - 0.7 * 32, 50 - 1.1 * 32], rel=1e-3)
    np.testing.assert_allclose([cycle.pressure[beat].max() for beat in cycle.beats], one.pressure.max(), rtol=1e-3)
    np.testing.assert_allclose(cycle.volume[:300], one.volume, rtol=1e-12)
    assert cycle.systole == one.systole and cycle.at(one.systole).beats[0] == slice(0, len(one.systole))
    # Each beat has its end-systole at the same share of its length.
    ends = [es_frame(cycle.pressure[beat], cycle.volume[beat]) for beat in cycle.beats]
    assert np.divide(ends, (1, 0.8, 1.2)) == pytest.approx(len(one.systole) - 1, rel=0.03)


def test_a_stroke_that_empties_the_heart_is_refused():
    with pytest.raises(LoopError, match=r"loop\.beats: a stroke of 2 empties the heart; give less than 1\.56\."):
        read_loop(Loop(beats=[{}, {"stroke": 2.0}]))


def test_sampling_goes_through_the_rows_without_overshoot(tmp_path):
    loop = read_loop(written(tmp_path, GOOD))
    np.testing.assert_allclose(loop.pressure[::2] / MMHG, [4, 100, 100, 5])
    assert loop.pressure.max() / MMHG <= 100 * (1 + 1e-12)
    assert loop.pressure.min() / MMHG >= 4 * (1 - 1e-12)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (["0,4,50", "30,x,40", *GOOD[2:]], "line 4: pressure_mmHg is 'x'; give a finite number"),
        (["0,4,50", "30,100", *GOOD[2:]], "line 4: volume_uL is ''"),
        (GOOD[:3], "there are 3 rows"),
        (["5,4,50", *GOOD[1:]], "row 1: time_ms is 5; begin at 0"),
        (["0,4,50", "30,100,40", "30,100,20", *GOOD[3:]], "row 3: time_ms is 30 and must increase"),
        (["0,4,50", "30,-1,40", *GOOD[2:]], "row 2: pressure_mmHg is -1 and must be positive"),
        ([*GOOD[:4], "120,9,50"], "pressure_mmHg begins at 4 and ends at 9"),
        (["0,4,50", "30,100,50", "60,100,50", "90,5,50", "120,4,50"], "must not be flat"),
        (["0,4,30", "30,100,50", "60,100,20", "90,5,25", "120,4,30"], "begin the loop at end-diastole"),
    ],
)
def test_an_invalid_loop_is_refused_in_one_sentence(tmp_path, rows, message):
    with pytest.raises(LoopError) as caught:
        read_loop(written(tmp_path, rows))
    assert message in str(caught.value)
    assert "loop.csv" in str(caught.value)
    assert str(caught.value).endswith(".")


def test_a_loop_is_read_without_pandas_which_a_job_would_load_for_nothing_else():
    code = "import sys, echotruth.config as c, echotruth.loop.cycle as cycle; cycle.read_loop(c.Loop())"
    subprocess.run([sys.executable, "-c", f"{code}; assert 'pandas' not in sys.modules"], check=True)


def test_every_unit_of_the_field_gives_the_same_cycle(tmp_path):
    fine = read_loop(written(tmp_path, GOOD))
    for units, factors in (
        ("time_s,pressure_kPa,volume_mL", (1e-3, MMHG / 1e3, 1e-3)),
        ("time_s,pressure_Pa,volume_m3", (1e-3, MMHG, 1e-9)),
    ):
        rows = [",".join(repr(float(n) * k) for n, k in zip(row.split(","), factors, strict=True)) for row in GOOD]
        same = read_loop(written(tmp_path, rows, head=units + "\n"))
        for name in ("time", "pressure", "volume"):
            np.testing.assert_allclose(getattr(same, name), getattr(fine, name), rtol=1e-12)


TWITCH = ["0,4,0,50", "30,100,40,40", "60,100,45,20", "90,5,1,25", "120,4,0,50"]
ALL = "time_ms,pressure_mmHg,tension_kPa,volume_uL\n"


@pytest.mark.parametrize(
    ("prescribed", "expected"),
    [
        ("pressure_volume", {"pressure", "volume"}),
        ("pressure", {"pressure", "tension"}),
        ("volume", {"volume", "tension"}),
    ],
)
def test_prescribed_quantities_take_their_own_columns_and_leave_the_rest_open(tmp_path, prescribed, expected):
    loop = written(tmp_path, TWITCH, head=ALL).model_copy(update={"prescribed": prescribed})
    cycle = read_loop(loop)
    assert cycle.prescribed == prescribed
    assert {name for name in ("pressure", "volume", "tension") if getattr(cycle, name) is not None} == expected
    if prescribed != "pressure_volume":
        np.testing.assert_allclose(cycle.tension[::2], [0, 40e3, 45e3, 1e3])


def test_without_a_tension_the_volume_drives_a_passive_heart(tmp_path):
    cycle = read_loop(written(tmp_path, GOOD).model_copy(update={"prescribed": "volume"}))
    assert cycle.pressure is None
    np.testing.assert_array_equal(cycle.tension, np.zeros(8))


def test_scaling_keeps_the_ejection_fraction_and_all_else():
    mouse = read_loop(Loop())
    twice = mouse.scaled(2.0)
    np.testing.assert_allclose(twice.volume, 2 * mouse.volume)
    assert twice.pressure is mouse.pressure and twice.time is mouse.time
    assert read_loop(Loop(file="twitch", prescribed="pressure")).scaled(2.0).volume is None


@pytest.mark.parametrize(
    ("prescribed", "head", "row", "message"),
    [
        (
            "pressure_volume",
            "time_ms,pressure_mmHg,volume_fl_oz",
            "0,4,50",
            "no column of the volume, which loop.prescribed = press",
        ),
        (
            "pressure",
            "time_ms,pressure_mmHg,volume_uL",
            "0,4,50",
            "loop.prescribed = pressure needs; add one and name it tension_",
        ),
        ("volume", "time_ms,pressure_mmHg", "0,4", "name it volume_uL or volume_mL or volume_m3"),
        ("volume", "time_ms,time_s,volume_uL", "0,0,50", "time_ms and time_s both give the time; keep one of them"),
    ],
)
def test_missing_column_and_one_given_twice_are_named(tmp_path, prescribed, head, row, message):
    with pytest.raises(LoopError) as caught:
        read_loop(written(tmp_path, [row] * 5, head=head + "\n").model_copy(update={"prescribed": prescribed}))
    assert message in str(caught.value)
    assert str(caught.value).endswith(".") and "loop.csv" in str(caught.value)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (["0,4,0,50", "30,100,-1,40", *TWITCH[2:]], "row 2: tension_kPa is -1 and must not be negative"),
        (["0,4,9,50", *TWITCH[1:-1], "120,4,9,50"], "the first row has tension_kPa 9 of 1 to 45; begin"),
        ([*TWITCH[:4], "120,4,9,50"], "tension_kPa begins at 0 and ends at 9"),
    ],
)
def test_tension_that_no_beat_has_is_refused(tmp_path, rows, message):
    with pytest.raises(LoopError) as caught:
        read_loop(written(tmp_path, rows, head=ALL).model_copy(update={"prescribed": "pressure"}))
    assert message in str(caught.value)


def test_missing_file_is_named_with_what_there_is(tmp_path):
    with pytest.raises(LoopError, match=rf"no file {Path('dog').absolute()}; .*\(human, mouse, rat, twitch\)"):
        read_loop(Loop(file="dog"))


def test_volumes_that_do_not_eject_are_refused():
    with pytest.raises(LoopError, match="set edv_uL and esv_uL so that the heart ejects"):
        read_loop(Loop(edv_uL=15.0))


ROWS = [(0.0, 6.0, 50.0), (20.0, 60.0, 50.0), (50.0, 100.0, 20.0), (70.0, 10.0, 20.0), (120.0, 6.0, 50.0)]
"""Time (ms), pressure (mmHg) and volume (uL)."""


def lines(separator, decimal, rows=ROWS):
    return [separator.join(f"{value:.3f}".replace(".", decimal) for value in row) for row in rows]


LABCHART = ["Interval=\t0.001 s", "TimeFormat=\tStartOfBlock", "ChannelTitle=\tLVP\tVolume", "UnitName=\tmmHg\t\u00b5L"]
TEXTS = {
    "semicolons": ["time_ms;pressure_mmHg;volume_uL", *lines(";", ".")],
    "decimal commas": ["Time (ms);LVP [mmHg];LVV (uL)", *lines(";", ",")],
    "tabs": ["t_ms\tPressure_mmHg\tvolume [\u00b5L]", *lines("\t", ",")],
    "LabChart": [*LABCHART, *lines("\t", ".", [(time / 1e3, *others) for time, *others in ROWS])],
}


@pytest.mark.parametrize("name", TEXTS)
def test_columns_as_other_programs_write_them(tmp_path, name):
    (tmp_path / "plain.csv").write_text("\n".join(["time_ms,pressure_mmHg,volume_uL", *lines(",", ".")]))
    (tmp_path / "other.csv").write_text("\n".join(TEXTS[name]), encoding="utf-8")
    expected, found = (read_loop(Loop(file=str(tmp_path / file))) for file in ("plain.csv", "other.csv"))
    assert found.period == pytest.approx(0.12)
    np.testing.assert_allclose(found.pressure, expected.pressure)
    np.testing.assert_allclose(found.volume, expected.volume)


def test_loop_that_begins_elsewhere_is_told_where_end_diastole_is(tmp_path):
    turned = [(0.0, 100.0, 20.0), (30.0, 10.0, 20.0), (70.0, 6.0, 50.0), (90.0, 60.0, 49.0), (120.0, 100.0, 20.0)]
    (tmp_path / "late.csv").write_text("\n".join(["time_ms,pressure_mmHg,volume_uL", *lines(",", ".", turned)]))
    with pytest.raises(LoopError, match=r"begin the loop at end-diastole, .*: row 3 has the largest volume\."):
        read_loop(Loop(file=str(tmp_path / "late.csv")))
