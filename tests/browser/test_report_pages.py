"""Reports in a real browser: what the first screen shows, on a telephone, under the pointer, on paper."""

from pathlib import Path

import pytest
from PIL import Image

from rom.datasets.storage import read_netcdf
from rom.reporting import write_index, write_report
from rom.reporting.figure import Figure

REPORTS = Path(__file__).parents[2] / "reports"
SCENES = sorted(file.parent.name for file in REPORTS.glob("*/results.nc") if file.parent.joinpath(
    "work-precision.png").exists())
OPEN = "document.querySelectorAll('details').forEach(one => { one.open = true; })"


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Folder of the comparisons that are tracked here, drawn anew, and a front page over them."""
    folder = tmp_path_factory.mktemp("reports")
    whole = Figure.write

    def write(figure, where):
        if figure.file == "work-precision.png":
            whole(figure, where)
        else:  # its size is enough here, and drawing takes long
            size = tuple(int(60 * length) for length in figure.figure.get_size_inches())
            Image.new("RGB", size).save(where / figure.file)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "write", write)
        for name in SCENES:
            (folder / name).mkdir()
            (folder / name / "results.nc").symlink_to(REPORTS / name / "results.nc")
            write_report(read_netcdf(REPORTS / name / "results.nc"), folder / name)
    write_index(folder)
    return folder


@pytest.fixture
def show(chromium, pages):
    """Open a page of some size; at the end nobody may have complained or asked anyone else."""
    contexts, wrong = [], []

    def opened(name, width, height):
        contexts.append(chromium.new_context(viewport={"width": width, "height": height}))
        page = contexts[-1].new_page()
        page.on("console", lambda one: wrong.append(one.text))
        page.on("request", lambda one: None if one.url.startswith("file:") else wrong.append(one.url))
        page.goto(f"file://{pages / name}")
        return page

    yield opened
    for one in contexts:
        one.close()
    assert wrong == []


@pytest.mark.parametrize("name", SCENES)
def test_the_first_screen_holds_the_verdict_and_the_first_figure(show, name):
    page = show(f"{name}/index.html", 1366, 768)
    for part in (".verdict", ".first img"):
        box = page.locator(part).bounding_box()
        assert box["y"] >= 0 and box["y"] + box["height"] <= 768
    assert 3 <= page.locator(".verdict li").count() <= 5


@pytest.mark.parametrize("name", [*(f"{name}/index.html" for name in SCENES), "index.html"])
def test_nothing_scrolls_sideways_on_a_telephone(show, name):
    page = show(name, 380, 800)
    page.evaluate(OPEN)
    assert page.evaluate("document.documentElement.scrollWidth") <= 380
    assert page.evaluate("[...document.querySelectorAll('.wide')].every(one => one.scrollWidth <= one.clientWidth + 1)")


def test_a_cell_names_its_column_on_a_telephone(show):
    page = show(f"{SCENES[0]}/index.html", 380, 800)
    told = page.evaluate("""[...document.querySelectorAll('h2 + .wide td')].map(
        one => getComputedStyle(one, '::before').content)""")
    assert {'"method"', '"largest error"', '"speed-up"', '"preparation"'} <= set(told)


@pytest.mark.parametrize("width", [1366, 380])
def test_a_point_names_its_setting_and_widens_no_page(show, width):
    page = show("harmonic-point-force/index.html", width, 768)
    points = page.locator(".first .point")
    said = points.evaluate_all("all => all.map(one => one.dataset.words)")
    results = read_netcdf(REPORTS / "harmonic-point-force" / "results.nc")
    assert len(said) == results.sizes["entry"]
    for setting in results["setting"].values:
        assert any(str(setting) in one for one in said)
    for k in (0, len(said) - 1):
        points.nth(k).hover(force=True)
        assert page.evaluate("""[...document.querySelectorAll('.point')].some(
            one => one.matches(':hover') && getComputedStyle(one, '::after').content.length > 10)""")
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_a_link_opens_its_section(show):
    page = show("harmonic-point-force/index.html#bounds", 1366, 768)
    assert page.evaluate("document.getElementById('bounds').parentElement.open")
    assert not page.evaluate("document.getElementById('cost').parentElement.open")


def test_paper_shows_every_section(show):
    page = show("harmonic-point-force/index.html", 1366, 768)
    seen = "[...document.querySelectorAll('details > div')].map(one => one.checkVisibility())"
    assert not any(page.evaluate(seen))
    page.emulate_media(media="print")
    assert all(page.evaluate(seen))


def test_the_front_page_leads_to_every_comparison(show):
    page = show("index.html", 1366, 768)
    assert page.locator(".card").count() == len(SCENES)
    for k in range(len(SCENES)):
        card = page.locator(".card").nth(k)
        assert card.locator("img").evaluate("one => one.complete && one.naturalWidth > 0")
        assert len(card.inner_text().splitlines()) >= 3  # title, question, answer
