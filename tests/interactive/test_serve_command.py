"""`rom serve` as a process: address, port in use, Ctrl-C."""

import re
import signal
import socket
import subprocess
import sys
import urllib.request

import pytest

from rom.cli import main


@pytest.fixture
def server(subprocess_environment):
    process = subprocess.Popen(
        [sys.executable, "-m", "rom.cli", "serve", "--quick", "--port", "0"], env=subprocess_environment,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def test_it_prints_its_address_and_ends_cleanly(server):
    line = server.stdout.readline()
    address = re.search(r"http://127\.0\.0\.1:\d+/", line)
    assert address, server.stderr.read()
    with urllib.request.urlopen(address[0]) as response:
        assert response.status == 200
    port = address[0].rstrip("/").rpartition(":")[2]
    second = subprocess.run([sys.executable, "-m", "rom.cli", "serve", "--quick", "--port", port],
                            capture_output=True, text=True, timeout=60)
    assert second.returncode == 2
    assert second.stderr == f"rom: port {port} is in use: give another with --port, or --port 0 for a free one\n"
    server.send_signal(signal.SIGINT)
    _, errors = server.communicate(timeout=20)
    assert server.returncode == 0
    assert "Traceback" not in errors


@pytest.mark.parametrize("options", [
    ["--port", "-1"], ["--port", "65536"], ["--port", "http"], ["--port", "9" * 4000], ["--port", "٨٠٨٠"],
    ["--host", "256.1.1.1"], ["--host", "no such host"], ["--host", "x" * 300], ["--host", "198.51.100.7"],
    ["--preset", "magic"], ["--set", "dermis_thickness=-1"], ["--rear", "loose"]])
def test_what_cannot_be_is_refused_in_one_sentence(options, capsys):
    try:
        code = main(["serve", "--port", "0", *options])
    except SystemExit as exit:
        code = exit.code
    errors = capsys.readouterr().err
    assert code == 2
    assert errors.startswith("rom: ")
    assert errors.count("\n") == 1
    assert len(errors) < 500


def test_a_taken_port_is_known_before_anything_is_computed(capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        assert main(["serve", "--port", str(taken.getsockname()[1])]) == 2
    assert "is in use" in capsys.readouterr().err
