"""Vibrations as a scene to turn and play: one HTML file that needs nothing from elsewhere.

plotly.js, which the Python package brings along, draws the surface; a short script of our own moves it. Displacements
stand in the file as 16-bit integers of each vibration's largest component (3e-5 of it is rounded away, which no
screen shows), so that twenty vibrations add less than a tenth to plotly's own 5 MB.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from presentation.animation import COLOURS, DRAWN_AS, Vibration, check
from rom.files import whole_file
from rom.reporting import html

SCENE = "scene"
"""Id of the drawing in the page."""
_LARGEST = 32767

STYLE = """
#controls { display: flex; flex-wrap: wrap; gap: 0.6rem 1.6rem; align-items: center; margin: 0.6rem 0; }
#controls label { display: flex; gap: 0.5rem; align-items: center; }
#controls select, #controls button { font: inherit; padding: 0.2rem 0.5rem; }
#controls output { min-width: 9.5em; color: #595959; font-variant-numeric: tabular-nums; }
#stage { height: 66vh; min-height: 380px; }
"""

CONTROLS = """
<div id="controls">
<label>Show <select id="choice">{options}</select></label>
<button id="play" type="button">Pause</button>
<label>Phase <input id="phase" type="range" min="0" max="360" step="1" value="0"> <output id="degrees"></output></label>
<label>Largest drawn as <input id="drawn" type="range" min="0" max="4" step="0.1" value="{drawn}">
<output id="exaggeration"></output></label>
</div>
"""

# requestAnimationFrame waits for a drawing to end before it asks for the next, so slow machines drop frames only
SCRIPT = """
(() => {
  const given = JSON.parse(document.getElementById("vibrations").textContent);
  const at = id => document.getElementById(id);
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const scene = at("scene"), rest = given.position, n = rest[0].length, none = new Int16Array(3 * n);
  const shown = [0, 1, 2].map(() => new Float32Array(n));
  let current, real, imaginary, playing = true, phase = 0, last = null, busy = false, frames = 0;

  const digits = x => x >= 100 ? x.toFixed(0) : x.toPrecision(2);
  function choose() {
    current = given.vibrations[at("choice").value];
    real = current.real ? new Int16Array(bytes(current.real).buffer) : none;
    imaginary = current.imaginary ? new Int16Array(bytes(current.imaginary).buffer) : none;
    return draw({intensity: [Float32Array.from(bytes(current.size), x => x / 255)]});
  }
  function draw(more) {
    const drawn = Number(at("drawn").value), scale = drawn / current.largest;
    const c = Math.cos(phase) * scale, s = Math.sin(phase) * scale;
    for (let a = 0; a < 3; a++)
      for (let i = 0; i < n; i++)
        shown[a][i] = rest[a][i] + c * real[3 * i + a] - s * imaginary[3 * i + a];
    at("degrees").textContent = Math.round(phase * 180 / Math.PI) + "\\u00b0";
    at("phase").value = phase * 180 / Math.PI;
    at("exaggeration").textContent = drawn.toFixed(1) + " mm" + (current.millimetre
      ? " (\\u00d7" + digits(drawn / current.millimetre) + ")" : "");
    busy = true;
    return Plotly.restyle(scene, {x: [shown[0].slice()], y: [shown[1].slice()], z: [shown[2].slice()], ...more}, [0])
      .then(() => { busy = false; scene.dataset.frames = ++frames; });
  }
  function step(now) {
    if (playing && !busy) {
      if (last !== null) phase = (phase + 2 * Math.PI * (now - last) / given.period) % (2 * Math.PI);
      last = now;
      draw();
    }
    requestAnimationFrame(step);
  }
  at("choice").onchange = choose;
  at("drawn").oninput = () => draw();
  at("phase").oninput = () => { play(false); phase = at("phase").value * Math.PI / 180; draw(); };
  at("play").onclick = () => play(!playing);
  function play(on) { playing = on; last = null; at("play").textContent = on ? "Pause" : "Play"; }
  if (window.matchMedia("(prefers-reduced-motion: reduce)").matches) { play(false); phase = Math.PI / 2; }
  choose().then(() => requestAnimationFrame(step));
})();
"""


def write_interactive(
    path: str | Path,
    position: np.ndarray,
    quads: np.ndarray,
    vibrations: Sequence[Vibration],
    *,
    title: str,
    explanation: str = "",
    seconds: float = 2.0,
) -> Path:
    """Write the vibrations as one HTML file, whole or not at all.

    The page lets one choose the vibration, turn and zoom it, play and stop the cycle, and change the exaggeration.

    Parameters
    ----------
    path : str or Path
    position : (n_skin, 3) ndarray [mm]
        Of the skin's nodes at rest.
    quads : (m, 4) ndarray
        Rows of ``position``.
    vibrations : sequence of Vibration
        Listed by their groups, in the order given.
    title : str
        Of the page.
    explanation : str
        A sentence below it.
    seconds : float [s]
        How long one cycle takes on the screen.

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        For no vibration, or displacements of another number of nodes.
    """
    import plotly.io

    check(position, vibrations)
    figure = _figure(position, quads)
    plot = plotly.io.to_html(
        figure, include_plotlyjs=True, full_html=False, div_id=SCENE, default_width="100%", default_height="100%",
        config={"displaylogo": False, "responsive": True, "showSendToCloud": False,  # the page talks to nobody
                "modeBarButtons": [["toImage", "zoom3d", "pan3d", "tableRotation", "resetCameraDefault3d"]]})
    data = {"position": position.T.round(4).tolist(), "period": 1000 * seconds,
            "vibrations": [_record(one) for one in vibrations]}
    body = [
        f"<style>{STYLE}</style>", f"<h1>{html.text(title)}</h1>", html.paragraph(explanation, "question"),
        CONTROLS.format(options=_options(vibrations), drawn=DRAWN_AS), f'<div id="stage">{plot}</div>',
        f'<script type="application/json" id="vibrations">{_in_script(data)}</script>', f"<script>{SCRIPT}</script>"]
    path = Path(path)
    with whole_file(path) as temporary:
        temporary.write_text(html.document(title, body), encoding="utf-8")
    return path


def _figure(position: np.ndarray, quads: np.ndarray) -> Any:
    import plotly.graph_objects as go

    low, high = position.min(axis=0) - 2, position.max(axis=0) + 2
    i, j, k = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).T
    surface = go.Mesh3d(
        x=position[:, 0], y=position[:, 1], z=position[:, 2], i=i, j=j, k=k, intensity=np.zeros(len(position)),
        cmin=0, cmax=1, colorscale=COLOURS.capitalize(), flatshading=False, hoverinfo="skip",
        lighting={"ambient": 0.65, "diffuse": 0.6, "specular": 0.1, "roughness": 0.7},
        lightposition={"x": 40, "y": -200, "z": -200},
        colorbar={"title": {"text": "displacement amplitude<br>/ its largest [-]"}, "thickness": 16, "len": 0.7})
    axes = {f"{name}axis": {"range": [low[a], high[a]], "autorange": False, "title": {"text": f"{name} [mm]"},
                            "showspikes": False, "backgroundcolor": "#fafafa", "gridcolor": "#e0e0e0"}
            for a, name in enumerate("xyz")}
    ratio = (high - low) / (high - low).max()
    # seen from the pad's side, obliquely, the tip to the right
    camera = {"eye": {"x": 0.45, "y": -1.25, "z": -1.0}, "up": {"x": 0, "y": 0, "z": 1},
              "projection": {"type": "orthographic"}}
    return go.Figure(surface, layout={
        "scene": {**axes, "aspectmode": "manual", "aspectratio": dict(zip("xyz", 1.7 * ratio, strict=True)),
                  "camera": camera, "dragmode": "turntable"},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0}, "uirevision": "kept", "paper_bgcolor": "white"})


def _record(one: Vibration) -> dict[str, Any]:
    """What the script needs of a vibration; the largest amplitude in integer steps, and in mm where it has a size."""
    amplitude, size = one.amplitude, one.size
    unit = max(np.abs(amplitude.real).max(), np.abs(amplitude.imag).max()) / _LARGEST
    record: dict[str, Any] = {
        "size": _base64(np.rint(255 * size / size.max()).astype("u1")), "largest": float(size.max() / unit),
        "millimetre": float(size.max() * 1e3) if one.forced else None}
    for name, part in (("real", amplitude.real), ("imaginary", amplitude.imag)):
        if np.any(part):
            record[name] = _base64(np.rint(part / unit).astype("<i2"))
    return record


def _base64(values: np.ndarray) -> str:
    return base64.b64encode(values.tobytes()).decode()


def _options(vibrations: Sequence[Vibration]) -> str:
    lines = []
    for group, members in groupby(enumerate(vibrations), key=lambda pair: pair[1].group):
        options = "".join(f'<option value="{k}">{html.text(one.title)}</option>' for k, one in members)
        lines.append(f'<optgroup label="{html.text(group)}">{options}</optgroup>' if group else options)
    return "".join(lines)


def _in_script(data: Any) -> str:
    """JSON that no HTML parser can take for markup."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
