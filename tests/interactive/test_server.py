"""The server by a real socket on loopback: two browsers, superseding, cancelling, hostile messages, downloads."""

import asyncio
import errno
import json
import os
from contextlib import asynccontextmanager, suppress
from types import SimpleNamespace

import aiohttp
import meshio
import numpy as np
import pytest

from rom.datasets import read_dataset
from rom.interactive import door, server, wire
from rom.interactive.server import listen, make_application, opened
from rom.interactive.worker import Worker
from rom.metamodels import method_names

PATIENCE = 120.0


class Browser:
    """The page's side of a socket."""

    def __init__(self, socket):
        self.socket, self.number = socket, 0

    async def send(self, kind, **more):
        self.number += 1
        await self.socket.send_str(json.dumps({"id": self.number, "ask": kind, **more}))
        return self.number

    async def next(self):
        message = await self.socket.receive(timeout=PATIENCE)
        assert message.type is aiohttp.WSMsgType.BINARY, message
        return wire.decode(message.data)

    async def reply_to(self, number):
        while True:
            header, arrays = await self.next()
            if header["id"] == number and header["answer"] != "indicators":
                return header, arrays

    async def ask(self, kind, **more):
        return await self.reply_to(await self.send(kind, **more))


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    (folder / "index.html").write_text("<title>Fingertip</title><script type='importmap'>{}</script>", encoding="utf-8")
    (folder / "vendor").mkdir()
    (folder / "vendor" / "view.js").write_text("export const x = 1;", encoding="utf-8")
    (folder.parent / "secret.txt").write_text("secret", encoding="utf-8")
    os.symlink(folder.parent / "secret.txt", folder / "link.txt")
    return folder


@pytest.fixture
def talk(engine, page):
    """Run a coroutine function that takes a client of a server of its own."""
    @asynccontextmanager
    async def serving():
        with listen("127.0.0.1", 0) as bound:
            host, port = bound.getsockname()
            async with (opened(make_application(engine, folder=page), bound) as door,
                        aiohttp.ClientSession(f"http://{host}:{port}") as session):
                yield SimpleNamespace(get=session.get, post=session.post, ws_connect=session.ws_connect, host=host,
                                      port=port, door=door)

    def run(scenario):
        async def whole():
            async with serving() as client:
                await asyncio.wait_for(scenario(client), PATIENCE)
        asyncio.run(whole())
    return run


def on_socket(scenario):
    async def whole(client):
        async with client.ws_connect("/socket") as socket:
            await scenario(Browser(socket))
    return whole


def forces(engine, *amplitudes):
    return [[int(node), amplitude] for node, amplitude in zip(engine.tip.mesh.pad_nodes, amplitudes, strict=False)]


# ---- what the page asks for ---------------------------------------------------------------------------------


def test_hello_brings_geometry_and_methods(talk, engine):
    @on_socket
    async def scenario(browser):
        header, arrays = await browser.ask("hello")
        assert header["answer"] == "hello"
        assert header["ready"] is True
        assert header["pad_center"] == engine.limits.pad_center
        assert [method["name"] for method in header["methods"]] == method_names()
        assert arrays["triangles"].max() < len(arrays["vertices"]) == len(arrays["vertex_node"])
        np.testing.assert_array_equal(arrays["vertex_node"][arrays["pad_vertex"]], engine.tip.mesh.pad_nodes)
        np.testing.assert_allclose(arrays["vertices"], 1e3 * engine.tip.mesh.nodes[arrays["vertex_node"]], rtol=1e-6)
    talk(scenario)


def test_a_field_then_its_residual(talk, engine):
    state = {"forces": forces(engine, 0.1, -0.2, 0.3), "frequency": 120.0, "quantity": "strain", "cut": ["x", 14.0]}

    @on_socket
    async def scenario(browser):
        number = await browser.send("field", state=state)
        header, arrays = await browser.next()
        assert (header["id"], header["answer"]) == (number, "field")
        assert len(header["probes"]) == 3
        assert set(arrays) == {"u", "cut_u", "strain"}
        assert arrays["u"].shape == (len(engine.surface.vertex_node), 3, 2)
        later, _ = await browser.next()
        assert (later["id"], later["answer"]) == (number, "indicators")
        assert 0 < later["residual"] < 1e-6
        _, cut = await browser.ask("cut", state=state)
        assert len(cut["cut_vertices"]) == len(arrays["cut_u"])
        response, curves = await browser.ask("frf", state=state, node=state["forces"][1][0])
        assert response["node"] == state["forces"][1][0]
        assert curves["receptance"].shape == (150, 2)
    talk(scenario)


