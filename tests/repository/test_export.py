"""Files of other toolboxes: read back by them, and laid out as they print it."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy.ndimage import map_coordinates

from echotruth.cases import Case
from echotruth.config.building import configure
from echotruth.echo import echoxflow
from echotruth.extras import installation
from echotruth.imaging.beamforming.scan import Sector
from echotruth.imaging.bmode import clip_gain, largest_clip, pixel_centres
from echotruth.repository.reader import Repository
from echotruth.sharing.export import Export, ExportError
from echotruth.sharing.export.echoxflow import _levels as beamspace_levels

pytestmark = pytest.mark.slow

ELEMENTS, FRAMES, SPEED = 24, 2, 1540.0


@pytest.fixture(scope="module")
def folder(rf_repository):
    return rf_repository()


@pytest.fixture(scope="module")
def rf(folder):
    with xr.open_zarr(folder / "small.zarr", group="clips/heart/mid/rf", consolidated=False) as group:
        return group.load()


def export(folder, name, case, view, output=None):
    work = Export(Repository(folder), name, cases=[case], views=[view], output=output)
    (file,) = work.write(work.clips()[0])  # with the table of a format, which is written last
    return file


def written(folder, name):
    pytest.importorskip("h5py")
    return export(folder, name, "heart", "mid")


def echoes(rf):
    """Frame, transmitter, receiver, sample."""
    return rf.channels.values * rf.channels_step.values[:, None, None, None]


def brightest(rf):
    """Line of the brightest sample of the first frame, and its range, m."""
    line, sample = np.unravel_index(np.abs(rf.lines[0].values).argmax(), rf.lines[0].shape)
    return line, rf.range.values[sample]


def places_about(rf):
    """Points (lateral, axial), m, at the `OFFSETS` of range about the brightest sample."""
    line, along = brightest(rf)
    return [(along + off) * np.array([np.sin(rf.line_angle[line]), np.cos(rf.line_angle[line])]) for off in OFFSETS]


def compounded(channels, element, source, delay, place):
    """Delay and sum at a point (lateral, axial) of channels (samples, receivers, waves), as the toolbox counts time."""
    spectra = np.fft.rfft(channels, axis=0)[1:-1] * 2 / len(channels)
    cycles = np.fft.rfftfreq(len(channels))[1:-1]
    out = np.hypot(place[0] - source[:, 0], place[1] - source[:, 1]) + np.linalg.norm(source, axis=1)
    back = np.hypot(place[0] - element, place[1])
    time = (out / SPEED - delay)[None, :] + (back / SPEED)[:, None]
    return abs((spectra * np.exp(2j * np.pi * cycles[:, None, None] * 100e6 * time)).sum())


def test_uff_is_read_by_its_own_library(folder, rf):
    pyuff = pytest.importorskip("pyuff_ustb")
    data = pyuff.Uff(str(written(folder, "uff"))).read("channel_data")
    assert (data.N_elements, data.N_waves, data.N_frames) == (ELEMENTS, ELEMENTS, FRAMES)
    assert (float(data.sound_speed), float(data.initial_time), float(data.modulation_frequency)) == (SPEED, 0, 0)
    assert float(data.sampling_frequency) == rf.attrs["sampling_frequency"]
    assert data.wavelength == pytest.approx(SPEED / 25e6)
    np.testing.assert_allclose(data.probe.x, rf.element)
    np.testing.assert_allclose(data.probe.width, 41e-6)
    found = np.transpose(data.data, (3, 2, 1, 0))  # samples, receivers, waves, frames
    np.testing.assert_allclose(found, echoes(rf), rtol=1e-5, atol=1e-5 * np.abs(found).max())
    for wave, lateral in zip(data.sequence, rf.element.values, strict=True):
        assert (wave.source.x, wave.source.z) == (pytest.approx(lateral), pytest.approx(0, abs=1e-12))
        assert wave.wavefront == pyuff.Wavefront.spherical


@pytest.mark.slow
def test_waves_of_the_uff_focus_where_the_lines_do(folder, rf):
    """The brightest sample of the lines is the brightest near it when the toolbox's rule of time focuses the file."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(written(folder, "uff")) as file:
        data = file["channel_data"]
        waves = data["sequence"].values()
        distance, azimuth = (np.array([wave[f"source/{key}"][()] for wave in waves]) for key in ("distance", "azimuth"))
        delay = np.array([wave["delay"][()] for wave in waves])
        channels, element = data["data"][0].T, data["probe/geometry"][0]
    source = np.column_stack([distance * np.sin(azimuth), distance * np.cos(azimuth)])
    levels = [compounded(channels, element, source, delay, place) for place in places_about(rf)]
    assert abs(OFFSETS[int(np.argmax(levels))]) < 20e-6


