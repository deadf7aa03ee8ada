"""A real Chromium, the server as a process, and pages whose console and requests are watched."""

import os
import re
import shutil
import subprocess
import sys
from urllib.parse import urlsplit

import numpy as np
import pytest

from rom.fingertip import Fingertip
from rom.metamodels import create
from rom.scenes import CaseArrays, get_scene

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = ("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run")
PATIENCE = 30_000  # ms


def pytest_collection_modifyitems(items):
    for item in items:
        if item.path.parent.name == "browser":
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="module")  # not the session's: the driver's event loop must end before other tests start theirs
def chromium():
    if CHROMIUM is None:
        pytest.skip("no Chromium here: run tests/browser/install_chromium.sh, or name one in $CHROMIUM")
    driver = pytest.importorskip("playwright.sync_api", reason="Python's playwright is not installed")
    with driver.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        yield browser
        browser.close()


class Visit:
    """One page in a browser of its own, with what it said and asked for; still, unless motion is asked for."""

    def __init__(self, browser, address, **options):
        self.context = browser.new_context(**{
            "viewport": {"width": 1100, "height": 700}, "reduced_motion": "reduce", **options})
        self.context.set_default_timeout(PATIENCE)
        self.page = self.context.new_page()
        self.errors, self.requests = [], []
        self.page.on("console", lambda one: self.errors.append(one.text) if one.type in ("error", "warning") else None)
        self.page.on("pageerror", lambda one: self.errors.append(str(one)))
        self.page.on("request", lambda one: self.requests.append(one.url))
        self.page.on("websocket", lambda one: self.requests.append(one.url))
        self.page.goto(address)
        self.page.wait_for_selector("#view[data-shown]")

    def shows(self, *parts):
        """Wait until the picture is that of a state whose address holds all these parts."""
        self.page.wait_for_function(
            "parts => parts.every(one => document.getElementById('view').dataset.shown.includes(one))", arg=list(parts))

    def figure(self, name):
        return float(self.page.get_attribute(f"#{name}", "data-value"))

    def normal(self):
        """Displayed displacement into the skin at the probe [m], complex."""
        return complex(*(float(self.page.get_attribute("#probe-normal", f"data-{part}")) for part in ("re", "im")))

    def click_at(self, place, target=(12.0, 0.0, 0.0), camera=(12.0, 0.0, -90.0)):
        """Click where a point [mm] is drawn, seen by a camera that was set by the address."""
        box = self.page.locator("#view").bounding_box()
        forward = np.subtract(target, camera) / np.linalg.norm(np.subtract(target, camera))
        right = np.cross(forward, [1.0, 0.0, 0.0])  # the finger points up
        right /= np.linalg.norm(right)
        offset = np.subtract(place, camera)
        unit = box["height"] / 2 / np.tan(np.radians(15.0)) / (offset @ forward)  # field of view: 30 degrees
        self.page.mouse.click(box["x"] + box["width"] / 2 + unit * (offset @ right),
                              box["y"] + box["height"] / 2 - unit * (offset @ np.cross(right, forward)))

    def outside(self):
        """Requests to anything but files, inlined data and loopback."""
        allowed = ("data", "blob", "file")
        return [url for url in self.requests
                if urlsplit(url).scheme not in allowed and urlsplit(url).hostname != "127.0.0.1"]


@pytest.fixture
def visit(chromium):
    """Open an address; at the end no page may have complained or asked anyone else."""
    visits = []

    def open_page(address, **options):
        visits.append(Visit(chromium, address, **options))
        return visits[-1]

    yield open_page
    for one in visits:
        one.context.close()
    assert [error for one in visits for error in one.errors] == []
    assert [url for one in visits for url in one.outside()] == []


@pytest.fixture(scope="session")
def coarse_tip():
    """The fingertip of `rom serve --quick`."""
    return Fingertip.preset("quick")


@pytest.fixture(scope="session")
def krylov(coarse_tip):
    return create("modal-krylov", get_scene("harmonic-point-force", coarse_tip), modes=40, vectors=6).fit()


@pytest.fixture(scope="session")
def answer(krylov):
    """The Python answer at a pad node [m]: the vector, and its part into the skin."""
    mesh = krylov.scene.body.fingertip.mesh

    def displacement(forces, frequency, loss_factor, node):
        loads = np.searchsorted(mesh.pad_nodes, [one for one, _ in forces])
        cases = CaseArrays(loads[None], np.array([[force for _, force in forces]], dtype=float),
                           np.array([float(frequency)]), np.array([float(loss_factor) if frequency else 0.0]))
        u = krylov.evaluate(cases, "pad").reshape(-1, 3)[np.searchsorted(mesh.pad_nodes, node)]
        return u, -(u @ mesh.normals[node])

    return displacement


@pytest.fixture(scope="session")
def server(subprocess_environment):
    """Address of `rom serve --quick`."""
    process = subprocess.Popen([sys.executable, "-m", "rom.cli", "serve", "--quick", "--port", "0"],
                               env=subprocess_environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        yield re.search(r"http://\S+/", process.stdout.readline())[0]
    finally:
        process.terminate()
        process.communicate(timeout=20)
