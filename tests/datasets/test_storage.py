"""netCDF files: sealed, whole, one writer at a time; damaged ones are named by every reader, and never believed."""

import json
import os
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

sys.path.insert(0, str(Path(__file__).parents[1]))

from hostile import one_line
from small_worlds import Plate

import rom.scenes.linear_scene as linear_scene
from rom import files
from rom.datasets import make_dataset, open_dataset, read_dataset, storage
from rom.datasets.pieces import pieces_of
from rom.datasets.storage import open_netcdf, read_netcdf, write_in_blocks, write_netcdf
from rom.errors import SchemaError
from rom.files import SEAL_BYTES, check_seal
from rom.metamodels import create, load

RECIPE = {"what": "a test"}


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    return Plate(tmp_path_factory.mktemp("plate"))


@pytest.fixture(autouse=True)
def _nothing_remembered(monkeypatch):
    monkeypatch.setattr(files, "_intact", {})


# ---- writing ------------------------------------------------------------------------------------------------

def test_complex_scalars_and_coordinates_survive(tmp_path):
    data = xr.Dataset({"gain": 2 - 1j, "u": (("x", "y"), np.arange(6).reshape(2, 3) * (1 - 2j)),
                       "small": ("x", np.array([1j, 2], dtype=np.complex64))},
                      coords={"pole": ("y", [1j, 2.0, 3 - 1j], {"units": "rad s-1"}), "shift": 0.5j, "x": [3, 4]})
    write_netcdf(data, tmp_path / "a.nc")
    found = read_netcdf(tmp_path / "a.nc")
    xr.testing.assert_identical(found, data)
    assert found["small"].dtype == np.complex64


def test_writing_keeps_links_and_permissions(tmp_path):
    target, link = tmp_path / "target.nc", tmp_path / "link.nc"
    write_netcdf(xr.Dataset({"a": 1.0}), target)
    target.chmod(0o640)
    link.symlink_to(target)
    write_netcdf(xr.Dataset({"a": 2.0}), link, compress=True)
    assert link.is_symlink() and read_netcdf(target)["a"] == 2.0 and stat.S_IMODE(target.stat().st_mode) == 0o640


def test_every_written_file_is_sealed(plate, tmp_path):
    blocks = [(np.array([0, 1]), np.ones((2, 3))), (np.array([2]), np.full((1, 3), 5.0))]
    write_in_blocks(xr.Dataset(coords={"x": [1, 2, 3], "y": [0, 1, 2]}), tmp_path / "blocks.nc", "a", ("x", "y"),
                    np.dtype(float), {"units": "m"}, blocks)
    assert check_seal(tmp_path / "blocks.nc") and check_seal(plate.file)
    assert read_netcdf(tmp_path / "blocks.nc")["a"].values[2, 0] == 5.0
    create("modal-krylov", plate.scene, modes=3, vectors=2).fit().save(tmp_path / "model.nc")
    assert check_seal(tmp_path / "model.nc")


def test_large_files_have_a_checksum_in_each_chunk(tmp_path, monkeypatch):
    monkeypatch.setattr(storage, "CHECKED_AT_ONCE", 1000)
    values = np.random.default_rng(0).random((4, 500))
    path = tmp_path / "large.nc"
    frame = xr.Dataset(coords={"x": np.arange(4), "y": np.arange(500)})
    write_in_blocks(frame, path, "a", ("x", "y"), values.dtype, {}, [(np.arange(4), values)])
    with netCDF4.Dataset(path) as raw:
        assert raw["a"].filters()["fletcher32"]
    content = path.read_bytes()
    place = content.index(values[2, 100:104].tobytes())
    path.write_bytes(content[:place] + bytes(32) + content[place + 32:])
    with open_netcdf(path, 1000) as data:  # as a lazy reader does
        np.testing.assert_array_equal(data["a"][1], values[1])
        with pytest.raises(SchemaError, match=r"large\.nc is damaged"), storage.reading(path):
            data["a"][2].load()
    with pytest.raises(SchemaError, match="is damaged"):
        read_netcdf(path)


# ---- reading ------------------------------------------------------------------------------------------------

