"""Files appear whole, keep links and permissions, have one writer, and say when they were damaged."""

import os
import stat
import subprocess
import sys
import threading

import netCDF4
import numpy as np
import pytest
import xarray as xr

from rom import files
from rom.errors import SchemaError
from rom.files import SEAL_BYTES, check_output, check_seal, is_intact, only_writer, remove_leftovers, seal, whole_file

ROOT = os.name != "nt" and os.geteuid() == 0


@pytest.fixture(autouse=True)
def _nothing_remembered(monkeypatch):
    monkeypatch.setattr(files, "_intact", {})


def put(path, text="new"):
    with whole_file(path) as temporary:
        temporary.write_text(text)


# ---- writing ------------------------------------------------------------------------------------------------

def test_a_file_appears_whole_or_not_at_all(tmp_path):
    path = tmp_path / "new folder" / "a.txt"
    with pytest.raises(RuntimeError), whole_file(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert list(path.parent.iterdir()) == []
    put(path)
    assert [found.name for found in path.parent.iterdir()] == ["a.txt"] and path.read_text() == "new"


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "far").mkdir()
    target, link = tmp_path / "far" / "target.txt", tmp_path / "link.txt"
    target.write_text("old")
    link.symlink_to(os.path.join("far", "target.txt"))
    put(link)
    assert link.is_symlink() and target.read_text() == "new"
    dangling = tmp_path / "dangling.txt"
    dangling.symlink_to(tmp_path / "far" / "later.txt")
    put(dangling)
    assert dangling.is_symlink() and (tmp_path / "far" / "later.txt").read_text() == "new"


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664])
def test_permissions_stay(tmp_path, mode):
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(mode)
    put(path)
    assert stat.S_IMODE(path.stat().st_mode) == mode and path.read_text() == "new"


