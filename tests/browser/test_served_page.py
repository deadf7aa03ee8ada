"""The page of `rom serve` in a real browser: what is clicked, moved and typed, and the numbers that appear."""

import re

import numpy as np
import pytest

LOOKING_AT_THE_PAD = "view=12,0,-90,12,0,0&scale=0.001"
WITHIN = {"rtol": 1e-6, "atol": 0}


def state_of(visit):
    """Forces, frequency and loss factor of the picture."""
    text = visit.page.get_attribute("#view", "data-shown")
    found = dict(part.split("=") for part in text.split("&"))
    forces = [(int(node), float(force)) for node, force in (one.split(":") for one in found["forces"].split(","))]
    return forces, float(found["f"]), float(found["eta"])


def check_figures(visit, answer):
    """Displayed and Python's displacement at the first force."""
    forces, frequency, loss_factor = state_of(visit)
    u, normal = answer(forces, frequency, loss_factor, forces[0][0])
    np.testing.assert_allclose(visit.figure("probe-value"), np.linalg.norm(u), **WITHIN)
    np.testing.assert_allclose(visit.normal(), normal, **WITHIN)
    shown = re.fullmatch(r"([\d.]+) (n|µ|m|)m", visit.page.inner_text("#probe-value"))
    factor = {"n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0}[shown[2]]
    np.testing.assert_allclose(float(shown[1]) * factor, np.linalg.norm(u), **WITHIN)  # seven digits are written


def test_a_click_places_the_force_and_the_figures_are_pythons(server, visit, answer, coarse_tip):
    mesh = coarse_tip.mesh
    one = visit(f"{server}?f=150&eta=0.2&{LOOKING_AT_THE_PAD}")
    check_figures(one, answer)
    facing = mesh.pad_nodes[mesh.normals[mesh.pad_nodes][:, 2] < -0.8]
    for node in (facing[0], facing[-1]):
        one.click_at(mesh.nodes[node] * 1e3)
        one.shows(f"forces={node}:0.1")
        check_figures(one, answer)


def test_sliders_move_by_keys(server, visit, answer):
    one = visit(f"{server}?f=100")
    for slider, key, count, shows in (("frequency", "ArrowRight", 7, "f=107&"), ("loss", "ArrowRight", 3, "eta=0.13&"),
                                      ("amplitude", "ArrowLeft", 4, ":0.06&"), ("frequency", "Home", 1, "f=0&"),
                                      ("frequency", "End", 1, "f=300&")):
        one.page.focus(f"#{slider}")
        for _ in range(count):
            one.page.keyboard.press(key)
        one.shows(shows)
        check_figures(one, answer)
    one.page.fill("#frequency-number", "211.5")
    one.shows("f=211.5&")
    check_figures(one, answer)


def test_a_number_out_of_range_changes_nothing(server, visit):
    one = visit(f"{server}?f=100")
    for text in ("301", "-1", "1e308"):
        one.page.fill("#frequency-number", text)
        assert one.page.get_attribute("#frequency-number", "aria-invalid") == "true"
    one.page.focus("#loss")
    assert one.page.input_value("#frequency-number") == "100"
    assert state_of(one)[1] == 100


def test_forces_by_keys(server, visit, answer, coarse_tip):
    one = visit(f"{server}?f=60&{LOOKING_AT_THE_PAD}")
    first = state_of(one)[0][0][0]
    one.page.focus("#view")
    one.page.keyboard.press("ArrowUp")
    one.page.wait_for_function("node => !document.getElementById('view').dataset.shown.includes(node)", arg=f"{first}:")
    second = state_of(one)[0][0][0]
    assert coarse_tip.mesh.nodes[second, 0] > coarse_tip.mesh.nodes[first, 0]  # up the picture is towards the tip
    one.page.keyboard.press("a")
    one.page.wait_for_function("() => document.getElementById('view').dataset.shown.split('&')[0].includes(',')")
    check_figures(one, answer)
    assert len(state_of(one)[0]) == 2
    one.page.keyboard.press("Delete")
    one.shows(f"forces={second}:0.1&")
    one.page.keyboard.press("Delete")  # the last one stays
    assert "One force must stay" in one.page.inner_text("#hint")


def test_everything_can_be_reached_by_tab(server, visit):
    one = visit(f"{server}?f=60&cut=x:15")
    wanted = {"view", "play", "home", "amplitude", "frequency", "loss", "method", "quantity", "cut-axis", "cut",
              "scale", "scale-auto", "compare", "save-png", "save-vtu", "save-nc", "copy-link"}
    reached = set()
    for _ in range(45):
        one.page.keyboard.press("Tab")
        reached.add(one.page.evaluate("() => document.activeElement.id"))
    assert wanted <= reached


def test_a_link_restores_the_state(server, visit, answer, coarse_tip):
    pad = coarse_tip.mesh.pad_nodes
    one = visit(f"{server}?forces={pad[3]}:0.2,{pad[9]}:-0.05&f=180&eta=0.3&quantity=phase&probe={pad[5]}&scale=12")
    assert state_of(one) == ([(pad[3], 0.2), (pad[9], -0.05)], 180.0, 0.3)
    u, _ = answer([(pad[3], 0.2), (pad[9], -0.05)], 180.0, 0.3, pad[5])
    np.testing.assert_allclose(one.figure("probe-value"), np.linalg.norm(u), **WITHIN)
    assert one.page.input_value("#quantity") == "phase"
    assert one.page.inner_text("#scale-value") == "12 ×"
    one.page.select_option("#quantity", "z")
    one.shows("quantity=z")
    one.page.wait_for_function("() => location.search.includes('quantity=z')")
    again = visit(one.page.url)
    assert state_of(again) == state_of(one)
    assert again.page.input_value("#quantity") == "z"


def test_two_pages_do_not_disturb_each_other(server, visit, answer):
    pages = visit(f"{server}?f=50"), visit(f"{server}?f=250&eta=0.4")
    for step in range(3):
        for one, key in zip(pages, ("ArrowRight", "ArrowLeft"), strict=True):
            one.page.focus("#frequency")
            one.page.keyboard.press(key)
        for one, frequency in zip(pages, (51 + step, 249 - step), strict=True):
            one.shows(f"f={frequency}&")
            check_figures(one, answer)
    assert [state_of(one)[2] for one in pages] == [0.1, 0.4]


def test_compare_with_direct_and_cancel(server, visit, answer):
    one = visit(f"{server}?f=120&method=modal")
    one.page.click("#compare")  # a process of its own has to start first, which takes longer than the next click
    one.page.click("#cancel")
    one.page.wait_for_function("() => document.getElementById('comparison').textContent === 'Cancelled.'")
    one.page.select_option("#method", "modal-krylov")
    one.shows("method=modal-krylov")
    check_figures(one, answer)
    one.page.click("#compare")
    one.page.wait_for_selector("#comparison[data-error]")
    assert 0 < float(one.page.get_attribute("#comparison", "data-error")) < 1e-5
    assert one.figure("speedup") > 0
    one.page.select_option("#method", "direct")
    one.shows("method=direct")
    forces, frequency, loss_factor = state_of(one)
    u, _ = answer(forces, frequency, loss_factor, forces[0][0])
    np.testing.assert_allclose(one.figure("probe-value"), np.linalg.norm(u), rtol=1e-5)


def test_methods_that_cannot_answer_say_why(server, visit):
    one = visit(f"{server}?f=120")
    disabled = one.page.locator("#method option:disabled").all_inner_texts()
    assert any(text.startswith("superposition (cannot: ") for text in disabled)
    one.page.click("#reasons summary")
    assert "superposition: unit-load responses differ" in one.page.inner_text("#reasons ul")
    one.page.select_option("#method", "modal")
    one.page.fill("#frequency-number", "0")
    one.shows("f=0&")
    assert one.page.locator("#method option[value=superposition]").is_enabled()


def test_residual_and_bound_are_always_there(server, visit):
    one = visit(f"{server}?f=120")
    one.page.wait_for_function("() => Number(document.getElementById('residual').dataset.value) > 0")
    assert 0 < one.figure("residual") < 1e-3
    assert 0 < one.figure("bound") < 1e-3
    assert one.figure("seconds") > 0


@pytest.mark.parametrize("quantity", ["magnitude", "x", "normal", "phase", "strain"])
def test_cut_and_quantity(server, visit, quantity):
    one = visit(f"{server}?f=120&cut=y:0&quantity={quantity}")
    one.shows("cut=y:0", f"quantity={quantity}")
    one.page.select_option("#cut-axis", "x")
    one.shows("cut=x:")
    one.page.select_option("#cut-axis", "none")
    one.shows("cut=none")


def test_a_click_on_the_response_chooses_the_frequency(server, visit, answer):
    one = visit(f"{server}?f=20")
    over = one.page.locator("#frf .u-over").first
    over.wait_for()
    box = over.bounding_box()
    one.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    one.page.wait_for_function("() => !document.getElementById('view').dataset.shown.includes('f=20&')")
    assert state_of(one)[1] == pytest.approx(150, abs=2)
    check_figures(one, answer)


@pytest.mark.parametrize(("button", "name", "begins"), [
    ("save-png", "fingertip.png", b"\x89PNG"), ("save-vtu", "fingertip.vtu", b"<?xml"),
    ("save-nc", "fingertip.nc", b"")])
def test_saving(server, visit, tmp_path, button, name, begins):
    one = visit(f"{server}?f=120")
    with one.page.expect_download() as waiting:
        one.page.click(f"#{button}")
    assert waiting.value.suggested_filename.endswith(name.rpartition(".")[2])
    waiting.value.save_as(tmp_path / name)
    data = (tmp_path / name).read_bytes()
    assert len(data) > 1000
    assert data.startswith(begins)


def bytes_in_use(page):
    """Of the page's scripts, after what nobody needs has been let go."""
    devtools = page.context.new_cdp_session(page)
    devtools.send("HeapProfiler.collectGarbage")
    used = devtools.send("Runtime.getHeapUsage")
    return used["usedSize"] + used["backingStorageSize"]


def test_dragging_leaves_nothing_behind_in_the_page(server, visit):
    one = visit(f"{server}?f=100")

    def drag(steps):
        one.page.evaluate("""async steps => {
            const slider = document.getElementById("frequency"), view = document.getElementById("view");
            for (let i = 0; i <= steps; i++) {
                const {frames} = view.dataset;
                slider.value = i < steps ? 50 + i : 100;
                slider.dispatchEvent(new Event("input"));
                while (view.dataset.frames === frames) await new Promise(done => setTimeout(done, 5));
            } }""", steps)
        one.shows("f=100&")
        return bytes_in_use(one.page)

    drag(30)  # what is compiled, and drawn for the first time
    before = drag(30)
    assert drag(100) - before < 100 * 3000  # an arrow's buffers alone have 5 kB, a picture's arrays 4 kB


def test_residuals_that_never_come_are_not_waited_for(server, visit):
    one = visit(server)
    ask = """async count => {
        const {ServerEngine} = await import("/page/server_engine.js"), real = window.WebSocket;
        window.WebSocket = class {
            constructor() { setTimeout(() => this.onopen()); }
            send(text) {
                const {id} = JSON.parse(text), words = {id, answer: "field", residual: null};
                const header = new TextEncoder().encode(JSON.stringify(words));
                const message = new Uint8Array(200);
                new DataView(message.buffer).setUint32(0, header.length, true);
                message.set(header, 4);
                queueMicrotask(() => this.onmessage({data: message.buffer}));
            } };
        window.engine = new ServerEngine(() => {});
        await window.engine.hello();
        window.WebSocket = real;
        for (let i = 0; i < count; i++) await window.engine.field({}, {onIndicators: () => {}}); }"""
    before = bytes_in_use(one.page)
    one.page.evaluate(ask, 8000)
    assert bytes_in_use(one.page) - before < 8000 * 50  # one that is still waited for takes 150


@pytest.mark.parametrize("cut", ["none", "x:15"])
def test_phone(server, visit, cut):
    one = visit(f"{server}?f=120&cut={cut}", viewport={"width": 360, "height": 740}, has_touch=True, is_mobile=True)
    assert one.page.evaluate("() => document.documentElement.scrollWidth") <= 360
    outside = one.page.evaluate("""() =>
        [...document.querySelectorAll("button, input, select, output, dd, dt, p, h2, #view")]
        .filter(one => one.checkVisibility() && !one.closest(".unseen, .uplot") && !one.matches("#click-modes input"))
        .filter(one => { const b = one.getBoundingClientRect(); return b.width && (b.left < 0 || b.right > 360.5); })
        .map(one => one.id || one.outerHTML)""")
    assert outside == []
    overlapping = one.page.evaluate("""() => [...document.querySelectorAll("#figures dd, #figures dt")]
        .filter(one => one.scrollWidth > one.clientWidth + 1).map(one => one.textContent)""")
    assert overlapping == []
    view, controls = (one.page.locator(name).bounding_box() for name in ("#view", "#controls"))
    assert view["y"] == 0
    assert view["y"] + view["height"] <= controls["y"]


def test_motion_waits_where_less_is_wanted(server, visit):
    still = visit(f"{server}?f=120")
    assert still.page.get_attribute("#play", "aria-pressed") == "false"
    still.page.wait_for_timeout(300)
    before = still.page.get_attribute("#view", "data-frames")
    still.page.wait_for_timeout(500)
    assert still.page.get_attribute("#view", "data-frames") == before
    moving = visit(f"{server}?f=120", reduced_motion="no-preference")
    before = int(moving.page.get_attribute("#view", "data-frames"))
    moving.page.wait_for_function("before => document.getElementById('view').dataset.frames > before + 3", arg=before)


def test_dark_where_dark_is_wanted(server, visit):
    background = "() => getComputedStyle(document.documentElement).backgroundColor"
    found = [visit(server, color_scheme=scheme).page.evaluate(background) for scheme in ("light", "dark")]
    assert found == ["rgb(255, 255, 255)", "rgb(20, 23, 26)"]