OFFSETS = np.arange(-300, 301, 10) * 1e-6
"""Ranges about the brightest sample, m: some three lengths of the pulse on each side."""


def test_lines_of_the_uff_are_those_of_the_repository_at_their_places(folder, rf):
    pyuff = pytest.importorskip("pyuff_ustb")
    data = pyuff.Uff(str(written(folder, "uff"))).read("beamformed_data")
    found = data.data.reshape(FRAMES, rf.sizes["line"], rf.sizes["range"])
    np.testing.assert_array_equal(found, rf.lines)
    line, along = brightest(rf)
    pixel = np.abs(data.data[0]).argmax()
    assert np.hypot(data.scan.x, data.scan.z)[pixel] == pytest.approx(along)
    assert np.arctan2(data.scan.x, data.scan.z)[pixel] == pytest.approx(float(rf.line_angle[line]))
    np.testing.assert_allclose(data.scan.depth_axis, rf.range)
    np.testing.assert_allclose(data.scan.azimuth_axis, rf.line_angle)


def times(folder):
    """Times of the frames, s."""
    return Repository(folder).read("mechanics/time", "heart")


def test_zea_is_read_by_its_own_library(folder, rf):
    zea = pytest.importorskip("zea")
    with zea.File(written(folder, "zea")) as file:
        spec = file.validate_spec()  # all fields, their types and shapes
        lines = file.data.beamformed_data.values[:]
        np.testing.assert_array_equal(lines[..., 0] + 1j * lines[..., 1], rf.lines.transpose("frame", "range", "line"))
        np.testing.assert_allclose(spec.data.beamformed_data.timestamps, times(folder), rtol=1e-6)
        np.testing.assert_allclose(file.data.raw_data[0, :, :, :, 0], echoes(rf)[0].transpose(0, 2, 1), rtol=1e-5)
        parameters = file.load_parameters()
    assert (parameters.n_tx, parameters.n_el) == (ELEMENTS, ELEMENTS)
    assert float(parameters.sound_speed) == SPEED
    np.testing.assert_allclose(parameters.probe_geometry[:, 0], rf.element, rtol=1e-6)


def compounded_by_zea(file, place):
    """Delay and sum of the first frame at a point (lateral, axial), as zea's `calculate_delays` counts time.

    The way out is the shortest over the elements that send, less the initial time, and more by 1/f0, where the file has
    no waveforms, for the peak of the pulse.
    """
    scan, data = file["tracks/track_0/scan"], file["tracks/track_0/data/raw_data"][0, ..., 0]
    values = {name: scan[name][()].astype(float) for name in SCALARS}
    back = np.linalg.norm(file["probe/probe_geometry"][()] - [place[0], 0, place[1]], axis=1) / values["sound_speed"]
    sent = np.where(scan["tx_apodizations"][()] == 0, np.inf, scan["t0_delays"][()] + back)
    out = sent.min(axis=1) - scan["initial_times"][()] + 1 / values["center_frequency"]
    cycles = np.fft.rfftfreq(data.shape[1])[1:-1]
    spectra = np.fft.rfft(data, axis=1)[:, 1:-1]
    samples = values["sampling_frequency"] * (out[:, None, None] + back)
    return abs((spectra * np.exp(2j * np.pi * cycles[:, None] * samples)).sum())


SCALARS = ("sound_speed", "center_frequency", "sampling_frequency")


@pytest.mark.slow
def test_transmits_of_zea_focus_where_the_lines_do(folder, rf):
    """The brightest sample of the lines is the brightest near it when zea's rule of time focuses the file."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(written(folder, "zea")) as file:
        levels = [compounded_by_zea(file, place) for place in places_about(rf)]
    assert abs(OFFSETS[int(np.argmax(levels))]) < 20e-6  # a pulse that peaks 1/f0 late is 31 um off


SHAPES = {
    "raw_data": (FRAMES, ELEMENTS, None, ELEMENTS, 1),
    "t0_delays": (ELEMENTS, ELEMENTS),
    "tx_apodizations": (ELEMENTS, ELEMENTS),
    "initial_times": (ELEMENTS,),
    "focus_distances": (ELEMENTS,),
    "polar_angles": (ELEMENTS,),
    "transmit_origins": (ELEMENTS, 3),
    "sampling_frequency": (),
    "center_frequency": (),
    "demodulation_frequency": (),
    "sound_speed": (),
}
"""Of zea's documented format, version 0.1."""


