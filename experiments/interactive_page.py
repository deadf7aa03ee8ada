"""Is the interactive fingertip quick enough to the hand? Slider to picture, frames a second, start, the mailed file."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import script
import xarray as xr

from rom.interactive.export import export_page
from rom.interactive.models import REFERENCE, Models
from rom.interactive.surface_model import compress, deviation, from_bytes, to_bytes
from rom.reporting.figure import Figure, sheet

PAGES = ("served", "exported")
MOVES, PAUSE_MS = 100, 90
"""Steps of the frequency slider, and the time between two."""
WATCHED_S = 5.0
LAPTOP, PHONE = (1366, 768), (360, 740)
FLAGS = ("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run")
LONGEST_PICTURE, FEWEST_FRAMES, LONGEST_START, LARGEST_FILE, LARGEST_DEVIATION = 0.050, 30.0, 5.0, 5e6, 1e-3


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """Is the interactive fingertip quick enough to the hand, and is the mailed file right?"""
    tip = script.fingertip(quick)
    models = Models(tip, quick=quick)
    models.prepare(progress)
    model: Any = models.model(REFERENCE, True)
    frequencies, loss_factors = np.linspace(0, 300, 7 if quick else 31), np.array([0.05, 0.1, 0.3, 0.6, 1.0])
    off = deviation(model, from_bytes(to_bytes(compress(model))), frequencies, loss_factors)
    latency, frames, effort = np.full((2, MOVES), np.nan), np.empty(2), np.empty(2)
    load = np.empty(2)
    with tempfile.TemporaryDirectory() as folder, _server(quick) as (address, start), _chromium() as browser:
        file = Path(folder) / "fingertip.html"
        export_page(model, file)
        size = file.stat().st_size
        for i, (_, url) in enumerate(progress([*zip(PAGES, (address, f"file://{file}#"), strict=True)], "pages")):
            page = _open(browser, f"{url}{'?' if i == 0 else ''}f=100", LAPTOP)
            latency[i] = _slider_to_picture(page)
            frames[i], effort[i] = _frames(page)
            load[i] = os.getloadavg()[0]
            page.context.close()
    return xr.Dataset({
        "slider_to_picture": (("page", "move"), latency, {
            "long_name": "from the input event to after the frame was painted", "units": "s"}),
        "frame_rate": ("page", frames, {"long_name": "frames of the slow motion", "units": "s-1"}),
        "frame_effort": ("page", effort, {
            "long_name": "processor time of all of the browser for a frame", "units": "s"}),
        "load": ("page", load, {"long_name": "processes that wanted a core, mean of a minute", "units": "1"}),
        "start": ((), start, {"long_name": "from starting the command to its address, models cached", "units": "s"}),
        "file_size": ((), size, {"long_name": "size of the exported page", "units": "byte"}),
        **{f"deviation_{name}": ((), off[name], {"long_name": words, "units": "1"}) for name, words in (
            ("field", "largest difference at a pad node from modal-krylov, over the largest displacement"),
            ("norm", "largest relative difference of the pad's field from modal-krylov"),
            ("probe", "largest relative difference at the loaded node from modal-krylov"))}},
        coords={"page": list(PAGES)}, attrs={"fingertip": script.spoken(tip), "cores": os.cpu_count() or 0})


@contextmanager
def _server(quick: bool) -> Iterator[tuple[str, float]]:
    """Address of `rom serve`, and the seconds that it took to be there."""
    begin = time.perf_counter()
    command = [sys.executable, "-m", "rom.cli", "serve", "--port", "0", *(["--quick"] if quick else [])]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        found = re.search(r"http://\S+/", process.stdout.readline())  # type: ignore[union-attr]
        yield found[0], time.perf_counter() - begin  # type: ignore[index]
    finally:
        process.terminate()
        process.communicate()


@contextmanager
def _chromium() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    path = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        raise SystemExit("no Chromium here: run tests/browser/install_chromium.sh, or name one in $CHROMIUM")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        yield browser
        browser.close()


def _open(browser: Any, url: str, size: tuple[int, int], **options: Any) -> Any:
    page = browser.new_context(viewport={"width": size[0], "height": size[1]}, **options).new_page()
    page.goto(url)
    page.wait_for_selector("#view[data-shown]")
    page.wait_for_selector("#frf .u-over")
    return page


def _slider_to_picture(page: Any) -> np.ndarray:
    """Seconds of each step of the frequency slider, measured in the page, the slow motion running."""
    page.wait_for_timeout(2000)  # the first frames choose their resolution
    page.focus("#frequency")
    page.evaluate("""() => {
        window.moves = [];
        const take = list => window.moves.push(...list.getEntriesByName("slider-to-picture").map(one => one.duration));
        new PerformanceObserver(take).observe({type: "measure"}); }""")
    for i in range(MOVES):
        page.keyboard.press("ArrowRight" if i < MOVES // 2 else "ArrowLeft")
        page.wait_for_timeout(PAUSE_MS)
    page.wait_for_timeout(500)
    found = page.evaluate("() => window.moves")
    values = np.full(MOVES, np.nan)  # a step that was overtaken by the next has no picture of its own
    values[:len(found)] = np.array(found) / 1e3
    return values


def _frames(page: Any) -> tuple[float, float]:
    """Frames a second of the slow motion, and the browser's processor time for each [s]."""
    before = _processor_seconds()
    rate = page.evaluate("""async seconds => {
        const view = document.getElementById("view"), wait = ms => new Promise(done => setTimeout(done, ms));
        const before = Number(view.dataset.frames), start = performance.now();
        await wait(1000 * seconds);
        return 1000 * (Number(view.dataset.frames) - before) / (performance.now() - start); }""", WATCHED_S)
    return rate, (_processor_seconds() - before) / (rate * WATCHED_S)


