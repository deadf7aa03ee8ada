"""Animations show one whole cycle that closes, of the right motion, in a file that is small."""

import numpy as np
import pytest
from PIL import Image
from presentation.animation import Vibration, film


@pytest.fixture
def skin(small_tip):
    mesh = small_tip.mesh
    return mesh.nodes[mesh.skin_nodes] * 1e3, mesh.skin_quads


def swing(position, factor=1.0):
    """Side to side, more towards the tip."""
    u = np.zeros(position.shape, dtype=np.result_type(factor))
    u[:, 1] = factor * 1e-5 * position[:, 0]
    return u


def shown(folder, *what, **options):
    """Frames of a film (frame, row, column, colour), what its file says of itself, and its size [byte]."""
    one = film("a.gif", *what, **options)
    one.write(folder)
    path = folder / one.file
    with Image.open(path) as image:
        shots = []
        for k in range(image.n_frames):
            image.seek(k)
            shots.append(np.asarray(image.convert("RGB")).astype(int))
        return np.array(shots), image.info, path.stat().st_size


def test_a_free_mode_moves_as_a_sine_and_a_forced_one_as_its_real_part():
    shape = np.ones((5, 3))
    phases = np.linspace(0, 2 * np.pi, 9)
    free, forced = Vibration("free", shape), Vibration("forced", (2 - 3j) * shape)
    for phase in phases:
        np.testing.assert_allclose(free.at(phase), np.sin(phase) * shape, atol=1e-15)
        np.testing.assert_allclose(forced.at(phase), (2 * np.cos(phase) + 3 * np.sin(phase)) * shape, atol=1e-14)
    assert not free.note and "drawn ×" in forced.note  # a mode has no size that could be exaggerated


def test_the_cycle_is_drawn_once_and_comes_back(skin, tmp_path):
    position, quads = skin
    shots, info, _ = shown(tmp_path, position, quads, [Vibration("Mode 1", swing(position))], title="One mode",
                           frames=8)
    assert len(shots) == 8 and info["loop"] == 0
    # a sine: at rest at 0 and half a cycle, furthest out a quarter of it later, symmetric about that
    moved = np.array([np.abs(shot - shots[0]).sum() for shot in shots])
    assert moved[4] == 0 and moved[1:4].min() > 0
    assert np.abs(shots[1] - shots[3]).sum() == 0 and np.abs(shots[2] - shots[6]).sum() > 0


def test_panels_are_in_step_and_the_file_is_small(skin, tmp_path):
    position, quads = skin
    both = [Vibration("in phase", swing(position, 1 + 0j)), Vibration("a quarter later", swing(position, -1j)),
            Vibration("in phase, larger", swing(position, 7 + 0j))]
    shots, _, size = shown(tmp_path, position, quads, both, title="Three", columns=3, frames=8)
    assert size < 3e6 / 5
    left, middle, right = (shots[:, 60:-80, k * 240 + 5:(k + 1) * 240 - 5] for k in range(3))
    still = [np.abs(np.diff(part, axis=0, append=part[:1])).sum(axis=(1, 2, 3)) for part in (left, middle, right)]
    # velocity is least between the frames about the turning points, which lie a quarter of a cycle (2 frames) apart
    assert abs(int(np.argmax(still[0])) - int(np.argmax(still[1]))) % 4 == 2
    # each panel is drawn to its own scale, so the sevenfold one moves as the single one
    np.testing.assert_allclose(still[0], still[2], rtol=0.25)


@pytest.mark.parametrize(("shape", "words"), [
    (np.ones(5), "must be"), (np.full((5, 3), np.nan), "not finite"), (np.zeros((5, 3)), "is zero")])
def test_what_cannot_be_drawn_is_refused(shape, words):
    with pytest.raises(ValueError, match=words):
        Vibration("bad", shape)


def test_bad_arguments_are_refused_and_leave_no_file(skin, tmp_path):
    position, quads = skin
    mode = Vibration("Mode 1", swing(position))
    for given, options, words in (([], {}, "no vibration"), ([mode], {"frames": 2}, "too few"),
                                  ([Vibration("other", np.ones((7, 3)))], {}, "7 nodes")):
        with pytest.raises(ValueError, match=words):
            shown(tmp_path, position, quads, given, title="", **options)
    assert not list(tmp_path.iterdir())
