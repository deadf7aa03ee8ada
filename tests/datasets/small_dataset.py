"""Makes a dataset of 48 cases on a tiny mesh, 8 a piece, through the command line; run by tests beside themselves.

Usage: python small_dataset.py FILE [seconds to wait after each piece] [largest file in bytes]
"""

import resource
import signal
import sys
import time

import rom.fingertip.fingertip as fingertip
from rom import cli
from rom.commands import dataset
from rom.fingertip import MeshDensity
from rom.scenes import direct_truth

CASES, PIECE_CASES, SEED = 48, 8, 6


def announced(items, _):
    """Tell the test after each piece, and give it time to end this process."""
    for k in items:
        yield k
        print(f"piece {k}", flush=True)
        time.sleep(float(sys.argv[2]))


if __name__ == "__main__":
    fingertip.PRESETS["metamodel"] = MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))
    direct_truth.PIECE_CASES = PIECE_CASES
    dataset.bar = announced
    if len(sys.argv) > 3:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # so that a write fails as on a full disk
        limit = int(sys.argv[3])
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    sys.exit(cli.main(["dataset", "harmonic-point-force", "--cases", str(CASES), "--seed", str(SEED),
                       "--workers", "1", "--output", sys.argv[1]]))