def test_a_damaged_file_is_named_by_every_reader(plate, tmp_path):
    model = tmp_path / "model.nc"
    create("modal-krylov", plate.scene, modes=3, vectors=2).fit().save(model)
    for path, readers in ((plate.file, (read_dataset, open_dataset, read_netcdf)),
                          (model, (read_netcdf, lambda path: load(path, plate.scene)))):
        whole = path.read_bytes()
        for k, place in enumerate(range(0, len(whole), len(whole) // 40)):
            damaged = tmp_path / f"{k}.nc"  # libraries keep open files by their names
            damaged.write_bytes(whole[:place] + bytes(b ^ 0xff for b in whole[place:place + 8]) + whole[place + 8:])
            for read in readers:
                with pytest.raises(SchemaError, match=rf"{k}\.nc is (truncated or )?damaged") as caught:
                    read(damaged)
                one_line(caught.value)


def test_a_file_that_another_program_wrote_is_read_and_says_so(plate, tmp_path, caplog):
    path = tmp_path / "theirs.nc"
    xr.open_dataset(plate.file).isel(case=slice(4)).to_netcdf(path)
    with caplog.at_level("INFO"):
        xr.testing.assert_identical(read_dataset(path), plate.data.isel(case=slice(4)))
    assert "theirs.nc carries no seal" in caplog.text


def test_whatever_the_library_raises_is_one_sentence(plate, tmp_path):
    # without a seal, HDF5 and netCDF meet the damage themselves
    whole = plate.file.read_bytes()[:-SEAL_BYTES]
    rng = np.random.default_rng(5)
    refused = 0
    for k in range(150):
        content = bytearray(whole)
        for place in rng.integers(0, len(whole) // 3, 3):  # where the headers are
            content[place] = rng.integers(256)
        path = tmp_path / f"{k}.nc"
        path.write_bytes(content)
        for read in (read_dataset, lambda path: open_dataset(path).load()):
            try:
                read(path)
            except SchemaError as error:
                assert path.name in one_line(error)
                refused += 1
            except (OSError, RuntimeError) as error:  # a chunk that is read later, outside of the toolkit
                assert read is not read_dataset, error
    assert refused > 100


def test_a_file_that_claims_too_much_is_refused(tmp_path):
    with netCDF4.Dataset(tmp_path / "bomb.nc", "w") as raw:
        raw.createDimension("x", 2**40)
        raw.createVariable("a", "f8", ("x",), chunksizes=(2**20,), zlib=True)
    with pytest.raises(SchemaError, match=r"bomb\.nc claims to hold 8796\.1 GB"):
        read_netcdf(tmp_path / "bomb.nc")


@pytest.mark.parametrize("name", ["absent.nc", "\0", "."])
def test_what_is_no_file_is_refused(tmp_path, name):
    with pytest.raises(SchemaError, match="does not exist"):
        open_netcdf(os.path.join(tmp_path, name))


# ---- pieces -------------------------------------------------------------------------------------------------

@pytest.fixture(autouse=True)
def _small_pieces(monkeypatch):
    monkeypatch.setattr(linear_scene, "PIECE_CASES", 4)


def beside(path):
    return sorted(found.name for found in path.parent.iterdir())


def test_a_finished_run_leaves_nothing_and_is_found_again(tmp_path):
    path = tmp_path / "a.nc"
    for made in (False, True):
        with pieces_of(path, RECIPE, "cases") as folder:
            assert (folder is None) == made
            if folder is not None:
                assert folder.is_dir()
                write_netcdf(xr.Dataset(attrs={"recipe": json.dumps(RECIPE)}), path)
        assert beside(path) == ["a.nc"]
    with pytest.raises(FileExistsError, match="not made from this recipe"), pieces_of(path, {}, "cases"):
        pass


def test_a_run_that_fails_keeps_its_pieces(tmp_path):
    path = tmp_path / "a.nc"
    with pytest.raises(RuntimeError), pieces_of(path, RECIPE, "cases") as folder:
        (folder / "00000.nc").touch()
        raise RuntimeError
    assert beside(path) == ["a.nc.pieces"]
    with pytest.raises(SchemaError, match="holds pieces of another recipe"), pieces_of(path, {}, "cases"):
        pass
    with pieces_of(path, RECIPE, "cases") as folder:
        assert sorted(found.name for found in folder.iterdir()) == ["00000.nc", "lock", "recipe.json"]


def test_what_a_kill_before_tidying_up_leaves_goes_with_the_next_run(plate, tmp_path, monkeypatch):
    path = tmp_path / "a.nc"
    with monkeypatch.context() as patch:
        patch.setattr("rom.datasets.pieces.shutil.rmtree", lambda *_, **__: None)  # as if killed right here
        make_dataset(plate.scene, 8, path)
    assert beside(path) == ["a.nc", "a.nc.pieces"]
    make_dataset(plate.scene, 8, path)
    assert beside(path) == ["a.nc"]


def test_two_runs_on_one_output(plate, tmp_path):
    path = tmp_path / "a.nc"
    first = make_dataset(plate.scene, 8, tmp_path / "b.nc")

    def interfering(items):
        for k in items:
            with pytest.raises(BlockingIOError, match=r"another process is writing .*a\.nc"):
                make_dataset(plate.scene, 8, path)
            yield k

    make_dataset(plate.scene, 8, path, progress=interfering)
    xr.testing.assert_equal(read_dataset(path)["displacement"], read_dataset(first)["displacement"])


def test_a_damaged_piece_is_made_anew(plate, tmp_path, caplog):
    path, expected = tmp_path / "a.nc", read_dataset(make_dataset(plate.scene, 12, tmp_path / "b.nc"))

    def until_killed(items):
        for k in items:
            yield k
            if k:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_dataset(plate.scene, 12, path, progress=until_killed)
    piece = tmp_path / "a.nc.pieces" / "00000.nc"
    content = bytearray(piece.read_bytes())
    content[len(content) // 2] ^= 1
    piece.write_bytes(content)
    make_dataset(plate.scene, 12, path)
    assert "00000.nc was damaged and is made anew" in caplog.text
    xr.testing.assert_identical(read_dataset(path)["displacement"], expected["displacement"])


def test_a_damaged_entry_of_the_cache_is_made_anew(plate, tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("ROM_CACHE", str(tmp_path))
    path = make_dataset(plate.scene, 8)
    expected = read_dataset(path)
    path.write_bytes(path.read_bytes()[:-1])
    assert make_dataset(plate.scene, 8) == path
    xr.testing.assert_equal(read_dataset(path)["displacement"], expected["displacement"])
    assert f"{path.name} was damaged" in caplog.text


def test_who_finds_another_one_at_work_in_the_cache_waits(plate, tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("ROM_CACHE", str(tmp_path))
    started, found = threading.Event(), []
    second = threading.Thread(target=lambda: found.append(make_dataset(plate.scene, 8)))

    def meeting(items):
        for k in items:
            if not started.is_set():
                started.set()
                second.start()
                while "waiting for another process" not in caplog.text:
                    time.sleep(0.01)
            yield k

    first = make_dataset(plate.scene, 8, progress=meeting)
    second.join()
    assert found == [first] and beside(first) == [first.name]


@pytest.mark.parametrize("kind", ["folder", "pipe", "below a file"])
def test_outputs_that_cannot_be_are_refused_before_the_work(plate, tmp_path, kind):
    path = tmp_path / "a.nc"
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        path.touch()
        path = path / "b.nc"
    before = beside(tmp_path / "x")
    with pytest.raises(OSError, match="name"):
        make_dataset(plate.scene, 8, path, progress=lambda _: pytest.fail("work was done"))
    assert beside(tmp_path / "x") == before


KILLED = """
import sys, time
sys.path.insert(0, sys.argv[2])
import rom.scenes.linear_scene as linear_scene
linear_scene.PIECE_CASES = 4
from pathlib import Path
from small_worlds import Plate
from rom.datasets import make_dataset
world = Plate(Path(sys.argv[1]).parent / "other")
def waiting(items):
    for k in items:
        yield k
        print(k, flush=True)
        time.sleep(60)
make_dataset(world.scene, 12, sys.argv[1], progress=waiting)
"""


def test_a_killed_run_holds_no_lock_and_leaves_nothing_behind(plate, tmp_path):
    path = tmp_path / "a.nc"
    (tmp_path / "other").mkdir()
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(path), str(Path(__file__).parents[1])],
                               stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(
                                   [str(Path(files.__file__).parents[1]), *sys.path])})
    try:
        assert process.stdout.readline() == "0\n"
        with pytest.raises(BlockingIOError, match="another process"):
            make_dataset(plate.scene, 12, path)
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
    assert (tmp_path / "a.nc.pieces" / "00000.nc").exists()
    start = time.time()
    make_dataset(plate.scene, 12, path)
    assert time.time() - start < 60 and beside(path) == ["a.nc", "other"]
    expected = read_dataset(make_dataset(plate.scene, 12, tmp_path / "b.nc"))
    xr.testing.assert_identical(read_dataset(path)["displacement"], expected["displacement"])