def test_zea_is_laid_out_as_documented(folder, rf):
    h5py = pytest.importorskip("h5py")
    with h5py.File(written(folder, "zea")) as file:
        assert file.attrs["zea_version"].startswith("0.1.")
        track = file["tracks/track_0"]
        for name, shape in SHAPES.items():
            dataset = track["data" if name == "raw_data" else "scan"][name]
            assert dataset.dtype == np.float32
            assert tuple(dataset.shape) == tuple(rf.sizes["sample"] if size is None else size for size in shape)
        assert file["probe/probe_geometry"].shape == (ELEMENTS, 3)
        np.testing.assert_array_equal(track["scan/tx_apodizations"], np.eye(ELEMENTS))
        beamformed = track["data/beamformed_data"]
        found = beamformed["values"][..., 0] + 1j * beamformed["values"][..., 1]
        np.testing.assert_array_equal(found, rf.lines.transpose("frame", "range", "line"))
        distance = np.linalg.norm(beamformed["coordinates"], axis=-1)
        np.testing.assert_allclose(distance, np.broadcast_to(rf.range.values[:, None], distance.shape), rtol=1e-6)


def test_uff_is_laid_out_as_the_toolbox_writes_it(folder, rf):
    h5py = pytest.importorskip("h5py")
    with h5py.File(written(folder, "uff")) as file:
        data = file["channel_data"]
        assert (data.attrs["class"], data["probe"].attrs["class"]) == ("uff.channel_data", "uff.linear_array")
        assert data["data"].shape == (FRAMES, ELEMENTS, ELEMENTS, rf.sizes["sample"])
        assert list(data["sequence"].attrs["size"]) == [1, ELEMENTS]
        assert len(data["sequence"]) == ELEMENTS and data["sequence/sequence_0001"].attrs["class"] == "uff.wave"
        assert data["probe/geometry"].shape == (7, ELEMENTS)
        assert sorted(file["beamformed_data/data"]) == ["imag", "real"]
        assert file.attrs["version"].tolist() == ["v1.2.0"]  # `read_object` takes the first of a list


def test_echoxflow_is_the_bmode_before_scan_conversion(folder, rf):
    """Scan-converted as a recording, it is the B-mode of the same lines, but for where the logarithm is taken."""
    config = Repository(folder).case("heart").config
    clip = echoxflow.read(export(folder, "echoxflow", "heart", "mid"))
    range_, half = rf.range.values, float(rf.line_angle[-1])
    gain = clip_gain(config.probe, config.bmode, rf.lines.shape[:2], range_, np.random.default_rng(0))
    size = config.bmode.model_copy(update={"size_px": 512})
    bmode = largest_clip(rf.lines.values, Sector(rf.line_angle.values), range_, size, gain)
    axial, lateral = pixel_centres(size, 512)
    step = clip.spacing[0]
    rows, columns = (axial - range_[0] * np.cos(half)) / step, (lateral + range_[-1] * np.sin(half)) / step
    at = np.meshgrid(rows, columns, indexing="ij")
    inside = np.hypot(axial[:, None], lateral) < 0.99 * range_[-1]
    inside &= abs(np.arctan2(lateral, axial[:, None])) < 0.95 * half
    for ours, image in zip(bmode, clip.frames.astype(float), strict=True):
        found = map_coordinates(image, at, order=1)[inside]
        assert np.corrcoef(found, ours[inside])[0, 1] > 0.99
        assert abs(np.mean(found - ours[inside])) < 1  # the same level is white
    np.testing.assert_allclose(clip.time, times(folder), rtol=1e-6)


def test_echoxflow_loses_the_echoes_that_drop_out(folder, rf):
    """A loss at the edges darkens the outer lines against those in the middle."""
    config, levels = Repository(folder).case("heart").config, []
    for loss in (0.0, 60.0):
        case = Case("heart", {}, configure(config, bmode={"dropout": {"edge_loss_dB": loss}}))
        levels.append(beamspace_levels(SimpleNamespace(case=case, view="mid"), rf).astype(float))
    lines = np.array([each.sum(axis=(0, 1)) for each in levels])
    middle = lines.shape[1] // 2
    whole, lost = lines[:, [0, -1]].sum(axis=1) / lines[:, middle - 1 : middle + 1].sum(axis=1)
    assert lost < 0.8 * whole


def test_echoxflow_is_read_by_the_published_loader(folder, rf, tmp_path):
    loader = pytest.importorskip("echoxflow", reason="is in no package index")
    export(folder, "echoxflow", "heart", "mid", tmp_path)
    (record,) = loader.find_recordings(croissant=loader.load_croissant(tmp_path / "croissant.json"))
    stream = loader.open_recording(record, root=tmp_path).load_stream("2d_brightness_mode")
    assert stream.data.shape == (FRAMES, rf.sizes["range"], rf.sizes["line"]) and stream.data.max() == 255
    sector = stream.metadata.geometry
    found = sector.depth_start_m, sector.depth_end_m, sector.angle_start_rad, sector.angle_end_rad
    assert found == pytest.approx([*rf.range.values[[0, -1]], *rf.line_angle.values[[0, -1]]])
    np.testing.assert_allclose(stream.timestamps, times(folder), rtol=1e-6)
    assert stream.sample_rate_hz == pytest.approx(1 / np.diff(times(folder))[0])


