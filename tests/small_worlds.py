"""Two small worlds for tests, each with a dataset: a plate of five nodes, the finger on glass with random answers."""

import numpy as np
import scipy.sparse as sp

from rom.bodies import Body, Grid, Loads
from rom.datasets import read_dataset, solve_dataset
from rom.datasets.schema import dataset_attributes
from rom.scenes import Input, LinearScene, Question, get_scene

FORCE = ("case", "force")


class Plate:
    """A scene of five nodes, two of them held, with forces in two directions and phases; its dataset and a method."""

    method, options = "pod-galerkin", {"rank": 4}

    def __init__(self, folder):
        rng = np.random.default_rng(0)
        root = rng.standard_normal((9, 9))
        grid = Grid(rng.random((5, 3)), np.r_[3:6, 9:15], {"tetra": np.array([[0, 1, 2, 3], [1, 2, 3, 4]])},
                    names=np.array([10, 3, 7, 21, 15]))
        body = Body(sp.csr_matrix(1e3 * (root @ root.T + 9 * np.eye(9))), sp.csr_matrix(
            np.diag(rng.uniform(1e-3, 2e-3, 9))), grid=grid, name="plate")
        loads = Loads(np.eye(9)[:, [0, 1, 6, 7]], {"load_node": np.array([3, 3, 21, 21]),
                                                   "direction": np.array(["x", "y", "x", "y"])})
        self.scene = LinearScene(body, loads, Question(
            "plate-forces", "Forces on a plate", "How does it vibrate?", True, phases=True, loads=(
                Input("load_node", "1", "node", dims=FORCE), Input("direction", "", "x or y", dims=FORCE)),
            amplitude=Input("force_amplitude", "N", "any", dims=FORCE, range=(0.1, 1.0)),
            points=(Input("frequency", "Hz", "any", range=(1.0, 200.0)),
                    Input("loss_factor", "1", "any", range=(0.1, 0.3), default=0.1))))
        cases = self.scene.sample(16, 1)
        rng = np.random.default_rng(1)
        cases = type(cases)(rng.integers(0, 4, (16, 2)), rng.random((16, 2)) * np.exp(1j * rng.random((16, 2))),
                            cases.frequency, cases.loss_factor)
        cases.force[::3, 1] = 0.0  # some cases have one force
        self.file = solve_dataset(self.scene, cases, folder / "plate.nc")
        self.data = read_dataset(self.file)


class Glass:
    """The finger on glass with random answers; its dataset and a method."""

    method, options = "interpolation", {}

    def __init__(self, folder):
        self.scene = get_scene("finger-on-glass", rays=16, layers=2)
        cases = self.scene.cases_from(self.scene.sample(12, 1))
        rng = np.random.default_rng(1)
        sizes = {**{name: len(values) for name, values in self.scene._labels.items()}, "case": 12}
        answers = {name: rng.random([12, *(sizes[dim] for dim in quantity.dims)])
                   for name, quantity in self.scene.quantities.items()}
        data = self.scene.label(cases, answers).assign(
            reached=(("case", "position"), np.ones((12, sizes["position"]), dtype=bool)))
        data.attrs.update(dataset_attributes(self.scene))
        self.data = data
        self.file = folder / "glass.nc"
        data.to_netcdf(self.file)