def test_error_against_direct_and_speed_up(talk, engine):
    engine.direct_seconds.clear()

    @on_socket
    async def scenario(browser):
        state = {"frequency": 140.0, "method": "modal-static"}
        before, _ = await browser.ask("field", state=state)
        assert before["speedup"] is None
        found, _ = await browser.ask("error", state=state)
        assert found["answer"] == "error"
        assert 0 < found["error"] < 0.1
        assert found["direct_seconds"] > 0
        assert found["speedup"] == pytest.approx(found["direct_seconds"] / found["seconds"])
        after, _ = await browser.ask("field", state=state)
        assert after["speedup"] > 0
        static, _ = await browser.ask("error", state={"method": "superposition"})
        assert static["error"] < 1e-9
        direct, arrays = await browser.ask("field", state={**state, "method": "direct"})
        assert direct["answer"] == "field"
        reduced, same = await browser.ask("field", state={**state, "method": "modal-krylov"})
        np.testing.assert_allclose(arrays["u"], same["u"], rtol=1e-4, atol=1e-6 * np.abs(same["u"]).max())
        assert reduced["bound"] < 1e-6
    talk(scenario)
    engine.direct_seconds.clear()


def test_two_browsers_do_not_disturb_each_other(talk, engine):
    async def scenario(client):
        async with client.ws_connect("/socket") as first, client.ws_connect("/socket") as second:
            one, two = Browser(first), Browser(second)
            slow = await two.send("field", state={"method": "direct", "frequency": 99.0})
            for i in range(20):
                states = [{"forces": forces(engine, 0.1), "frequency": 10.0 + i},
                          {"forces": forces(engine, 0.2, 0.1), "frequency": 290.0 - i}]
                header, _ = await one.ask("field", state=states[0])
                expected = engine.answer(wire_state(engine, states[0]))
                assert header["answer"] == "field"
                u = engine.on_nodes(expected.values)[header["probes"][0]["node"]]
                assert header["probes"][0]["u"] == [[c.real, c.imag] for c in u.tolist()]
            header, _ = await two.reply_to(slow)
            assert header["answer"] == "field"
    talk(scenario)


def wire_state(engine, record):
    from rom.interactive.state import from_json

    return from_json(record, engine.limits)


def test_only_the_newest_of_waiting_fields_counts(talk):
    @on_socket
    async def scenario(browser):
        numbers = [await browser.send("field", state={"frequency": float(f)}) for f in range(1, 61)]
        answers = {}
        while len(answers) < len(numbers):
            header, _ = await browser.next()
            if header["answer"] != "indicators":
                assert header["id"] not in answers
                answers[header["id"]] = header["answer"]
        assert set(answers.values()) <= {"field", "superseded"}
        assert answers[numbers[-1]] == "field"
        assert list(answers.values()).count("superseded") > 20
    talk(scenario)


# ---- direct solves ------------------------------------------------------------------------------------------


def test_a_direct_solve_is_cancelled_and_the_next_one_answered(talk):
    @on_socket
    async def scenario(browser):
        for kind in ("field", "error"):
            number = await browser.send(kind, state={"method": "direct", "frequency": 180.0})
            await browser.socket.send_str(json.dumps({"id": number, "ask": "cancel"}))
            header, _ = await browser.reply_to(number)
            assert header["answer"] == "cancelled"
        header, _ = await browser.ask("field", state={"method": "direct", "frequency": 180.0})
        assert header["answer"] == "field"
        header, _ = await browser.ask("cancel")
        assert header["answer"] == "problem"
        assert "nothing with the id" in header["text"]
    talk(scenario)


def test_a_newer_field_ends_a_direct_solve(talk):
    @on_socket
    async def scenario(browser):
        old = await browser.send("field", state={"method": "direct", "frequency": 180.0})
        await asyncio.sleep(0.05)
        new = await browser.send("field", state={"frequency": 181.0})
        found = {}
        while len(found) < 2:
            header, _ = await browser.next()
            if header["answer"] != "indicators":
                found[header["id"]] = header["answer"]
        assert found == {old: "superseded", new: "field"}
    talk(scenario)


def test_one_browsers_cancel_leaves_the_others_solve_alone(talk):
    async def scenario(client):
        async with client.ws_connect("/socket") as first, client.ws_connect("/socket") as second:
            one, two = Browser(first), Browser(second)
            running = await one.send("field", state={"method": "direct", "frequency": 50.0})
            waiting = await two.send("field", state={"method": "direct", "frequency": 60.0})
            await asyncio.sleep(0.1)
            await one.socket.send_str(json.dumps({"id": running, "ask": "cancel"}))
            assert (await one.reply_to(running))[0]["answer"] == "cancelled"
            assert (await two.reply_to(waiting))[0]["answer"] == "field"
    talk(scenario)


