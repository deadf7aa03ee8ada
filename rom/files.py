"""Files that appear whole or not at all, keep links and permissions, say when they were damaged, and have one writer.

A sealed file ends with one line: a digest (xxh3, 128 bits) of all bytes before it. Readers of netCDF do not see it, and
whatever writes the file anew leaves it out; so a file whose seal is broken was damaged, and one without a seal comes
from another program.
"""

from __future__ import annotations

import glob
import logging
import os
import re
import secrets
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rom.errors import SchemaError

LONGEST_NAME = 200
"""Bytes of a file's name, so that temporary names fit too."""
SEAL = b"\nfingertip-rom xxh3-128 %s of %020d bytes\n"
SEAL_BYTES = len(SEAL % (b"0" * 32, 0))
SEAL_PATTERN = re.compile(rb"\nfingertip-rom xxh3-128 ([0-9a-f]{32}) of ([0-9]{20}) bytes\n")
BLOCK = 2**18
"""Bytes read at once: what the processor's own memory holds."""
SETTLED = 2.0
"""Age [s] from which a file's times tell whether it was changed."""
_intact: dict[tuple[int, ...], bool] = {}
"""Files that this process has read, by their identity, size and times."""
log = logging.getLogger(__name__)


# ---- writing ------------------------------------------------------------------------------------------------

def check_output(path: str | Path) -> Path:
    """Where an output will lie, links followed.

    Raises
    ------
    OSError
        For a folder, a pipe or device, a write-protected file or folder, and a name that is too long; before any work.
    """
    real = Path(os.path.realpath(path))
    if len(os.fsencode(real.name)) > LONGEST_NAME:
        raise OSError(f"{real.name[:20]}... has {len(real.name)} characters: give a name of at most {LONGEST_NAME}")
    try:
        mode = os.stat(real).st_mode
    except (FileNotFoundError, NotADirectoryError):
        mode = None
    if mode is not None and stat.S_ISDIR(mode):
        raise IsADirectoryError(f"{path} is a folder: name a file")
    if mode is not None and not stat.S_ISREG(mode):
        raise OSError(f"{path} is a pipe or a device, which cannot be replaced: name a file")
    if mode is not None and not os.access(real, os.W_OK):
        raise PermissionError(f"{path} is write-protected: name another file, or permit writing")
    folder = next(parent for parent in real.parents if os.path.lexists(parent))
    if not folder.is_dir():
        raise NotADirectoryError(f"{folder} is no folder, so that {path} cannot lie in it: name another place")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(f"{folder} may not be written to: name another place for {path}, or permit writing")
    return real


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary name beside ``path``; rename it to ``path`` on success, remove it on failure.

    A link keeps pointing to the file that it points to; a file that was there keeps its permissions, a new one gets
    those that the user's files get.

    Raises
    ------
    OSError
        As :func:`check_output`; where the disk is full.
    """
    real = check_output(path)
    real.parent.mkdir(parents=True, exist_ok=True)
    remove_leftovers(real)
    temporary = real.with_name(f".{real.name}.{secrets.token_hex(4)}.{os.getpid()}.partial")
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        usual = os.stat(temporary)
        yield temporary
        with open(temporary, "rb") as written:
            os.fsync(written.fileno())
        old = os.stat(real) if real.exists() else usual
        with suppress(OSError, AttributeError):  # another user's file stays theirs where permitted
            os.chown(temporary, old.st_uid, old.st_gid)
        os.chmod(temporary, stat.S_IMODE(old.st_mode))
        os.replace(temporary, real)
    finally:
        temporary.unlink(missing_ok=True)


def remove_leftovers(path: str | Path) -> None:
    """Remove what killed processes left of ``path`` under temporary names; a living one's file stays."""
    path = Path(path)
    for partial in path.parent.glob(f".{glob.escape(path.name)}.*.partial"):
        number = partial.name.removesuffix(".partial").rpartition(".")[2]
        if number.isdecimal() and not _alive(int(number)):
            partial.unlink(missing_ok=True)


def _alive(process: int) -> bool:
    if os.name == "nt":  # where signal 0 would end it
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # someone else's
        return True
    return True


