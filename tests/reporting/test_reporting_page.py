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
from synthetic_contact import make_contact
from synthetic_results import HARMONIC, make

from rom.datasets.storage import read_netcdf, write_netcdf
from rom.reporting import verdict, write_index, write_report
from rom.reporting.page import page
from rom.reporting.report import FIGURES
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
            self.words += " " + data


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


def test_every_figure_is_written_and_shown(report):
    results, path = report
    of_paths = {"error-along-path.png", "contact-quantities.png", "error-by-fibres.png", "worst-paths.png",
                "worst-sections.png"}
    linear = {"error-over-frequency.png", "error-over-forces.png", "worst-fields.png", "effectivity.png"}
    if "position_error" in results:
        expected = set(FIGURES) - linear
    elif "frequency" in results.variables:
        expected = set(FIGURES) - of_paths - {"error-over-forces.png"}
    else:
        expected = set(FIGURES) - of_paths - {"error-over-frequency.png", "effectivity.png"}
    expected -= {"error-over-population.png", "pad-map.png", "fewer-snapshots.png"}  # of trained weights
    shown = [image["src"] for image in Reader(path).images]
    assert set(shown) == expected
    assert len(shown) == len(expected)
    for file in shown:
        content = (path.parent / file).read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) > 15_000


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
    assert all(link.lstrip("#") in reader.ids for link in reader.links)
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


def test_verdict_comes_before_tables_and_figures(report):
    _, path = report
    text = path.read_text(encoding="utf-8")
    assert text.index("Cheapest within") < text.index("<table") < text.index("<img")


def test_html_is_escaped():
    data = make("static", {"direct": [("", 0.1, 0.0, 0.0, 0.0, 0.0)], "<b>&mine": [("a<1", 0.01, 0.1, 0.1, 0.1, 1.0)]})
    data.attrs["title"] = "<script>alert(1)</script>"
    data.attrs["omitted"] = '["rank<3 & more"]'
    text = page(Results(data), [])
    assert "<script" not in text
    assert "<b>&mine" not in text
    assert "&lt;b&gt;&amp;mine" in text
    assert "rank&lt;3 &amp; more" in text


def test_quick_run_says_so():
    data = make("static", TWO)
    assert "quick run" not in page(Results(data), [])
    data.attrs["quick"] = np.int64(1)
    assert "quick run" in page(Results(data), [])


def test_one_method_alone(tmp_path, coarse):
    written = write_report(make("harmonic", {"direct": HARMONIC["direct"]}), tmp_path)
    assert "only direct can be trusted" in Reader(written).words


def test_numbers_that_are_missing(tmp_path, coarse):
    """NaN, infinite and absent values: a method whose fit failed, no natural modes, a part without cases."""
    data = make("harmonic", {k: HARMONIC[k][:2] for k in ("direct", "modal-krylov", "mlp")}, cases=60)
    bad = data["method"].values == "mlp"
    for name in ("error_max", "error_p95", "error_median", "online_seconds", "batch_seconds", "output_seconds",
                 "speedup", "batch_speedup", "output_speedup", "offline_seconds", "fit_seconds", "model_bytes",
                 "call_seconds"):
        data[name] = data[name].astype(float).where(~data["method"].isin(["mlp"]))
    data["case_error"] = data["case_error"].where(~data["method"].isin(["mlp"]))
    data["break_even_cases"][:] = np.where(bad, np.nan, np.inf)
    data["error_by_region"][:, 2] = np.nan
    data = data.drop_vars(["natural_frequency", "worst_truth", "mesh_floor_max"])
    (tmp_path / "worst-fields.png").write_bytes(b"of an earlier report")
    written = write_report(data, tmp_path)
    words = Reader(written).words
    assert "never" in words
    assert not re.search(r"\b(nan|inf)\b", words)
    assert not (tmp_path / "worst-fields.png").exists()


def test_methods_judged_on_fewer_cases_say_so():
    data = make("static")
    assert "over fewer held-out cases" not in page(Results(data), [])
    data["case_error"] = data["case_error"].where((data["method"] != "coarse-fem") | (data["case"] > 150))
    text = page(Results(data), [])
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


def test_front_page_links_comparisons_and_experiments(tmp_path):
    data = make(HARMONIC)
    write_netcdf(data.assign_attrs(title="Static <forces>"), tmp_path / "static" / "results.nc")
    write_netcdf(xr.Dataset(attrs={"finding": "Take A & B."}), tmp_path / "two-things" / "results.nc")
    reader = Reader(write_index(tmp_path))
    assert reader.links == ["static/index.html", "two-things/index.html"]
    assert "Static <forces>" in reader.words
    assert verdict(data) in reader.words
    assert "Two things" in reader.words
    assert "Take A & B." in reader.words


def test_reporting_draws_without_pyplot_and_imports_without_matplotlib(tmp_path):
    script = ("import sys; import rom.reporting; assert 'matplotlib' not in sys.modules; "
              "from synthetic_results import make; from rom.reporting.results import Results; "
              "from rom.reporting.checks import timing; from pathlib import Path; "
              "timing(Results(make('static'))).write(Path(sys.argv[1])); assert 'matplotlib.pyplot' not in sys.modules")
    paths = f"import sys; sys.path[:0] = [{str(Path(__file__).parent)!r}, {str(Path(__file__).parents[2])!r}]; "
    subprocess.run([sys.executable, "-c", paths + script, str(tmp_path)], check=True)
    assert (tmp_path / "timing-spread.png").exists()
