"""The exported file in a real browser, and against Python: its numbers, its size, what it refuses to overwrite."""

import gzip
import re
from base64 import b64decode

import numpy as np
import pytest

from rom.cli import main
from rom.interactive.export import ALLOWED_DEVIATION, MARK, export_page
from rom.interactive.surface_model import economised_series, from_bytes
from rom.scenes import CaseArrays

LARGEST_FILE = 5e6


@pytest.fixture(scope="session")
def exported(krylov, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "fingertip.html"
    export_page(krylov, path)
    return path


@pytest.fixture(scope="session")
def inside(exported):
    """The model as its bytes stand in the file."""
    packed = re.search(r'id="model">([^<]+)</script>', exported.read_text())[1]
    return from_bytes(gzip.decompress(b64decode(packed)))


@pytest.mark.parametrize("frequency", [0.0, 33.0, 121.0, 163.0, 207.0, 300.0])
@pytest.mark.parametrize("loss_factor", [0.05, 0.3, 1.0])
def test_the_bytes_answer_as_python_at_every_pad_node(inside, krylov, frequency, loss_factor):
    n_load = len(krylov.participation)
    each = np.arange(n_load)
    cases = CaseArrays(each[:, None], np.ones((n_load, 1)), np.full(n_load, frequency),
                       np.full(n_load, loss_factor if frequency else 0.0))
    whole = krylov.evaluate(cases, "pad").reshape(n_load, -1, 3)
    ours = inside.unit_responses(frequency, loss_factor, inside.arrays["pad_vertex"])
    size = np.linalg.norm(whole, axis=(1, 2))
    assert (np.linalg.norm(ours - whole, axis=(1, 2)) <= ALLOWED_DEVIATION * size).all()


def test_the_whole_surface_moves(inside, krylov):
    tip = krylov.scene.body.fingertip
    cases = CaseArrays(np.array([[2, 5]]), np.array([[0.1, -0.3]]), np.array([150.0]), np.array([0.1]))
    field = krylov.scene.body.grid.on_all_nodes(krylov.evaluate(cases, "field"))[0]
    ours = inside.displacement(np.array([2, 5]), np.array([0.1, -0.3]), 150.0, 0.1)
    whole = field[inside.arrays["vertex_node"]]
    assert np.linalg.norm(ours - whole) <= ALLOWED_DEVIATION * np.linalg.norm(whole)
    assert (whole[np.isin(inside.arrays["vertex_node"], tip.mesh.bone_nodes)] == 0).all()


def test_the_series_is_exact_in_statics_and_twice_as_good_as_taylors():
    factor = economised_series(0.35, 6)
    x = 0.35 * np.linspace(0, 1, 200) / (1 + 0.5j)
    assert factor[0] == 1.0
    off = np.abs(np.polyval(factor[::-1], x) - 1 / (1 - x)).max()
    assert off < 3e-4
    assert off < 0.2 * np.abs(np.polyval(np.ones(6), x) - 1 / (1 - x)).max()


@pytest.mark.parametrize("state", [(0.0, 0.1), (121.0, 0.05), (207.0, 0.3), (300.0, 1.0)])
def test_the_page_shows_what_python_answers(exported, visit, answer, coarse_tip, state):
    frequency, loss_factor = state
    pad = [int(node) for node in coarse_tip.mesh.pad_nodes]
    forces = [(pad[1], 0.1), (pad[-2], 0.2)]
    one = visit(f"file://{exported}#forces={pad[1]}:0.1,{pad[-2]}:0.2&f={frequency}&eta={loss_factor}")
    for probe in (pad[1], pad[len(pad) // 2]):
        if probe != pad[1]:
            one = visit(one.page.url.partition("&view")[0] + f"&probe={probe}")
        u, normal = answer(forces, frequency, loss_factor, probe)
        assert one.figure("probe-value") == pytest.approx(np.linalg.norm(u), rel=ALLOWED_DEVIATION)
        assert abs(one.normal() - normal) <= ALLOWED_DEVIATION * np.linalg.norm(u)


def test_it_needs_no_server_and_says_what_does(exported, visit):
    one = visit(f"file://{exported}")
    assert one.page.locator("#compare").is_disabled()
    assert "rom serve" in one.page.inner_text("#comparison")
    assert one.page.locator("#method option:disabled").count() >= 11
    one.page.focus("#frequency")
    one.page.keyboard.press("End")
    one.shows("f=300&")
    one.page.wait_for_selector("#frf .u-over")
    assert {url.partition(":")[0] for url in one.requests} <= {"file", "data", "blob"}


def test_nothing_foreign_runs_in_it_and_it_asks_nobody(exported, visit, server):
    one = visit(f"file://{exported}")
    before = len(one.errors)
    found = one.page.evaluate("""async address => {
        const script = document.createElement("script");
        script.textContent = "window.foreign = 1";
        document.body.append(script);
        const image = document.createElement("img");
        image.setAttribute("onerror", "window.foreign = 2");
        image.src = address;
        document.body.append(image);
        const asked = await fetch(address, {mode: "no-cors"}).then(() => "answered", () => "refused");
        await new Promise(done => setTimeout(done, 300));
        return [window.foreign ?? null, asked]; }""", server)
    assert found == [None, "refused"]
    assert all("Content Security Policy" in error for error in one.errors[before:])
    del one.errors[before:]


def test_it_is_small_and_bears_its_licences(exported):
    text = exported.read_text()
    assert len(text.encode()) < LARGEST_FILE
    assert "The MIT License" in text
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", text)


def test_it_replaces_its_own_kind_only(krylov, exported, tmp_path):
    before = exported.read_bytes()
    export_page(krylov, exported)
    assert exported.read_bytes() == before
    foreign = tmp_path / "mine.html"
    foreign.write_text("<!DOCTYPE html>")
    with pytest.raises(ValueError, match="is no exported page"):
        export_page(krylov, foreign)
    assert foreign.read_text() == "<!DOCTYPE html>"
    assert MARK not in foreign.read_text()


@pytest.mark.parametrize(("name", "reason"), [
    ("page.txt", "must end in .html"), (".", "must end in .html"), ("folder.html", "is a folder"),
    ("missing/page.html", "does not exist"), ("foreign.html", "is no exported page")])
def test_paths_that_cannot_be_end_in_a_sentence(tmp_path, capsys, name, reason):
    (tmp_path / "folder.html").mkdir()
    (tmp_path / "foreign.html").write_text("mine")
    assert main(["export-page", str(tmp_path / name), "--quick"]) == 2
    errors = capsys.readouterr().err
    assert reason in errors
    assert errors.count("\n") == 1
