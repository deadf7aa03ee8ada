"""Damages files of every kind at random and reads them again: none may be believed with other content.

Usage: python experiments/fuzz_files.py [--count 20000] [--seed 0] [--unsealed]

Files as the toolkit writes them must be refused in one sentence, or hold what they held. With ``--unsealed`` their
seals are taken off first, as if another program had written them: then a reader cannot know, but must still end in one
sentence. Batches run in processes of their own: a crash of a library below is counted and does not end the campaign.
"""

from __future__ import annotations

import argparse
import collections
import json
import resource
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from rom.datasets import make_dataset, make_whole_dataset, open_dataset, read_dataset
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.datasets.tensors import DIGEST, read_weights, write_weights
from rom.errors import RomError
from rom.files import SEAL_BYTES
from rom.fingertip import Fingertip, MeshDensity
from rom.metamodels import create, load
from rom.scenes import get_scene

TINY = MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))
BATCH = 500
MEMORY = 6e9
"""Bytes that a batch may take; more is a bomb that went off."""
SENTENCES = (RomError, ValueError, OSError)
"""What the command line says in one sentence."""


class Kind(NamedTuple):
    """A file, and the readers that know it."""

    file: str
    readers: tuple[Callable[[Path], Any], ...]


@cache
def scene(name: str):
    """A scene on a mesh of 15 pad nodes."""
    return get_scene(name, Fingertip(density=TINY))


def answers(path: Path) -> np.ndarray:
    """What a stored metamodel answers to some cases, bound included."""
    name = "static-point-forces" if path.name.startswith(("superposition", "transformer")) else "harmonic-point-force"
    model = load(path, scene(name))
    cases = scene(name).sample(6, 5)
    return np.concatenate([model.evaluate(cases).ravel(), model.quick_assessment(cases).error])


