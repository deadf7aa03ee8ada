"""The file on disk: units, UGRID, complex parts, plain readers; what is refused, and by name."""

import netCDF4
import numpy as np
import pytest
import xarray as xr

from rom.datasets import SCHEMA_VERSION, check_schema, read_dataset, write_dataset
from rom.errors import SchemaError
from rom.fingertip import TISSUES
from rom.scenes.complex_parts import decode_complex, encode_complex


@pytest.fixture(params=["static", "harmonic"])
def kind(request):
    return request.param


@pytest.fixture
def file(kind, request):
    return request.getfixturevalue(f"{kind}_file")


@pytest.fixture
def data(kind, request):
    return request.getfixturevalue(f"{kind}_data")


def refused(path, *words):
    with pytest.raises(SchemaError) as refusal:
        read_dataset(path)
    text = str(refusal.value)
    assert path.name in text and "\n" not in text
    for word in words:
        assert word in text


@pytest.mark.parametrize("compress", [False, True])
def test_round_trip(data, tmp_path, compress):
    path = tmp_path / "again.nc"
    write_dataset(data, path, compress)
    xr.testing.assert_identical(read_dataset(path), data)


def test_some_cases_alone_can_be_read(file, data):
    pick = np.array([2, 7, 40])
    xr.testing.assert_identical(read_dataset(file, pick), data.isel(case=pick))
    xr.testing.assert_identical(read_dataset(file, slice(5)), data.isel(case=slice(5)))


def test_every_variable_has_a_name_and_a_unit(file):
    with netCDF4.Dataset(file) as raw:
        for name, variable in raw.variables.items():
            assert "long_name" in variable.ncattrs(), name
            if variable.dtype is not str and variable.dtype.kind in "iuf" and name != "mesh":  # UGRID's empty container
                assert "units" in variable.ncattrs(), name


def test_units_are_si(file):
    units = {"displacement": "m", "force_amplitude": "N", "node_x": "m", "residual": "1", "solve_seconds": "s",
             "frequency": "Hz", "loss_factor": "1"}
    with netCDF4.Dataset(file) as raw:
        found = {name: raw[name].units for name in units if name in raw.variables}
    assert found == {name: units[name] for name in found}
    assert {"displacement", "force_amplitude", "node_x"} <= set(found)


def test_a_plain_reader_gets_real_and_imaginary_parts(harmonic_file, harmonic_data):
    with netCDF4.Dataset(harmonic_file) as raw:
        stored = raw["displacement"]
        assert stored.dimensions == ("case", "node", "component", "part")
        assert list(raw["part"][:]) == ["real", "imag"]
        truth = harmonic_data["displacement"].values
        np.testing.assert_array_equal(stored[..., 0], truth.real)
        np.testing.assert_array_equal(stored[..., 1], truth.imag)
        assert np.abs(truth.imag).max() > 0


def test_static_files_have_no_parts(static_file):
    with netCDF4.Dataset(static_file) as raw:
        assert raw["displacement"].dimensions == ("case", "node", "component")
        assert raw["displacement"].dtype == np.float64
        assert "part" not in raw.dimensions


def test_mesh_follows_ugrid(file, small_tip):
    mesh = small_tip.mesh
    with netCDF4.Dataset(file) as raw:
        topology = raw["mesh"]
        assert topology.cf_role == "mesh_topology" and topology.topology_dimension == 3
        assert [np.asarray(raw[name][:]) for name in topology.node_coordinates.split()][2].shape == (mesh.n_nodes,)
        connectivity = raw[topology.volume_node_connectivity]
        assert connectivity.cf_role == "volume_node_connectivity" and connectivity.start_index == 0
        np.testing.assert_array_equal(connectivity[:], mesh.hexahedra)
        assert raw[topology.volume_shape_type].cf_role == "volume_shape_type"
        assert raw["displacement"].mesh == "mesh" and raw["displacement"].location == "node"
        assert raw["tissue"].flag_meanings.split() == list(TISSUES)
        np.testing.assert_array_equal(raw["tissue"][:], mesh.tissue)
        assert {"CF-1.11", "UGRID-1.0"} <= set(raw.Conventions.replace(",", " ").split())
        assert {"node_x", "node_y", "node_z"} <= set(raw["displacement"].coordinates.split())


def test_files_say_where_they_come_from(file, small_tip):
    with netCDF4.Dataset(file) as raw:
        assert raw.schema_version == SCHEMA_VERSION
        assert raw.scene_hash == small_tip.content_hash
        assert "numpy" in raw.software_versions and raw.commit
        assert raw.software == "fingertip-rom"


def test_stored_truth_is_verified(data):
    assert float(data["residual"].max()) <= 1e-10  # the limit of a truth
    assert (data["solve_seconds"] > 0).all()


def test_parts_are_the_complex_numbers(harmonic_data):
    few = harmonic_data.isel(case=slice(2))
    xr.testing.assert_identical(decode_complex(encode_complex(few)), few)


# ---- refusals -----------------------------------------------------------------------------------------------

@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.999])
def test_truncated_files_are_refused(file, tmp_path, share):
    cut = tmp_path / "cut.nc"
    content = file.read_bytes()
    cut.write_bytes(content[:int(share * len(content))])
    refused(cut, "truncated")


def test_damaged_content_is_refused(data, tmp_path):
    path = tmp_path / "scratched.nc"
    write_dataset(data, path, compress=True)
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle:middle + 4000] = b"\xff" * 4000  # inside a compressed chunk
    path.write_bytes(content)
    refused(path, "damaged")


def test_text_and_absent_files_are_refused(tmp_path):
    text = tmp_path / "notes.nc"
    text.write_text("four words of nonsense\n")
    refused(text, "no netCDF file")
    refused(tmp_path / "absent.nc", "does not exist")
    (tmp_path / "folder.nc").mkdir()
    refused(tmp_path / "folder.nc", "does not exist")


def test_foreign_netcdf_is_refused(tmp_path):
    path = tmp_path / "weather.nc"
    xr.Dataset({"rain": ("day", [1.0, 2.0])}).to_netcdf(path)
    refused(path, "no dataset of this toolkit", "schema_version")


@pytest.mark.parametrize("version", ["0.9", "2.0"])
def test_other_schema_versions_are_refused(file, tmp_path, version):
    path = tmp_path / "old.nc"
    path.write_bytes(file.read_bytes())
    with netCDF4.Dataset(path, "a") as raw:
        raw.schema_version = version
    refused(path, f"schema version {version}", f"reads {SCHEMA_VERSION}", "rom dataset")


@pytest.mark.parametrize("name", ["load_node", "force_amplitude", "displacement"])
def test_missing_variables_are_refused(data, tmp_path, name):
    path = tmp_path / "part.nc"
    few = data.isel(case=slice(2)).drop_vars(name)
    with pytest.raises(SchemaError, match=f"lacks {name}"):
        check_schema(few, "here")
    with pytest.raises(SchemaError, match=f"lacks {name}"):
        write_dataset(few, path)
    assert not path.exists()
    encode_complex(few).to_netcdf(path)
    refused(path, f"lacks {name}")


def test_other_scenes_and_meshes_are_refused(static, harmonic, tiny_harmonic, static_data, harmonic_data):
    harmonic.check_origin(harmonic_data)
    with pytest.raises(SchemaError, match="'static-point-forces', not to 'harmonic-point-force'"):
        harmonic.check_origin(static_data)
    with pytest.raises(SchemaError, match="another body or mesh"):
        tiny_harmonic.check_origin(harmonic_data)
