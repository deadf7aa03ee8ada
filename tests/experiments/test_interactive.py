"""The interactive page holds what it shows, asks nobody for anything, and holds it precisely enough."""

import base64
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest
from presentation import interactive
from presentation.animation import Vibration
from presentation.interactive import write_interactive


class Parts(HTMLParser):
    """Addresses that a browser would load, and the contents of the scripts."""

    def __init__(self, text):
        super().__init__()
        self.addresses, self.scripts, self.options, self._inside = [], [], [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        if tag != "a":
            self.addresses += [given[name] for name in ("src", "href", "data", "srcset", "action") if name in given]
        if tag == "script":
            self.scripts.append((given, ""))
        self.options += [given["value"]] if tag == "option" else []
        self._inside = tag

    def handle_data(self, data):
        if self._inside == "script":
            given, text = self.scripts.pop()
            self.scripts.append((given, text + data))

    def handle_endtag(self, tag):
        self._inside = ""


@pytest.fixture(scope="module")
def vibrations(small_tip):
    mesh, rng = small_tip.mesh, np.random.default_rng(0)
    values = rng.standard_normal((2, len(mesh.skin_nodes), 3))
    return [Vibration("Mode 1, <120 Hz>", values[0], "Free modes"),
            Vibration("normal, 50 Hz", 3e-5 * (values[0] + 1j * values[1]), "Forced by 0.1 N")]


@pytest.fixture(scope="module")
def page(small_tip, vibrations, tmp_path_factory):
    mesh = small_tip.mesh
    return write_interactive(tmp_path_factory.mktemp("scene") / "scene.html", mesh.nodes[mesh.skin_nodes] * 1e3,
                             mesh.skin_quads, vibrations, title="Vibrations", explanation="A & B")


@pytest.fixture(scope="module")
def parts(page):
    return Parts(page.read_text(encoding="utf-8"))


def test_the_page_loads_nothing_from_elsewhere(parts):
    assert parts.addresses == []
    text = "".join(text for given, text in parts.scripts if given.get("type") != "application/json"
                   and "plotly.js v" not in text[:2000])
    assert "Plotly.restyle" in text  # our own script is among what is searched
    called = {"fetch(", "XMLHttpRequest", "import(", "WebSocket", "sendBeacon", "@import", "url(", "cdn"}
    assert not {word for word in called if word in text}
    assert not re.findall(r"https?://", text)
    # plotly's own button that would send the figure to a server stays away
    assert '"showSendToCloud": false' in text or '"showSendToCloud":false' in text


def test_the_page_holds_every_vibration_to_sixteen_bits(parts, vibrations, small_tip):
    data = json.loads(next(text for given, text in parts.scripts if given.get("id") == "vibrations"))
    assert parts.options == ["0", "1"]
    mesh = small_tip.mesh
    np.testing.assert_allclose(data["position"], mesh.nodes[mesh.skin_nodes].T * 1e3, atol=1e-4)
    for record, one in zip(data["vibrations"], vibrations, strict=True):
        found = np.zeros(one.displacement.shape, dtype=complex)
        for name, factor in (("real", 1), ("imaginary", 1j)):
            if name in record:
                found += factor * np.frombuffer(base64.b64decode(record[name]), "<i2").reshape(found.shape)
        # drawn = integers x (slider / largest): so that the largest amplitude is drawn as the slider says
        np.testing.assert_allclose(found / record["largest"], one.amplitude / one.size.max(), atol=2e-5)
        size = np.frombuffer(base64.b64decode(record["size"]), "u1") / 255
        np.testing.assert_allclose(size, one.size / one.size.max(), atol=0.5 / 255 + 1e-12)
    free, forced = data["vibrations"]
    assert "real" not in free and free["millimetre"] is None  # a mode is a pure sine and has no size
    assert forced["millimetre"] == pytest.approx(vibrations[1].size.max() * 1e3)


def test_titles_cannot_break_the_page(page):
    text = page.read_text(encoding="utf-8")
    assert "Mode 1, &lt;120 Hz&gt;" in text and "<120 Hz>" not in text
    assert "A &amp; B" in text


def test_the_page_is_one_file_of_a_few_megabytes(page):
    assert [path.name for path in page.parent.iterdir()] == ["scene.html"]
    assert page.stat().st_size < 6e6


def test_no_vibration_is_refused(small_tip, tmp_path):
    mesh = small_tip.mesh
    with pytest.raises(ValueError, match="no vibration"):
        write_interactive(tmp_path / "a.html", mesh.nodes[mesh.skin_nodes], mesh.skin_quads, [], title="")
    assert not list(tmp_path.iterdir())


def test_the_script_is_whole_javascript(tmp_path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node to parse it")
    path = tmp_path / "script.js"
    path.write_text(interactive.SCRIPT, encoding="utf-8")
    assert subprocess.run([node, "--check", str(path)], timeout=60).returncode == 0