def test_a_browser_that_leaves_takes_its_solve_along(talk):
    async def scenario(client):
        async with client.ws_connect("/socket") as first:
            await Browser(first).send("field", state={"method": "direct", "frequency": 50.0})
            await asyncio.sleep(0.1)
        async with client.ws_connect("/socket") as second:
            header, _ = await Browser(second).ask("field", state={"method": "direct", "frequency": 60.0})
            assert header["answer"] == "field"
    talk(scenario)


# ---- hostility ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", [
    '{"id": 7, "ask": "field", "state": {"frequency": NaN}}',
    '{"id": 7, "ask": "field", "state": {"frequency": 1e308}}',
    '{"id": 7, "ask": "field", "state": {"forces": [[1000000000, 0.1]]}}', '{"id": 7, "ask": "field", "state": []}',
    '{"id": 7, "ask": "field", "state": {"forces": [[0, 1e999]]}}', '{"id": 7, "ask": "frf", "node": 1000000000}',
    '{"id": 7, "ask": "frf", "node": "0; DROP TABLE"}', '{"id": 7, "ask": "cut", "state": {}}',
    '{"id": 7, "ask": "cut", "state": {"cut": ["x", -1e308]}}', '{"id": 7, "ask": "format c:"}', '{"id": 7}',
    '{"id": 7, "ask": "field", "state": {"method": "mlp", "frequency": 0}}', "no JSON at all", "[[[[" * 3000,
    '{"id": 7, "ask": "field", "state": {"method": "__import__(\'os\')"}}'])
def test_hostile_messages_are_refused_and_the_connection_stays(talk, text):
    @on_socket
    async def scenario(browser):
        await browser.socket.send_str(text)
        header, _ = await browser.next()
        assert header["answer"] == "problem"
        assert header["id"] in (7, None)
        assert 10 < len(header["text"]) < 400
        assert "\n" not in header["text"]
        assert (await browser.ask("field"))[0]["answer"] == "field"
    talk(scenario)


def test_a_megabyte_closes_that_connection_alone(talk):
    async def scenario(client):
        async with client.ws_connect("/socket") as first, client.ws_connect("/socket") as second:
            await first.send_str('{"id": 1, "ask": "' + "x" * 1_000_000 + '"}')
            message = await first.receive(timeout=PATIENCE)
            assert message.type in (aiohttp.WSMsgType.CLOSE, aiohttp.WSMsgType.CLOSED, aiohttp.WSMsgType.ERROR)
            assert first.close_code == 1009
            assert (await Browser(second).ask("field"))[0]["answer"] == "field"
    talk(scenario)


def test_bytes_are_not_taken(talk):
    async def scenario(client):
        async with client.ws_connect("/socket") as socket:
            await socket.send_bytes(b"\x00" * 100)
            await socket.receive(timeout=PATIENCE)
            assert socket.close_code == 1003
    talk(scenario)


@pytest.mark.parametrize("headers", [
    {"Host": "evil.example"}, {"Host": "127.0.0.1.evil.example"}, {"Host": ""}, {"Host": "[::1"},
    {"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": "https://127.0.0.1"}, {"Origin": "http://[::1"},
    {"Sec-Fetch-Site": "cross-site"}])
@pytest.mark.parametrize("path", ["/socket", "/save/field.nc", "/page/vendor/view.js"])
def test_foreign_pages_are_refused(talk, headers, path):
    async def scenario(client):
        async with client.get(path, headers=headers) as response:
            assert response.status == 403
            assert "printed" in await response.text()
    talk(scenario)


def test_the_page_itself_may_be_linked_to(talk):
    async def scenario(client):
        async with client.get("/", headers={"Sec-Fetch-Site": "cross-site"}) as response:
            assert response.status == 200
        origin = f"http://{client.host}:{client.port}"
        async with client.ws_connect("/socket", headers={"Origin": origin}) as socket:
            assert (await Browser(socket).ask("field"))[0]["answer"] == "field"
    talk(scenario)


@pytest.mark.parametrize("path", [
    "/page/../server.py", "/page/%2e%2e/secret.txt", "/page/..%2fsecret.txt", "/page//etc/passwd", "/page/link.txt",
    "/page/%00", "/page/vendor", "/page/", "/etc/passwd", "/page/vendor/../../secret.txt", "/save/secret.txt",
    "/save/..%2f..%2fsecret.txt", "/save/field.nc%00", "/page/" + "x" * 4000])
