"""The nonlinear scene: what is drawn, what is refused, what makes it another scene."""

import numpy as np
import pytest
import xarray as xr

from rom.finger_on_glass.tissue import PUBLISHED_K1, VARIANTS
from rom.fingertip import Fingertip
from rom.scenes import SCENES, LinearScene, get_scene, scene_from_json
from rom.scenes.finger_on_glass import FingerOnGlass
from rom.scenes.path_population import BEYOND, beyond
from rom.scenes.paths import RANGES


@pytest.fixture(scope="module")
def scene():
    return get_scene("finger-on-glass", rays=40, layers=5)


def test_registry_tells_linear_scenes_from_contact():
    assert isinstance(get_scene("static-point-forces"), LinearScene)
    assert not isinstance(get_scene("finger-on-glass", rays=40, layers=5), LinearScene)
    assert set(SCENES) == {"static-point-forces", "harmonic-point-force", "harmonic-patch-forces", "finger-on-glass"}
    with pytest.raises(ValueError, match="takes no 3D fingertip"):
        get_scene("finger-on-glass", Fingertip.preset("metamodel"))
    with pytest.raises(ValueError, match="does not take the option colour"):
        get_scene("finger-on-glass", colour="blue")


def test_default_mesh_and_positions_are_the_declared_ones():
    scene = FingerOnGlass()
    assert (scene.rays, scene.layers, scene.n_nodes) == (100, 12, 1300)  # 100 x 13 nodes
    assert scene.n_positions == 32  # 8 shares of the force, 24 of a quarter of a millimetre
    assert scene.force_share[7] == scene.force_share[-1] == 1.0
    assert scene.travel[7] == 0.0 and scene.travel[-1] == pytest.approx(6e-3)


def test_sample_fills_each_variant_like_a_latin_hypercube(scene):
    paths = scene.sample(60, seed=4)
    assert not beyond(paths).any()
    for v, name in enumerate(VARIANTS):
        mine = paths.take(paths.variant == v)
        assert len(mine) == 20
        low, high = RANGES["c"]
        # one value in each of twenty slices is what makes a hypercube Latin
        assert sorted(np.floor((mine.c - low) / (high - low) * 20).astype(int)) == list(range(20))
        share = np.log2(mine.k1 / (1e6 * PUBLISHED_K1[name]))  # half to twice, logarithmic: -1 to 1
        assert sorted(np.floor((share + 1) / 2 * 20).astype(int)) == list(range(20))


def test_seed_decides_the_sample(scene):
    first, same, other = (scene.sample(9, seed).numbers for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, same)
    assert (first != other).all()


def test_one_input_lies_beyond_its_range(scene):
    paths = scene.sample_beyond(24, seed=3)
    outside = beyond(paths)
    assert (outside.sum(axis=1) == 1).all()
    assert (outside.sum(axis=0) == 6).all()  # each of the four inputs equally often
    for name in ("c", "friction", "normal_force"):
        (low, _), (_, high) = BEYOND[name]
        assert ((getattr(paths, name) >= low) & (getattr(paths, name) <= high)).all()
    assert (scene.hard_region(paths) == 3).all()


def test_hard_regions_are_corners_of_the_box(scene):
    paths = scene.sample(240, seed=5)
    region = scene.hard_region(paths)
    assert set(region) == {0, 1, 2}
    assert (paths.normal_force[region == 1] >= 0.65).all() and (paths.c[region == 1] <= 3000).all()
    assert (paths.friction[region == 2] <= 0.57).all()
    assert 0.7 < np.mean(region == 0) < 0.9  # enough to learn from, enough to judge by


def test_labels_and_arrays_are_inverse(scene):
    paths = scene.sample(7, seed=1)
    cases = scene.cases_from(paths)
    for found, expected in zip(scene.read(cases), paths, strict=True):
        np.testing.assert_array_equal(found, expected)
    named = cases.assign(variant=("case", np.array(VARIANTS)[paths.variant]))
    np.testing.assert_array_equal(scene.read(named).variant, paths.variant)


