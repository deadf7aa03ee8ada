"""The fingertip: anatomy in, mesh and matrices out."""

from rom.fingertip.anatomy import TISSUES, Anatomy, Tissue
from rom.fingertip.body import FingertipBody
from rom.fingertip.fingertip import DIRECTIONS, PRESETS, Fingertip
from rom.fingertip.interpolation import interpolation_from
from rom.fingertip.mesh import FingertipMesh, build_mesh
from rom.fingertip.shape import SurfaceShape
from rom.fingertip.shell import MeshDensity

__all__ = [
    "DIRECTIONS",
    "PRESETS",
    "TISSUES",
    "Anatomy",
    "Fingertip",
    "FingertipBody",
    "FingertipMesh",
    "MeshDensity",
    "SurfaceShape",
    "Tissue",
    "build_mesh",
    "interpolation_from",
]