def test_nothing_but_the_pages_files_is_served(talk, path):
    from yarl import URL

    async def scenario(client):
        url = URL(f"http://{client.host}:{client.port}{path}", encoded=True)
        async with client.get(url) as response:
            assert response.status == 404
            assert "secret" not in await response.text()
    talk(scenario)


@pytest.mark.parametrize("query", [
    "f=nan", "f=1e308", "forces=1000000000:0.1", "method=magic", "x=1", "cut=x:1e308", "f=1&f=2",
    "quantity=%3Cscript%3E"])
@pytest.mark.parametrize("path", ["/", "/save/field.vtu"])
def test_a_hostile_address_gets_one_sentence(talk, path, query):
    async def scenario(client):
        async with client.get(f"{path}?{query}") as response:
            text = await response.text()
            assert response.status == 400
            assert text.count("\n") == 1
            assert response.content_type == "text/plain"
    talk(scenario)


def test_a_very_long_address_is_refused_and_the_server_stays(talk):
    async def scenario(client):
        async with client.get("/?f=" + "1" * 100_000) as response:
            assert response.status in (400, 414)
        async with client.get("/?f=120&eta=0.2&view=1,2,3") as response:
            assert response.status == 200
    talk(scenario)


def test_files_and_their_headers(talk):
    async def scenario(client):
        async with client.get("/") as response:
            policy = response.headers["Content-Security-Policy"]
            assert response.content_type == "text/html"
            assert "default-src 'none'" in policy
            assert policy.count("'sha256-") == 1
            assert response.headers["X-Content-Type-Options"] == "nosniff"
        async with client.get("/page/vendor/view.js") as response:
            assert response.content_type == "text/javascript"
            assert await response.text() == "export const x = 1;"
        async with client.post("/") as response:
            assert response.status == 405
    talk(scenario)


def headers_and_words(answer):
    """Status, header names and body of a raw answer."""
    head, _, body = answer.partition(b"\r\n\r\n")
    lines = head.decode("latin-1").split("\r\n")
    return int(lines[0].split()[1]), {line.partition(":")[0] for line in lines[1:]}, body.decode()


async def raw(client, text):
    reader, writer = await asyncio.open_connection(client.host, client.port)
    writer.write(text)
    answer = await asyncio.wait_for(reader.read(), PATIENCE)
    writer.close()
    return headers_and_words(answer)


