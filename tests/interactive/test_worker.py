"""The process of direct solves: cancelled by killing it, and there again for the next job."""

import asyncio
import os

import numpy as np
import pytest

from rom.errors import SolverError
from rom.interactive.worker import Job, Worker
from rom.metamodels import create
from rom.scenes import CaseArrays

ONE = CaseArrays(np.array([[3]]), np.array([[0.1]]), np.array([120.0]), np.array([0.1]))


def job(scene, cases=ONE, method="direct", **settings):
    return Job(method, settings, scene.to_json(), cases)


def with_worker(scenario):
    async def whole():
        worker = Worker()
        try:
            return await asyncio.wait_for(scenario(worker), 120)
        finally:
            worker.close()
    return asyncio.run(whole())


async def is_gone(process):
    """Whether a process vanishes, its parent having seen that, within a second or so."""
    for _ in range(100):
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return True
        await asyncio.sleep(0.02)
    return False


def test_it_answers_as_direct_does(tiny_harmonic):
    values, seconds, doubt = with_worker(lambda worker: worker.solve(job(tiny_harmonic)))
    expected = create("direct", tiny_harmonic).fit().evaluate(ONE, "field")[0]
    np.testing.assert_allclose(values, expected, rtol=1e-10, atol=1e-12 * np.abs(expected).max())
    assert seconds > 0
    assert doubt == ""


@pytest.mark.parametrize("pause", [0.0, 0.01, 0.3])
def test_cancelling_kills_it_and_the_next_job_starts_another(harmonic, pause):
    async def scenario(worker):
        if pause:
            await worker.solve(job(harmonic))
        before = worker.process_id
        # a thousand points, each factorised: some seconds
        many = CaseArrays(np.zeros((1000, 1), int), np.ones((1000, 1)), np.linspace(1, 300, 1000), np.full(1000, 0.1))
        task = asyncio.create_task(worker.solve(job(harmonic, many)))
        await asyncio.sleep(pause)
        start = asyncio.get_running_loop().time()
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert asyncio.get_running_loop().time() - start < 2.0
        assert worker.process_id is None
        assert before is None or await is_gone(before)
        values, *_ = await worker.solve(job(harmonic))
        assert np.isfinite(values).all()
    with_worker(scenario)


@pytest.mark.parametrize("pause", [0.0, 0.3, 3.0])  # before the process has started, while it does, while it solves
def test_however_often_one_is_cancelled_another_is_not_disturbed(harmonic, pause):
    async def scenario(worker):
        many = CaseArrays(np.zeros((1000, 1), int), np.ones((1000, 1)), np.linspace(1, 300, 1000), np.full(1000, 0.1))
        first = asyncio.create_task(worker.solve(job(harmonic, many)))
        await asyncio.sleep(pause)
        others = [asyncio.create_task(worker.solve(job(harmonic))) for _ in range(3)]
        for _ in range(5):
            first.cancel()
            others[1].cancel()
            await asyncio.sleep(0)
        found = await asyncio.gather(first, *others, return_exceptions=True)
        assert [isinstance(one, asyncio.CancelledError) for one in found] == [True, False, True, False]
        np.testing.assert_array_equal(found[1].values, found[3].values)
    with_worker(scenario)


def test_what_cannot_be_solved_is_told_in_one_sentence(tiny_harmonic):
    async def scenario(worker):
        with pytest.raises(SolverError, match="is no method"):
            await worker.solve(job(tiny_harmonic, method="magic"))
        values, *_ = await worker.solve(job(tiny_harmonic))
        assert np.isfinite(values).all()
    with_worker(scenario)


def test_a_process_that_died_is_told_and_replaced(tiny_harmonic):
    async def scenario(worker):
        await worker.solve(job(tiny_harmonic))
        os.kill(worker.process_id, 9)
        with pytest.raises(SolverError, match="ask again"):
            await worker.solve(job(tiny_harmonic))
        values, *_ = await worker.solve(job(tiny_harmonic))
        assert np.isfinite(values).all()
    with_worker(scenario)


def test_what_direct_doubts_is_told(harmonic):
    frequency = create("modal", harmonic).fit().eigenvalue[:1] ** 0.5 / (2 * np.pi)
    undamped = CaseArrays(ONE.node, ONE.force, frequency * (1 + 1e-8), np.zeros(1))
    _, _, doubt = with_worker(lambda worker: worker.solve(job(harmonic, undamped)))
    assert "round" in doubt
    assert "\n" not in doubt