def some_cases(path: Path) -> xr.Dataset:
    """A few cases, as a lazy reader takes them."""
    with open_dataset(path) as data:
        return data.isel(case=slice(0, None, max(1, data.sizes["case"] // 5))).load()


KINDS = (
    Kind("static.nc", (read_dataset, some_cases, read_netcdf)),
    Kind("harmonic.nc", (read_dataset, some_cases)),
    Kind("reduced.nc", (some_cases,)),
    Kind("superposition.nc", (answers,)),
    Kind("modal-krylov.nc", (answers,)),
    Kind("pod-regression.nc", (answers,)),
    Kind("mlp.safetensors", (answers, read_weights)),
    Kind("results.nc", (read_netcdf,)))


def make(folder: Path) -> None:
    """One file of each kind."""
    static, harmonic = scene("static-point-forces"), scene("harmonic-point-force")
    train = read_dataset(make_dataset(harmonic, 40, folder / "harmonic.nc", compress=True))
    make_dataset(static, 30, folder / "static.nc")
    make_whole_dataset(harmonic, folder / "reduced.nc", modes=60, vectors=10, precision="float32", confirm=8)
    create("superposition", static).fit().save(folder / "superposition.nc")
    create("modal-krylov", harmonic, modes=8, vectors=3).fit().save(folder / "modal-krylov.nc")
    create("pod-regression", harmonic, rank=5).fit(train).save(folder / "pod-regression.nc")
    create("mlp", harmonic, steps=3).fit(train).save(folder / "mlp.safetensors")
    rng = np.random.default_rng(0)
    write_netcdf(xr.Dataset({"case_error": (("entry", "case"), rng.random((30, 80)), {"units": "1"}),
                             "entry_name": ("entry", [f"entry {i}" for i in range(30)])},
                            attrs={"title": "results"}), folder / "results.nc", compress=True)


def unsealed(file: str, content: bytes, folder: Path) -> bytes:
    """The same file without its seal or digest."""
    if not file.endswith(".safetensors"):
        return content[:-SEAL_BYTES]
    path = folder / f"plain-{file}"
    path.write_bytes(content)
    attributes, arrays = read_weights(path)
    write_weights(path, arrays, attributes)
    whole = path.read_bytes()
    place = whole.index(DIGEST.encode())
    return whole[:place] + b"other_name" + b"_" * (len(DIGEST) - 10) + whole[place + len(DIGEST):]


def damaged(content: bytes, rng: np.random.Generator, others: list[bytes]) -> bytes:
    """A file with one to three damages: bits, blocks, cuts, pieces of other files."""
    found = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        size = max(1, len(found))
        start = int(rng.integers(size) if rng.random() < 0.6 else rng.integers(min(size, 4096)))  # headers stand first
        length = int(min(2 ** rng.integers(0, 13), size))
        how = rng.integers(9)
        if how == 0:
            for place in rng.integers(start, min(size, start + 256), rng.integers(1, 9)):
                found[min(place, len(found) - 1):place + 1] = bytes([found[min(place, len(found) - 1)] ^ (
                    1 << int(rng.integers(8)))]) if found else b""
        elif how == 1:
            found[start:start + length] = bytes(len(found[start:start + length]))
        elif how == 2:
            found[start:start + length] = rng.bytes(len(found[start:start + length]))
        elif how == 3:
            del found[start:]
        elif how == 4:
            del found[start:start + length]
        elif how == 5:
            found[start:start] = rng.bytes(length)
        elif how == 6:
            other = others[rng.integers(len(others))]
            found[start:start + length] = other[start:start + length]
        elif how == 7:
            source = int(rng.integers(size))
            found[start:start + length] = found[source:source + length]
        else:  # a number in a text becomes another
            digits = [place for place in range(start, min(len(found), start + 2048)) if 48 <= found[place] < 58]
            if digits:
                found[digits[rng.integers(len(digits))]] = 48 + int(rng.integers(10))
    return bytes(found)


def same(found: Any, expected: Any) -> bool:
    """Whether what was read is what was written."""
    if isinstance(expected, xr.Dataset):
        return found.identical(expected)
    if isinstance(expected, tuple):  # of a network
        return found[0] == expected[0] and found[1].keys() == expected[1].keys() and all(
            np.array_equal(found[1][name], array) for name, array in expected[1].items())
    return np.array_equal(found, expected)


def batch(folder: Path, seed: int, first: int, count: int, without_seal: bool, report: Callable[[dict], None]) -> None:
    """Damage and read the files ``first`` to ``first + count`` of a campaign; each outcome goes to ``report``."""
    warnings.simplefilter("ignore")
    whole = {kind.file: (folder / kind.file).read_bytes() for kind in KINDS}
    if without_seal:
        whole = {file: unsealed(file, content, folder) for file, content in whole.items()}
    expected = {(kind.file, k): read(folder / kind.file) for kind in KINDS for k, read in enumerate(kind.readers)}
    for number in range(first, first + count):
        rng = np.random.default_rng([seed, number])
        kind = KINDS[rng.integers(len(KINDS))]
        content = damaged(whole[kind.file], rng, list(whole.values()))
        stem, _, suffix = kind.file.rpartition(".")
        path = folder / f"{stem}-{number}.{suffix}"  # libraries keep open files by their names
        path.write_bytes(content)
        k = int(rng.integers(len(kind.readers)))
        report({"number": number, "file": kind.file, "reader": k, "outcome": "started"})
        detail = ""
        try:
            found = kind.readers[k](path)
        except SENTENCES as error:
            text = str(error)
            outcome, detail = ("refused", "") if text.strip() and "\n" not in text else ("no sentence", repr(error))
        except Exception as error:
            outcome, detail = "traceback", f"{type(error).__name__}: {error}"
        else:
            untouched = content == whole[kind.file] or same(found, expected[kind.file, k])
            outcome = "same content" if untouched else "other content"
        path.unlink()
        report({"number": number, "file": kind.file, "reader": k, "outcome": outcome, "detail": detail[:300]})


def campaign(folder: Path, count: int, seed: int = 0, *, without_seal: bool = False, timeout: float = 600.0,
             say: Callable[[str], None] = print) -> collections.Counter:
    """Outcomes of ``count`` damaged files by kind of file; crashes and hangs of a batch count as such.

    Parameters
    ----------
    folder : Path
        That :func:`make` has filled.
    """
    found: collections.Counter = collections.Counter()
    first = 0
    while first < count:
        size = min(BATCH, count - first)
        words = [sys.executable, __file__, "--batch", str(folder), *map(str, (seed, first, size, int(without_seal)))]
        try:
            done = subprocess.run(words, stdout=subprocess.PIPE, text=True, timeout=timeout, check=False)
            lines, code = done.stdout.splitlines(), done.returncode
        except subprocess.TimeoutExpired as error:
            lines, code = (error.stdout or b"").decode().splitlines(), "hang"
        records = [json.loads(line) for line in lines if line.endswith("}")]
        for record in records:
            if record["outcome"] != "started":
                found[record["file"], record["outcome"]] += 1
            if record["outcome"] in ("other content", "traceback", "no sentence"):
                say(json.dumps(record))
        if code != 0 and not records:
            raise RuntimeError(f"a batch did not start (exit status {code}): see its message above")
        if code != 0:
            last = records[-1]
            found[last["file"], "crash"] += 1
            say(f"batch ended with {code}: {json.dumps(last)}")
            first = last["number"] + 1
        else:
            first += size
        say(f"{first} of {count}")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--unsealed", action="store_true", help="take the seals off first")
    parser.add_argument("--quick", action="store_true", help="400 files")
    parser.add_argument("--batch", nargs=5, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.batch:
        folder, *numbers = arguments.batch
        resource.setrlimit(resource.RLIMIT_AS, (int(MEMORY), int(MEMORY)))
        seed, first, count, without_seal = map(int, numbers)
        batch(Path(folder), seed, first, count, bool(without_seal),
              lambda record: print(json.dumps(record), flush=True))
        return 0
    with tempfile.TemporaryDirectory() as name:
        make(Path(name))
        found = campaign(Path(name), 400 if arguments.quick else arguments.count, arguments.seed,
                         without_seal=arguments.unsealed)
    outcomes = sorted({outcome for _, outcome in found})
    print("".join(f"{word:>16}" for word in ("file", *outcomes)))
    for kind in KINDS:
        print("".join(f"{word!s:>16}" for word in (kind.file[:15], *(found[kind.file, one] for one in outcomes))))
    bad = {"traceback", "no sentence", "crash"} | (set() if arguments.unsealed else {"other content"})
    return int(any(number for (_, outcome), number in found.items() if outcome in bad))


if __name__ == "__main__":
    sys.exit(main())
