"""Errors of pictures, and missing packages."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ddem import _scene
from ddem._plot import plot

pytest.importorskip("pyvista")
pytest.importorskip("plotly")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"field": "displacment"}, "field: 'displacment' .* did you mean 'displacement'"),
        ({"field": "slip"}, "use joints='slip'"),
        ({"component": "zz"}, "component: 'zz' .* valid: 'x', 'y', 'z', 'magnitude'"),
        ({"field": "stress", "component": "mises"}, "did you mean 'von_mises'"),
        ({"field": "mass", "component": "x"}, "component: 'x' is not possible"),
        ({"field": np.zeros(7)}, r"field: .* \(7,\); .* 108 \(nodes\) or 32 \(elements\)"),
        ({"field": np.zeros((108, 4))}, "field: 4 numbers per row"),
        ({"field": np.array(["a"] * 108)}, "must have numbers"),
        ({"joints": "states"}, "joints: 'states' .* did you mean 'state'"),
        ({"joints": "damage", "joint_component": "x"}, "joint_component: 'damage' has no components"),
        ({"view": "zx"}, "view: 'zx'"),
        ({"edges": "block"}, "edges: 'block' .* did you mean 'blocks'"),
        ({"cmap": "virids"}, "cmap: 'virids' .* did you mean 'viridis'"),
        ({"clim": (1.0, 1.0)}, "clim"),
        ({"frame": 3}, "frame"),
        ({"scale": np.nan}, "scale: nan is not finite"),
    ],
)
def test_invalid_options_are_named(simulation, options, message):
    with pytest.raises(ValueError, match=message):
        plot(simulation, show=False, **options)


def test_undrawable_simulations_are_refused(simulation):
    simulation.displacement[3, 1] = np.inf
    with pytest.raises(ValueError, match="not finite at 1 nodes"):
        plot(simulation, show=False)
    simulation.displacement[3, 1] = 0.0
    simulation.pairs, simulation.quads = simulation.pairs[:0], simulation.quads[:0]
    with pytest.raises(ValueError, match="no joints"):
        plot(simulation, joints="state", show=False)
    with pytest.raises(TypeError, match="a folder of results, found int"):
        plot(3, show=False)


def test_missing_display_is_an_error(simulation, monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RuntimeError, match="no display"):
        plot(simulation)


@pytest.mark.parametrize("name", ["pyvista", "matplotlib"])
def test_missing_packages_are_named(name):
    call = "_plot.plot(None)" if name == "pyvista" else "_probes.plot_probes(None)"
    code = f"""
import sys
sys.modules[{name!r}] = None
from ddem import _plot, _probes
try:
    {call}
except ImportError as error:
    assert 'pip install "ddem[plot]"' in str(error), error
else:
    raise SystemExit("no error")
assert not any(m.split(".")[0] in ("vtk", "vtkmodules") for m in sys.modules)
"""
    package = Path(_scene.__file__).parents[1]
    run = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(package)!r})\n{code}"]
    subprocess.run(run, check=True)
