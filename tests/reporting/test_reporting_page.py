"""The report as a whole: files that appear complete, a page that stands alone, nothing raw or unescaped on it."""

from __future__ import annotations

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from PIL import Image
from synthetic_contact import make_contact
from synthetic_results import HARMONIC, make

from rom.datasets.storage import read_netcdf, write_netcdf
from rom.reporting import verdict, write_index, write_report
from rom.reporting.report import page
from rom.reporting.results import Results

TWO = {"direct": [("", 0.1, 0.0, 0.0, 0.0, 0.0)], "superposition": [("", 1e-4, 1e-14, 1e-14, 1e-14, 1.0)]}
VOID = {"meta", "img", "br", "hr"}


class Reader(HTMLParser):
    """Collects images, links and visible text; refuses tags that do not match."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images: list[dict] = []
        self.links: list[str] = []
        self.ids: list[str] = []
        self.words = ""
        self.feed(page.read_text(encoding="utf-8"))
        assert not self.open

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.ids += [values["id"]] if "id" in values else []
        self.images += [values] if tag == "img" else []
        self.links += [values["href"]] if tag == "a" else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] != "style":
            self.words += " " + data.replace("\u00a0", " ")


@pytest.fixture
def coarse(monkeypatch):
    """Fewer pixels, where nobody looks."""
    monkeypatch.setattr("rom.reporting.figure.DPI", 40)


@pytest.fixture(scope="module", params=["harmonic", "static", "contact"])
def report(request, tmp_path_factory):
    """A report written from results that went through a file, as the command does it."""
    folder = tmp_path_factory.mktemp(request.param)
    write_netcdf(make_contact() if request.param == "contact" else make(request.param), folder / "results.nc")
    results = read_netcdf(folder / "results.nc")
    return results, write_report(results, folder)


ALWAYS = {"work-precision.png", "work-precision-elsewhere.png", "error-over-inputs.png", "error-by-region.png",
          "speed-up.png", "offline-cost.png", "timing-spread.png", "worst-fields.png"}
OF_KIND = {"harmonic": {"effectivity.png"}, "static": set(),
           "contact": {"error-over-positions.png", "error-by-quantity.png", "worst-curves.png"}}


def test_every_figure_is_written_and_shown(report):
    _, path = report
    shown = [image["src"] for image in Reader(path).images]
    assert set(shown) == ALWAYS | OF_KIND[path.parent.name.rstrip("0123456789")]
    assert shown[0] == "work-precision.png"
    assert len(shown) == len(set(shown))
    for file in shown:
        content = (path.parent / file).read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) > 15_000


def test_a_point_lies_where_its_method_is_drawn(report):
    results, path = report
    found = Results(results)
    place = re.compile(r'class="point[^"]*" style="left:([\d.]+)%;top:([\d.]+)%" data-words="([^"]*)"')
    lead = path.read_text(encoding="utf-8").partition('id="work-precision"')[2].partition("</figure>")[0]
    points = {words.partition(": ")[0]: (float(left), float(top)) for left, top, words in place.findall(lead)}
    assert set(points) == {found.name(i) for i in range(len(found.method))}
    image = np.asarray(Image.open(path.parent / "work-precision.png").convert("RGB"), dtype=float)
    hit = []
    for method in found.reduced:  # the full solves hide each other
        left, top = points[found.name(found.headline(method))]
        row, column = round(top / 100 * image.shape[0]), round(left / 100 * image.shape[1])
        near = image[row - 4:row + 5, column - 4:column + 5].reshape(-1, 3)
        colour = np.array([int(found.style(method).colour[k:k + 2], 16) for k in (1, 3, 5)])
        hit.append(bool((abs(near - colour).max(axis=1) < 12).any()))
    assert all(hit)


def test_nothing_is_left_half_written(report):
    _, path = report
    assert sorted(p.suffix for p in path.parent.iterdir() if p.suffix not in (".png", ".html")) == [".nc"]


def test_page_names_every_method_and_setting(report):
    results, path = report
    words = Reader(path).words
    for name in np.concatenate([results["method"].values, results["setting"].values]):
        assert str(name) in words


def test_page_stands_alone(report):
    _, path = report
    text, reader = path.read_text(encoding="utf-8"), Reader(path)
    assert "<script" not in text
    assert "http" not in text
    assert "url(" not in text
    assert all(len(image["alt"]) > 20 for image in reader.images)
    assert set(reader.links) == {image["src"] for image in reader.images}  # each opens its image
    assert len(reader.ids) == len(set(reader.ids))


def test_no_raw_numbers_on_the_page(report):
    _, path = report
    words = Reader(path).words
    assert not re.search(r"\b(nan|inf|None)\b", words)
    assert not re.search(r"\d[eE][-+]\d", words)
    assert not re.search(r"\d\.\d{6,}", words)


def test_page_shows_provenance(report):
    results, path = report
    words = Reader(path).words
    for name in ("machine", "backend", "software_versions", "commit", "created"):
        assert results.attrs[name] in words


def test_verdict_figure_and_table_come_before_everything_that_opens_on_demand(report):
    _, path = report
    text = path.read_text(encoding="utf-8")
    assert text.index("Cheapest within") < text.index("<img") < text.index("<table") < text.index("<details")
    assert text.count("<img", 0, text.index("<details")) == text.count("<table", 0, text.index("<details")) == 1


def test_html_is_escaped():
    data = make("static", {"direct": [("", 0.1, 0.0, 0.0, 0.0, 0.0)], "<b>&mine": [("a<1", 0.01, 0.1, 0.1, 0.1, 1.0)]})
    data.attrs["title"] = "<script>alert(1)</script>"
    data.attrs["omitted"] = '["rank<3 & more"]'
    text = page(Results(data), {})
    assert "<script" not in text
    assert "<b>&mine" not in text
    assert "&lt;b&gt;&amp;mine" in text
    assert "rank&lt;3 &amp; more" in text


def test_quick_run_says_so():
    data = make("static", TWO)
    assert "quick run" not in page(Results(data), {})
    data.attrs["quick"] = np.int64(1)
    assert "quick run" in page(Results(data), {})


def test_one_method_alone(tmp_path, coarse):
    written = write_report(make("harmonic", {"direct": HARMONIC["direct"]}), tmp_path)
    assert "only direct can be trusted" in Reader(written).words


def test_numbers_that_are_missing(tmp_path, coarse):
    """NaN, infinite and absent values: a method whose fit failed, no natural modes, a part without cases."""
    data = make("harmonic", {k: HARMONIC[k][:2] for k in ("direct", "modal-krylov", "mlp")}, cases=60)
    for name in ("error_max", "error_p95", "error_median", "online_seconds", "batch_seconds", "output_seconds",
                 "offline_seconds", "fit_seconds", "model_bytes",
                 "call_seconds"):
        data[name] = data[name].astype(float).where(~data["method"].isin(["mlp"]))
    data["case_error"] = data["case_error"].where(~data["method"].isin(["mlp"]))
    data["online_seconds"] = data["online_seconds"].where(data["method"] != "modal-krylov", 1.0)  # slower than direct
    data["error_by_region"][:, 2] = np.nan
    data = data.drop_vars(["natural_frequency", "worst_truth", "mesh_floor_max"])
    (tmp_path / "worst-fields.png").write_bytes(b"of an earlier report")
    (tmp_path / "mine.png").write_bytes(b"of somebody else")
    (tmp_path / "index.html").write_text('<img src="worst-fields.png" alt="as it was">', encoding="utf-8")
    written = write_report(data, tmp_path)
    words = Reader(written).words
    assert "never" in words
    assert not re.search(r"\b(nan|inf)\b", words)
    assert not (tmp_path / "worst-fields.png").exists()
    assert (tmp_path / "mine.png").exists()


def test_methods_judged_on_fewer_cases_say_so():
    data = make("static")
    assert "over fewer held-out cases" not in page(Results(data), {})
    data["case_error"] = data["case_error"].where((data["method"] != "coarse-fem") | (data["case"] > 150))
    text = page(Results(data), {})
    assert "Errors of coarse-fem are over fewer held-out cases" in text
    assert re.search(r"\(\d+ of \d+ cases\)", text)


def test_results_without_a_baseline_are_refused(tmp_path):
    data = make("static")
    with pytest.raises(ValueError, match="lack the method 'direct'"):
        write_report(data.isel(entry=data["method"].values != "direct"), tmp_path)
    with pytest.raises(ValueError, match="lack online_seconds"):
        write_report(data.drop_vars("online_seconds"), tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_failed_figure_leaves_the_old_page(tmp_path, monkeypatch):
    data = make("static", TWO)
    (tmp_path / "index.html").write_bytes(b"an earlier page")

    def full(*_, **__):
        raise OSError("no space left on device")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    with pytest.raises(OSError, match="no space"):
        write_report(data, tmp_path)
    assert (tmp_path / "index.html").read_bytes() == b"an earlier page"
    assert not list(tmp_path.glob(".*partial"))


def test_front_page_shows_a_card_for_everything_in_a_newcomers_order(tmp_path):
    data = make(HARMONIC)
    for name in ("mine", "harmonic-point-force", "static-point-forces"):
        write_netcdf(data.assign_attrs(title=f"{name} <forces>", question="How <far>?"), tmp_path / name / "results.nc")
    for name in ("two-things", "vibration-modes"):
        write_netcdf(xr.Dataset(attrs={"finding": "Take A & B.", "question": "Why?"}), tmp_path / name / "results.nc")
    (tmp_path / "two-things" / "index.html").write_text('<img src="a.png" alt="A &amp; B">', encoding="utf-8")
    reader = Reader(write_index(tmp_path))
    pages = list(dict.fromkeys(reader.links))
    assert pages == [f"{name}/index.html" for name in (
        "static-point-forces", "harmonic-point-force", "mine", "vibration-modes", "two-things")]
    assert [(image["src"], image["alt"]) for image in reader.images] == [("two-things/a.png", "A & B")]
    for words in ("mine <forces>", "How <far>?", verdict(data), "Two things", "Take A & B.", "Why?"):
        assert words in reader.words


PLATE = xr.Dataset(
    {"error_max": (("entry", "split"), [[0.0], [1e-3]]),
     "online_seconds": (("entry", "repeat"), [[1e-2] * 3, [1e-4] * 3])},
    coords={"method": ("entry", ["direct", "modal"]), "setting": ("entry", ["", "modes=2"]),
            "headline": ("entry", [True, True]), "split": ["all"]}, attrs={"gate": 0.01, "title": "A plate"})


def test_a_body_without_a_grid_needs_neither_places_nor_fields(tmp_path, coarse):
    """The least that a comparison can say: no cases, no inputs, no preparation, no mesh, one split."""
    reader = Reader(write_report(PLATE, tmp_path))
    assert "modal (modes=2), 100 × faster than direct for one case, at most 0.1 % off." in reader.words
    assert not re.search(r"\b(nan|inf|None|finger|pad)\b", reader.words)
    assert [image["src"] for image in reader.images] == ["work-precision.png", "speed-up.png", "timing-spread.png"]


def test_words_come_from_the_results(tmp_path, coarse):
    data = PLATE.assign_attrs(case_noun="blow", partial_output="two corners", full_order='["modal", "direct"]',
                              method_colours='{"modal": "#ABCDEF", "direct": "#123456"}')
    data["output_seconds"] = "entry", [1e-3, 2e-3]
    found = Results(data)
    assert (found.truth, found.solvers, found.style("modal").colour) == ("modal", ["modal", "direct"], "#ABCDEF")
    words = Reader(write_report(data, tmp_path)).words
    assert "One blow at a time" in words and "Only the two corners" in words
    assert re.search(r"Truth:\s+modal", words)


def test_reporting_draws_without_pyplot_and_imports_without_matplotlib(tmp_path):
    script = ("import sys; import rom.reporting; assert 'matplotlib' not in sys.modules; "
              "from synthetic_results import make; from rom.reporting.results import Results; "
              "from rom.reporting.cost import timing; from pathlib import Path; "
              "timing(Results(make('static'))).write(Path(sys.argv[1])); assert 'matplotlib.pyplot' not in sys.modules")
    paths = f"import sys; sys.path[:0] = [{str(Path(__file__).parent)!r}, {str(Path(__file__).parents[2])!r}]; "
    subprocess.run([sys.executable, "-c", paths + script, str(tmp_path)], check=True)
    assert (tmp_path / "timing-spread.png").exists()
