import sys
from pathlib import Path

import meshio
import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for brick_models.py and model_files.py, which tests import

from brick_models import STEEL, bricks

from rom.bodies import body_from_mesh


@pytest.fixture(scope="session")
def block():
    nodes, cells = bricks()
    return body_from_mesh(meshio.Mesh(nodes, [("hexahedron", cells)]), STEEL, held=["x=min"], formulation="full")