@contextmanager
def only_writer(lock: Path, output: str | Path, wait: bool = False) -> Iterator[None]:
    """Hold the file ``lock`` while ``output`` is written; it is released when the process ends, however that happens.

    Parameters
    ----------
    wait : bool
        For whoever holds it, instead of refusing.

    Raises
    ------
    BlockingIOError
        Where another process or thread holds it.
    """
    try:
        import fcntl
    except ImportError:  # no such locks: the last one to finish wins
        yield
        return
    while True:
        lock.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(lock, os.O_CREAT | os.O_RDWR, 0o666)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if not wait:
                os.close(file)
                raise BlockingIOError(f"another process is writing {output}: wait for it to finish, or name another "
                                      "place") from None
            log.warning("waiting for another process that is writing %s", output)
            fcntl.flock(file, fcntl.LOCK_EX)
        except OSError:  # a file system without locks
            pass
        if _is_open(lock, file):
            break
        os.close(file)  # which the last holder has removed
    try:
        yield
    finally:
        if _is_open(lock, file):
            lock.unlink()
        os.close(file)


def _is_open(path: Path, file: int) -> bool:
    try:
        return os.path.samestat(os.fstat(file), os.stat(path))
    except OSError:
        return False


# ---- seals --------------------------------------------------------------------------------------------------

def seal(path: str | Path) -> None:
    """Append the digest of a file to it."""
    size = os.stat(path).st_size
    line = SEAL % (_digest(path, size), size)
    with open(path, "ab") as file:
        file.write(line)


def check_seal(path: str | Path, most: float = float("inf")) -> bool:
    """Whether a file is sealed; one whose seal is broken is refused.

    Parameters
    ----------
    most : float
        Bytes up to which the digest is computed; of a larger file only the seal's own form is looked at.

    Raises
    ------
    SchemaError
        For a damaged file.
    OSError
        Where it cannot be read.
    """
    found = os.stat(path)
    key = (found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns)
    if key in _intact:
        return _intact[key]
    with open(path, "rb") as file:
        start = file.read(64)
        file.seek(max(0, found.st_size - SEAL_BYTES))
        line = SEAL_PATTERN.fullmatch(file.read())
    size = found.st_size - SEAL_BYTES
    if line is None:
        if _size_told(start) not in (None, found.st_size):
            raise SchemaError(f"{path} is truncated or damaged at its end: delete it and make it again")
        log.info("%s carries no seal: it was written by another program or an older version", path)
        return False
    if int(line[2]) != size or (size <= most and line[1] != _digest(path, size)):
        raise SchemaError(f"{path} is damaged, its content is not what was written: delete it and make it again")
    if size <= most and time.time() - max(found.st_mtime, found.st_ctime) > SETTLED:
        _intact[key] = True
    return True


def is_intact(path: str | Path) -> bool:
    """Whether a file that can be made anew is there; a damaged one is named, and removed."""
    try:
        check_seal(path)
    except FileNotFoundError:
        return False
    except (SchemaError, OSError) as error:
        log.warning("%s was damaged and is made anew (%s)", path, error)
        Path(path).unlink(missing_ok=True)
        return False
    return True


def _digest(path: str | Path, size: int) -> bytes:
    """Of the first ``size`` bytes of a file."""
    import xxhash

    digest, block = xxhash.xxh3_128(), memoryview(bytearray(BLOCK))
    with open(path, "rb", buffering=0) as file:  # no memory map: a file that another process cuts would end this one
        while size > 0 and (count := file.readinto(block[:size])):
            digest.update(block[:count])
            size -= count
    return digest.hexdigest().encode()


def _size_told(start: bytes) -> int | None:
    """Size that an HDF5 file states in its superblock (HDF5 file format, section II.A); None for other files."""
    if not start.startswith(b"\x89HDF\r\n\x1a\n") or len(start) < 48:
        return None
    place = {0: 40, 1: 44, 2: 28, 3: 28}.get(start[8])
    return None if place is None else int.from_bytes(start[place:place + 8], "little")