def test_echoxflow_is_written_again_in_its_place_and_over_nothing_else(folder, tmp_path):
    path = export(folder, "echoxflow", "heart", "mid", tmp_path / "a.zarr")
    first = (path / "zarr.json").read_bytes()
    assert (export(folder, "echoxflow", "heart", "mid", path) / "zarr.json").read_bytes() == first
    (path / "other").mkdir()
    with pytest.raises(ExportError, match="holds something else"):
        export(folder, "echoxflow", "heart", "mid", path)


def test_parallel_lines_are_no_recording_of_echoxflow(rf_repository, tmp_path):
    with pytest.raises(ExportError, match="has parallel lines, and echoxflow holds sectors"):
        export(rf_repository([], scan="linear"), "echoxflow", "heart", "mid", tmp_path)


BEAMFORMED = {"scan", "data", "probe", "pulse", "sequence", "phantom"}
BEAMFORMED |= {"sampling_frequency", "modulation_frequency", "frame_rate"}
"""Properties of `uff.beamformed_data` of USTB, to which `read_object` assigns what a file holds."""


def test_lines_of_the_uff_have_the_properties_of_their_class_and_the_sampling_in_depth(folder, rf):
    h5py = pytest.importorskip("h5py")
    with h5py.File(written(folder, "uff")) as file:
        assert set(file["beamformed_data"]) <= BEAMFORMED
        steps = np.diff(rf.range)
        np.testing.assert_allclose(SPEED / (2 * file["beamformed_data/sampling_frequency"][()]), steps, rtol=1e-6)
        assert file["channel_data/sound_speed"][()] == SPEED
        assert file["channel_data/sampling_frequency"][()] == rf.attrs["sampling_frequency"]


def test_sizes_of_the_elements_are_those_of_the_array(folder):
    h5py = pytest.importorskip("h5py")
    with h5py.File(written(folder, "uff")) as uff, h5py.File(written(folder, "zea")) as zea:
        for group in (uff["channel_data/probe"], uff["beamformed_data/probe"], zea["probe"]):
            assert group["element_width"][()] == pytest.approx(41e-6)  # of mouse_25MHz
            assert group["element_height"][()] == pytest.approx(1e-3)
        geometry = uff["channel_data/probe/geometry"][5:]
    np.testing.assert_allclose(geometry.T, np.tile([41e-6, 1e-3], (ELEMENTS, 1)))


@pytest.mark.parametrize("name, suffix", [("uff", ".uff"), ("zea", ".hdf5")])
def test_channels_are_written_where_they_are_kept(rf_repository, tmp_path, name, suffix):
    h5py = pytest.importorskip("h5py")
    found = []
    with h5py.File(export(rf_repository([]), name, "heart", "mid", tmp_path / f"a{suffix}")) as file:
        file.visit(found.append)
    leaves = {path.rpartition("/")[2] for path in found}
    assert "beamformed_data" in leaves and not {"raw_data", "channel_data"} & leaves


REFUSED = {
    ("nowhere", "heart", "mid"): "is not a repository",
    ("small", "hart", "mid"): "case = 'hart': use one of heart",
    ("small", "heart", "middle"): "view = 'middle': use one of mid, apex",
    ("small", "heart", "apex"): "has no rf of heart apex yet: run it to its end",
}


@pytest.mark.parametrize("asked", REFUSED, ids="-".join)
def test_what_is_not_there_is_said_in_one_sentence(folder, tmp_path, asked):
    pytest.importorskip("h5py")
    place, case, view = asked
    with pytest.raises((ValueError, FileNotFoundError), match=REFUSED[asked]):
        export(folder if place == "small" else tmp_path, "uff", case, view)


def test_missing_h5py_is_said_in_one_line(folder):
    code = "import sys; sys.modules['h5py'] = None; from echotruth.cli import main; main()"
    command = ["export", str(folder), "--format", "uff", "--case", "heart", "--view", "mid"]
    done = subprocess.run([sys.executable, "-c", code, *command], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == f"echotruth: needs the package h5py: {installation('export')}\n"


def test_command_writes_the_file_and_says_where(folder, tmp_path):
    pytest.importorskip("h5py")
    file = tmp_path / "new/a.uff"
    command = ["export", folder, "--format", "uff", "--case", "heart", "--view", "mid", "--output", file]
    code = "from echotruth.cli import main; main()"
    done = subprocess.run([sys.executable, "-c", code, *map(str, command)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{file}\n", "")
    assert list(file.parent.iterdir()) == [file]