@pytest.mark.parametrize("text", [
    b"\x16\x03\x01\x02\x00\x01\x00\xfc\r\n\r\n", b"GET / HTTP/1.1\r\nHo st: x\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: -1\r\n\r\n",
    b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n"])
def test_what_is_no_request_gets_a_short_answer_with_the_headers(talk, caplog, text):
    async def scenario(client):
        status, names, body = await raw(client, text)
        assert status == 400
        assert body == "Bad Request: the page is at /\n"
        assert {"Content-Security-Policy", "X-Content-Type-Options", "X-Frame-Options"} <= names
    talk(scenario)
    assert caplog.text == ""


@pytest.mark.parametrize("host", [
    "127.0.0.1/evil", "evil.com@127.0.0.1", "127.0.0.1#evil", "127.0.0.1?evil", "127.0.0.1:80:80", "127.0.0.1\\evil",
    "localhost.", "[127.0.0.1]", "127.1", "0x7f000001"])
def test_odd_hosts_are_refused(talk, host):
    async def scenario(client):
        status, names, body = await raw(client, f"GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
        assert status == 403
        assert "Content-Security-Policy" in names
        assert body.count("\n") == 1
    talk(scenario)


# ---- connections --------------------------------------------------------------------------------------------


def test_idle_connections_make_room_for_a_page(talk):
    async def scenario(client):
        client.door.most = 4
        idle = [await asyncio.open_connection(client.host, client.port) for _ in range(6)]
        idle[-1][1].write(b"GET / HTTP/1.1\r\nHost: 127.0")  # half a request is none
        async with client.get("/") as response, client.ws_connect("/socket") as socket:
            assert response.status == 200
            assert (await Browser(socket).ask("field"))[0]["answer"] == "field"
            assert len(client.door.visitors) <= 4
        assert await asyncio.wait_for(idle[0][0].read(), PATIENCE) == b""
        for _, writer in idle:
            writer.close()
    talk(scenario)


def test_who_asks_for_nothing_is_sent_away_and_who_has_a_page_open_is_not(talk, monkeypatch):
    monkeypatch.setattr(door, "IDLE", 0.3)

    async def scenario(client):
        async with client.ws_connect("/socket") as socket:
            reader, writer = await asyncio.open_connection(client.host, client.port)
            for letter in b"GET / HTTP":  # slowly
                writer.write(bytes([letter]))
                await asyncio.sleep(0.01)
            with suppress(ConnectionResetError):
                assert await asyncio.wait_for(reader.read(), PATIENCE) == b""
            writer.close()
            await asyncio.sleep(0.4)
            assert (await Browser(socket).ask("field"))[0]["answer"] == "field"
    talk(scenario)


def test_a_browser_that_takes_nothing_is_sent_away(talk, monkeypatch, page):
    monkeypatch.setattr(server, "LONGEST_SENDING", 0.3)
    (page / "large.js").write_bytes(b"x" * 40_000_000)

    async def scenario(client):
        _, writer = await asyncio.open_connection(client.host, client.port, limit=1024)
        writer.write(b"GET /page/large.js HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        await asyncio.sleep(0.1)
        while client.door.visitors:
            await asyncio.sleep(0.01)
        writer.close()
    try:
        talk(scenario)
    finally:
        (page / "large.js").unlink()


def test_where_no_connection_can_be_accepted_one_line_says_so(talk, monkeypatch, caplog):
    async def scenario(client):
        loop, failures = asyncio.get_running_loop(), []
        real = loop.sock_accept

        async def accept(bound):
            if len(failures) < 5:
                failures.append(bound)
                raise OSError(errno.EMFILE, "Too many open files")
            return await real(bound)

        monkeypatch.setattr(loop, "sock_accept", accept)
        for _ in range(2):  # the first is taken by the accept that waits already
            async with client.get("/", headers={"Connection": "close"}) as response:
                assert response.status == 200
        assert len(failures) == 5
    monkeypatch.setattr(door, "PAUSE", 0.01)
    talk(scenario)
    assert [record.getMessage() for record in caplog.records] == [
        "no connection can be accepted ([Errno 24] Too many open files); the server tries on"]


# ---- downloads ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("frequency", [0.0, 130.0])
def test_a_saved_field_is_read_back(talk, engine, tmp_path, frequency):
    state = wire_state(engine, {"forces": forces(engine, 0.1, 0.3), "frequency": frequency, "loss_factor": 0.2})
    expected = engine.on_nodes(engine.answer(state).values)

    async def scenario(client):
        for name in ("field.nc", "field.vtu"):
            async with client.get(f"/save/{name}?{state.to_query()}") as response:
                assert response.status == 200
                assert name in response.headers["Content-Disposition"]
                (tmp_path / name).write_bytes(await response.read())
    talk(scenario)
    data = read_dataset(tmp_path / "field.nc")
    np.testing.assert_array_equal(data["displacement"].values[0], expected)
    scene = engine.scene(state)
    read = scene.read(data)
    for one, other in zip(read, engine.cases(state, scene), strict=True):
        np.testing.assert_array_equal(one, other)
    assert data.attrs["method"] == "modal-krylov"
    grid = meshio.read(tmp_path / "field.vtu")
    np.testing.assert_array_equal(grid.points, engine.tip.mesh.nodes)
    if frequency:
        found = grid.point_data["displacement_m_real"] + 1j * grid.point_data["displacement_m_imag"]
    else:
        found = grid.point_data["displacement_m"]
    np.testing.assert_array_equal(found, expected)


def test_downloads_are_few_and_end_with_their_browser(talk, monkeypatch):
    begun, ended = [], []

    async def solve(worker, job):
        begun.append(job)
        try:
            await asyncio.Event().wait()
        finally:
            ended.append(job)

    async def scenario(client):
        async def download():
            async with client.get("/save/field.vtu?method=direct&f=77") as response:
                return response.status

        with monkeypatch.context() as patch:
            patch.setattr(Worker, "solve", solve)
            asked = [asyncio.create_task(download()) for _ in range(server.MOST_DOWNLOADS + 3)]
            refused, waiting = await asyncio.wait(asked, timeout=2.0)
            assert [task.result() for task in refused] == [503] * 3
            assert len(begun) == len(waiting) == server.MOST_DOWNLOADS
            for task in waiting:
                task.cancel()
            while len(ended) < len(begun):
                await asyncio.sleep(0.01)
        assert await download() == 200
    talk(scenario)


def test_a_direct_field_is_saved_too(talk):
    async def scenario(client):
        async with client.get("/save/field.vtu?method=direct&f=77") as response:
            assert response.status == 200
        async with client.get("/save/field.vtu?method=superposition&f=77") as response:
            assert response.status == 400
            assert "cannot answer a moving state" in await response.text()
    talk(scenario)
