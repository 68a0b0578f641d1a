"""Initial stress and excavation: a column whose upper half is removed."""

from __future__ import annotations

import ddem
import numpy as np
import pytest

ROCK = ddem.Material(density=2400, young=18e9, poisson=0.25)
SEAM = ddem.Joint(thickness=0.02, material=ROCK)
STRESS = (-3e6, -3e6, -8e6, 0.0, 0.0, 0.0)


def column(release: float | None = None, held: bool = True) -> ddem.Model:
    model = ddem.Model(title="column")
    model.add_blocks(size=(1, 1, 4), count=(1, 1, 4), divisions=2, material=ROCK, joint=SEAM)
    model.initial(stress=STRESS)
    model.fix("xy")
    model.fix("z", z=0.0)
    if held:
        model.fix("z", z=4.0)
    model.stage("before", kind="relax")
    model.stage("dig", kind="relax", tolerance=1e-9)
    model.remove(z=(2.0, 4.0), from_="dig", release=release)
    return model


@pytest.mark.parametrize("release", [None, 1.0])
def test_excavated_face_moves_by_elastic_unloading(release: float | None) -> None:
    simulation = column(release).build()
    assert simulation.stress == pytest.approx(np.tile(STRESS, (32, 1)), rel=1e-9)
    assert not simulation.field("removed").any()
    simulation.enter("dig")
    simulation.relax(tolerance=1e-9, quiet=True)
    removed = simulation.field("removed") == 1
    assert removed.tolist() == [False] * 16 + [True] * 16
    assert simulation.pairs["removed"].tolist() == [False] * 9 + [True] * 18
    top = np.argmin(np.linalg.norm(simulation.points - (0.5, 0.5, 1.99), axis=1))
    # H σ/(λ + 2G), below the joint at 2 m.
    assert simulation.displacement[top, 2] == pytest.approx(8e6 * 1.99 / 21.6e9, rel=1e-6)
    assert simulation.stress[0, 0] == pytest.approx(-3e6 + 8e6 / 3, rel=1e-5)
    assert simulation.fragments["blocks"].tolist() == [2]
    assert simulation.block_fragment.tolist() == [0, 0, 1, 1]


def test_unbalanced_face_warns() -> None:
    with pytest.warns(UserWarning, match=r"the outer faces at z = 4\.0+ m.*do not carry"):
        column(held=False).build()


def test_stress_gradient_balances_weight() -> None:
    model = ddem.Model(gravity=(0, 0, -10))
    model.add_blocks(size=(1, 1, 2), count=(1, 1, 2), divisions=2, material=ROCK, joint=SEAM)
    model.initial(stress=(-1e4, -1e4, -4.8e4, 0, 0, 0), gradient={"z": (0, 0, 2.4e4, 0, 0, 0)})
    model.fix("xy")
    model.fix("z", z=0.0)
    simulation = model.build()
    simulation.relax(tolerance=1e-9, quiet=True)
    assert np.abs(simulation.displacement).max() < 1e-15


def test_materials_and_joints_change_between_stages() -> None:
    model = ddem.Model(gravity=(0, 0, -10))
    soft = ddem.Material(name="soft", density=ROCK.density, young=ROCK.young / 2, poisson=ROCK.poisson)
    model.add_blocks(size=(1, 1, 2), divisions=2, material=ROCK)
    model.fix("xyz", z=0.0)
    model.stage("dry", kind="relax", tolerance=1e-10)
    model.stage("wet", kind="relax", tolerance=1e-10)
    model.assign(material=soft, from_="wet")
    simulation = model.build()
    settled = []
    for stage in ("dry", "wet"):
        simulation.enter(stage)
        simulation.relax(tolerance=1e-10, quiet=True)
        settled.append(simulation.displacement[:, 2].min())
    assert settled[1] == pytest.approx(2 * settled[0], rel=1e-8)
    model.assign(joint=ddem.Joint(name="stiff", normal_stiffness=1e9, shear_stiffness=1e9), from_="wet")
    with pytest.raises(ddem.ModelError, match="no joint"):
        model.build()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"release": -1.0, "from_": "dig"}, "must be 0 or more"),
        ({"from_": "dug"}, "no stage named `dug`"),
        ({"from_": "before"}, "is the first stage"),
        ({"release": 1.0}, "`release` needs `from_`"),
    ],
)
def test_invalid_excavations_are_refused(change: dict[str, object], message: str) -> None:
    model = column()
    model.remove(z=(1.0, 2.0), **change)  # type: ignore[arg-type]
    with pytest.raises(ddem.ModelError, match=message):
        model.build()
    with pytest.raises(ddem.ModelError, match="`gradient` needs `stress`"):
        other = column()
        other.initial(gradient={"z": (0, 0, 1, 0, 0, 0)})
        other.build()


def test_removed_blocks_are_not_drawn() -> None:
    from ddem._layers import blocks
    from ddem._scene import scene_of

    simulation = column().build()
    for stage, top in (("before", 4.0), ("dig", 1.99)):
        simulation.enter(stage)
        frame = scene_of(simulation, -1, joints=False)
        (layer,) = blocks(frame, "stress", "zz", None, (None, None), 0.0, "none", 1.0)
        assert layer.points[:, 2].max() == pytest.approx(top)
        assert layer.values is not None and (layer.values < -1e6).all()


def test_probes_exclude_removed_blocks() -> None:
    model = column()
    model.probe("gone", at=(0.5, 0.5, 3.0), quantity="stress")
    model.probe("all", x=0.5, quantity="stress")
    with pytest.warns(UserWarning, match="all blocks of probe `gone` are removed by stage `dig`"):
        simulation = model.build()
    for stage in ("before", "dig"):
        simulation.relax(name=stage, tolerance=1e-9, quiet=True)
    probes = simulation.probes
    assert probes["gone"]["zz"][0] == pytest.approx(-8e6)
    assert np.isnan(probes["gone"]["zz"][-1])
    assert probes["all"]["zz"][0] == pytest.approx(-8e6)
    assert probes["all"]["xx"][-1] == pytest.approx(-3e6 + 8e6 / 3, rel=1e-5)


def test_removed_blocks_do_not_return() -> None:
    simulation = column().build()
    simulation.enter("dig")
    with pytest.raises(ddem.ModelError, match="stage: `before` comes before `dig`.*forwards only"):
        simulation.enter("before")
    with pytest.raises(ddem.ModelError, match="name: `before` comes before `dig`"):
        simulation.relax(name="before", quiet=True)
    assert simulation.field("removed").any()
    simulation.displacement = np.ones_like(simulation.displacement)
    assert not simulation.displacement[54:].any()
    assert simulation.displacement[:54].all()
