"""A short form of the campaign against a running server: nothing gives way, and nobody disturbs anybody."""

import asyncio
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

import attack_server


@pytest.fixture(scope="module")
def attacked(_own_cache):
    with attack_server.served(quick=True) as server:
        yield server


def test_every_message_is_answered_and_nothing_grows(attacked):
    answers, memory = asyncio.run(attack_server.messages(attacked, 1600, seed=1))
    assert not [name for name in answers if name.startswith("wrong")]
    assert min(answers[name] for name in ("field", "frf", "cut", "hello", "problem", "superseded", "cancelled")) > 0
    assert not memory[-1] - memory[4] > 10e6  # bytes; a leak of one picture a message would be 3 MB


def test_who_solves_directly_is_not_disturbed_by_pages_that_drag(attacked):
    assert asyncio.run(attack_server.drag_beside(attacked, 4, seed=1)) == (4, [])


def test_a_crowd_gets_its_pictures(attacked):
    seconds, wrong = asyncio.run(attack_server.crowd(attacked, "modal-krylov", 5, seed=1))
    assert wrong == []
    assert len(seconds) >= attack_server.CROWD


def test_what_is_no_http_gets_short_answers(attacked):
    assert asyncio.run(attack_server.unreadable(attacked, 80, seed=1)) == []


def test_abandoned_downloads_leave_the_server_free(attacked):
    assert asyncio.run(attack_server.abandon(attacked, 12)) < attack_server.PATIENCE


def test_after_all_that_the_log_is_empty(attacked):
    assert attacked.log.read_text() == ""


def test_idle_connections_where_few_files_may_be_open():
    with attack_server.served(quick=True, files=attack_server.FEW_FILES) as server:
        asyncio.run(attack_server.idle(server, 4 * attack_server.FEW_FILES))
        assert server.log.stat().st_size < 10_000