@pytest.mark.parametrize(("name", "value", "message"), [
    ("c", 0.0, "c holds 0: give more than zero"), ("k1", np.nan, "k1 holds nan"),
    ("friction", -0.1, "friction holds -0.1: give zero or more"), ("normal_force", 1e9, "at most 1000 N"),
    ("variant", 3, "variant holds 3, which stands for nothing"), ("c", "soft", "must be a real number of Pa"),
    ("variant", "crossed", "variant holds 'crossed': choose from radial")])
def test_bad_paths_are_refused_in_one_sentence(scene, name, value, message):
    cases = scene.cases_from(scene.sample(1)).assign({name: ("case", np.array([value]))})
    with pytest.raises(ValueError, match=message) as refusal:
        scene.read(cases)
    assert "\n" not in str(refusal.value)


def test_missing_and_misshapen_variables_are_refused(scene):
    cases = scene.cases_from(scene.sample(2))
    with pytest.raises(ValueError, match="lack the variable 'k1'"):
        scene.read(cases.drop_vars("k1"))
    with pytest.raises(ValueError, match="batch it along"):
        scene.read(cases.assign(c=("position", np.ones(32))))
    with pytest.raises(ValueError, match="holds no case"):
        scene.read(cases.isel(case=slice(0)))
    with pytest.raises(ValueError, match=r"give an xarray\.Dataset"):
        scene.read(3)


@pytest.mark.parametrize(("options", "message"), [
    ({"rays": 3}, "rays=3 cannot be"), ({"seed": -1}, "seed=-1 cannot be: give a whole number from 0 up"),
    ({"outputs": "pad"}, "outputs='pad' is unknown"), ({"section": 3}, "the section is 3: build one"),
    ({"section": {"girth": 1.0}}, "a section has no 'girth'"), ({"effective_length": 0.0}, "effective_length=0.0"),
    ({"section": {"bone_width": 30.0}}, "reaches out of a skin"),
    ({"out_of_plane_stiffness": -1.0}, "out_of_plane_stiffness=-1.0 cannot be")])
def test_scenes_that_cannot_be_are_refused(options, message):
    with pytest.raises(ValueError, match=message) as refusal:
        FingerOnGlass(**options)
    assert "\n" not in str(refusal.value)


def test_json_builds_the_same_scene(scene):
    other = get_scene("finger-on-glass", rays=40, layers=5, section={"bone_offset": 0.5}, seed=2, outputs="contact")
    for one in (scene, other):
        again = scene_from_json(one.to_json())
        assert again == one and again.content_hash == one.content_hash
    assert other.content_hash != scene.content_hash


@pytest.mark.parametrize("options", [
    {"section": {"width": 17.0}}, {"rays": 41}, {"layers": 6}, {"out_of_plane_stiffness": 0.0},
    {"effective_length": 9.0}, {"seed": 1}])
def test_hash_changes_with_everything_that_changes_the_truth(scene, options):
    assert get_scene("finger-on-glass", **{"rays": 40, "layers": 5, **options}).content_hash != scene.content_hash


def test_outputs_do_not_change_the_truth(scene):
    assert get_scene("finger-on-glass", rays=40, layers=5, outputs="contact").content_hash == scene.content_hash


def test_full_order_model_gets_the_inputs_in_its_own_units(scene):
    paths = scene.sample(3, seed=1)
    for i in range(3):
        finger, path = scene.finger(paths, i), scene.load_path(paths, i)
        assert finger.tissue.variant == VARIANTS[i]
        assert finger.tissue.c == pytest.approx(paths.c[i] * 1e-6)  # Pa to MPa
        assert finger.plate.friction == paths.friction[i]
        assert path.normal_force[-1] == paths.normal_force[i]
        assert path.travel[-1] == pytest.approx(6.0)  # mm
    assert isinstance(scene.cases_from(paths), xr.Dataset)