def _processor_seconds() -> float:
    """Processor time that this process's browsers have spent so far; Linux alone says so, elsewhere it is NaN."""
    if not Path("/proc/self/stat").exists():
        return float("nan")
    parent, spent = {}, {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, rest = stat.read_text().rpartition(")")[::2]
        except OSError:  # it ended meanwhile
            continue
        fields, process = rest.split(), int(stat.parent.name)
        parent[process] = int(fields[1])
        if "chrom" in name:
            spent[process] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def is_ours(process: int) -> bool:
        while process > 1 and process != os.getpid():
            process = parent.get(process, 0)
        return process == os.getpid()

    return sum(seconds for process, seconds in spent.items() if is_ours(process))


def screenshots(results: xr.Dataset, folder: Path, quick: bool = False) -> list[Path]:
    """Pictures of the page as it is, and the exported file itself."""
    quick = quick or "--quick" in sys.argv
    models = Models(script.fingertip(quick), quick=quick)
    model: Any = models.model(REFERENCE, True)
    exported = folder / "fingertip.html"
    export_page(model, exported)
    shown = folder / "screenshots"
    shown.mkdir(exist_ok=True)
    pad, centre = model.scene.body.fingertip.mesh.pad_nodes, model.scene.body.fingertip.mesh.fingerprint_centroid
    two = f"forces={centre}:0.1,{pad[len(pad) // 5]}:0.05"
    shots = (("laptop", f"?{two}&f=207", LAPTOP, {}), ("phone", "?f=207", PHONE, {"device_scale_factor": 2}),
             ("cut", "?f=163&cut=y:0", LAPTOP, {}), ("dark", "?f=120&quantity=phase", LAPTOP, {"color_scheme": "dark"}),
             ("exported", f"#{two}&f=280&quantity=z", LAPTOP, {}))
    with _server(quick) as (address, _), _chromium() as browser:
        for name, query, size, options in shots:
            page = _open(browser, f"{exported.resolve().as_uri() if name == 'exported' else address}{query}", size,
                         reduced_motion="reduce", **options)
            page.wait_for_timeout(1500)
            page.screenshot(path=shown / f"{name}.png")
            if name == "laptop":
                page.locator("#response").screenshot(path=shown / "response.png")
            page.context.close()
    return [exported]


def gallery(results: xr.Dataset) -> list[str]:
    """The screenshots, beneath each other."""
    words = {"laptop": "Two forces at 207 Hz on a laptop's screen.", "phone": "On a phone.",
             "cut": "A cut along the finger at 163 Hz.", "response": "The frequency response.",
             "dark": "Phase, where the system is dark.", "exported": "The exported file, without a server."}
    return [f'<p>{text}</p><img src="screenshots/{name}.png" alt="{text}" style="max-width: 100%">'
            for name, text in words.items()]


def findings(results: xr.Dataset) -> list[str]:
    """The times and sizes, each beside what it must reach."""
    sentences = []
    for page in PAGES:
        values = results["slider_to_picture"].sel(page=page).dropna("move")
        late = float(values.quantile(0.95))
        sentences.append(f"Slider to picture, {page} page: median {1e3 * float(values.median()):.0f} ms, "
                         f"95th percentile {1e3 * late:.0f} ms over {values.size} moves (wanted: "
                         f"{1e3 * LONGEST_PICTURE:.0f} ms; {'met' if late <= LONGEST_PICTURE else 'not met'}).")
    rates = [float(results["frame_rate"].sel(page=page)) for page in PAGES]
    sentences.append(f"Slow motion: {rates[0]:.0f} frames a second served, {rates[1]:.0f} exported (wanted: "
                     f"{FEWEST_FRAMES:.0f}; {'met' if min(rates) >= FEWEST_FRAMES else 'not met'}), drawn without a "
                     f"graphics card on {results.attrs['cores']} cores, which {float(results['load'].mean()):.0f} "
                     f"processes wanted; a frame takes {1e3 * float(results['frame_effort'].mean()):.0f} ms of "
                     "processor time.")
    start, size = float(results["start"]), float(results["file_size"])
    sentences.append(f"Ready {start:.1f} s after the command with models cached (wanted: {LONGEST_START:.0f} s; "
                     f"{'met' if start <= LONGEST_START else 'not met'}).")
    off = max(float(results[f"deviation_{name}"]) for name in ("field", "norm", "probe"))
    sentences.append(f"The exported file has {size / 1e6:.1f} MB (wanted: below {LARGEST_FILE / 1e6:.0f}) and is "
                     f"off modal-krylov by at most {off:.1e} over every pad node, 0-300 Hz and loss factors 0.05-1 "
                     f"(wanted: {LARGEST_DEVIATION:g}; {'met' if off <= LARGEST_DEVIATION else 'not met'}).")
    return sentences


def draw(results: xr.Dataset) -> list[Figure]:
    """The share of moves that were on screen within a time."""
    figure = sheet(4.0, findings(results)[0], width=8.5)
    axes = figure.subplots()
    for page, colour in zip(PAGES, ("#0072b2", "#d55e00"), strict=True):
        values = np.sort(results["slider_to_picture"].sel(page=page).dropna("move").values)
        axes.step(1e3 * values, np.arange(1, len(values) + 1) / len(values), where="post", color=colour, label=page)
    axes.axvline(1e3 * LONGEST_PICTURE, color="#555555", linestyle=":", label="wanted at 95 %")
    axes.axhline(0.95, color="#555555", linewidth=0.6)
    axes.set_xlim(left=0)
    axes.set_xlabel("from slider to picture [ms]")
    axes.set_ylabel("share of the moves [-]")
    axes.legend()
    return [Figure("figure.png", figure, "Time from a move of the frequency slider to the painted picture.",
                   "Distribution of the time from slider to picture")]


if __name__ == "__main__":
    script.run(main, draw, findings, "interactive", tables=gallery, extra=screenshots)