@pytest.mark.parametrize("mask, mode", [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_new_files_get_the_usual_permissions(tmp_path, mask, mode):
    path = tmp_path / "a.txt"
    before = os.umask(mask)
    try:
        with whole_file(path) as temporary:
            temporary.unlink()
            temporary.touch(0o600)  # as a library does that keeps its files private
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == mode


def test_outputs_that_cannot_be_are_refused_before_the_work(tmp_path):
    (tmp_path / "file").write_text("")
    os.mkfifo(tmp_path / "pipe")
    for place, error, words in ((tmp_path, IsADirectoryError, "is a folder"),
                                (tmp_path / "pipe", OSError, "pipe or a device"),
                                ("/dev/null", OSError, "pipe or a device"),
                                (tmp_path / "file" / "x", NotADirectoryError, "file is no folder"),
                                (tmp_path / ("n" * 230), OSError, "230 characters")):
        with pytest.raises(error, match=words), whole_file(place):
            raise AssertionError("no work may be done")
        with pytest.raises(error, match=words):
            check_output(place)
    assert os.path.exists("/dev/null") and not os.path.isfile("/dev/null")
    assert sorted(found.name for found in tmp_path.iterdir()) == ["file", "pipe"]


@pytest.mark.skipif(ROOT, reason="the superuser may write everything")
def test_protected_places_are_refused(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(0o444)
    with pytest.raises(PermissionError, match="write-protected"):
        check_output(path)
    tmp_path.chmod(0o555)
    with pytest.raises(PermissionError, match="may not be written to"):
        check_output(tmp_path / "b.txt")
    tmp_path.chmod(0o755)


def test_threads_of_one_process_do_not_disturb_each_other(tmp_path):
    path = tmp_path / "a.txt"
    with whole_file(path) as first, whole_file(path) as second:
        assert first != second
        first.write_text("first")
        second.write_text("second")
    assert path.read_text() == "first"  # which was the last to finish


def test_leftovers_of_the_dead_go(tmp_path):
    gone = [tmp_path / f".a.txt.{middle}{2**30}.partial" for middle in ("", "12345678.")]  # beyond any pid
    living = tmp_path / f".a.txt.{os.getpid()}.partial"
    other = tmp_path / f".b.txt.{2**30}.partial"
    for path in (*gone, living, other):
        path.touch()
    put(tmp_path / "a.txt")
    assert {found.name for found in tmp_path.iterdir()} == {"a.txt", living.name, other.name}
    remove_leftovers(tmp_path / "b.txt")
    assert not other.exists()


def test_one_writer_at_a_time(tmp_path):
    lock = tmp_path / "folder" / "lock"
    with only_writer(lock, "set.nc"):
        with pytest.raises(BlockingIOError, match=r"another process is writing set\.nc"), only_writer(lock, "set.nc"):
            pass
        assert lock.exists()
    assert not lock.exists()
    with pytest.raises(RuntimeError), only_writer(lock, "set.nc"):
        raise RuntimeError
    with only_writer(lock, "set.nc"):  # released by the failure
        pass


def test_a_killed_writer_holds_nothing(tmp_path):
    lock = tmp_path / "lock"
    code = ("import sys, time; from rom.files import only_writer; from pathlib import Path\n"
            "with only_writer(Path(sys.argv[1]), 'x'): print('held', flush=True); time.sleep(60)")
    process = subprocess.Popen([sys.executable, "-c", code, str(lock)], stdout=subprocess.PIPE, text=True,
                               env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})
    try:
        assert process.stdout.readline() == "held\n"
        with pytest.raises(BlockingIOError), only_writer(lock, "x"):
            pass
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
    assert lock.exists()
    with only_writer(lock, "x"):
        pass
    assert not lock.exists()


def test_a_lock_that_is_removed_while_waited_for_is_made_anew(tmp_path):
    # each thread in turn: none may hold a removed file while another holds the new one
    lock, inside, most = tmp_path / "folder" / "lock", [], []

    def work():
        for _ in range(200):
            try:
                with only_writer(lock, "x"):
                    inside.append(1)
                    most.append(len(inside))
                    inside.pop()
            except BlockingIOError:
                pass

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert max(most) == 1 and not lock.exists()


# ---- seals --------------------------------------------------------------------------------------------------

@pytest.fixture
def sealed(tmp_path):
    path = tmp_path / "data.nc"
    xr.Dataset({"a": (("x", "y"), np.arange(600.0).reshape(30, 20), {"units": "m"})},
               attrs={"title": "numbers"}).to_netcdf(path, engine="netcdf4")
    seal(path)
    return path


def test_a_seal_is_not_seen_by_readers(sealed):
    assert check_seal(sealed)
    with netCDF4.Dataset(sealed) as raw:
        assert raw["a"][29, 19] == 599.0
    with xr.open_dataset(sealed) as found:
        found.load()
    found.isel(x=slice(3)).to_netcdf(sealed.with_name("few.nc"))
    assert not check_seal(sealed.with_name("few.nc"))  # another program wrote it, and nothing is wrong with it


def test_writing_into_the_file_takes_the_seal_off(sealed):
    with netCDF4.Dataset(sealed, "a") as raw:
        raw.title = "others"
    assert not check_seal(sealed)


def test_every_damaged_byte_is_noticed(sealed, tmp_path):
    whole, rng = sealed.read_bytes(), np.random.default_rng(3)
    path = tmp_path / "damaged.nc"
    end = range(len(whole) - SEAL_BYTES - 8, len(whole))
    for place in {*rng.integers(0, len(whole), 300).tolist(), *range(64), *end}:
        content = bytearray(whole)
        content[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(content)
        with pytest.raises(SchemaError, match="damaged"):
            check_seal(path)


@pytest.mark.parametrize("cut", [1, SEAL_BYTES - 1, SEAL_BYTES + 1, 1000])
def test_a_cut_end_is_noticed(sealed, cut):
    content = sealed.read_bytes()
    for changed in (content[:-cut], content[:-cut] + bytes(cut), content + b"more", content[cut:]):
        sealed.write_bytes(changed)
        with pytest.raises(SchemaError, match="damaged"):
            check_seal(sealed)


def test_an_unsealed_file_says_so(sealed, caplog):
    sealed.write_bytes(sealed.read_bytes()[:-SEAL_BYTES])
    with caplog.at_level("INFO"):
        assert not check_seal(sealed)
    assert "data.nc carries no seal" in caplog.text


def test_of_a_large_file_only_the_form_is_checked(sealed):
    content = bytearray(sealed.read_bytes())
    content[len(content) // 2] ^= 1
    sealed.write_bytes(content)
    assert check_seal(sealed, most=100)
    with pytest.raises(SchemaError, match="damaged"):
        check_seal(sealed)


def test_a_file_is_read_once(sealed, monkeypatch):
    monkeypatch.setattr(files, "SETTLED", -1.0)
    assert check_seal(sealed)
    monkeypatch.setattr(files, "_digest", lambda *_: pytest.fail("read again"))
    assert check_seal(sealed)
    monkeypatch.undo()
    content = bytearray(sealed.read_bytes())
    content[200] ^= 1
    sealed.write_bytes(content)
    with pytest.raises(SchemaError, match="damaged"):
        check_seal(sealed)


def test_a_damaged_file_that_can_be_made_anew_goes(sealed, caplog):
    assert is_intact(sealed)
    sealed.write_bytes(sealed.read_bytes()[:-5])
    assert not is_intact(sealed) and not sealed.exists() and "data.nc was damaged and is made anew" in caplog.text
    assert not is_intact(sealed)
