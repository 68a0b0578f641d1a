"""Films show every frame at its place, and no removed block."""

import ddem
import numpy as np
import pytest
from sample_models import refused

pytest.importorskip("pyvista")
Image = pytest.importorskip("PIL.Image")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A block that flies to the right, beside a block that is fixed and later removed."""
    out = tmp_path_factory.mktemp("films") / "flight"
    model = ddem.Model(title="flight", contact=False)
    rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
    for name, at in (("held", 0.0), ("free", 2.0)):
        model.add_blocks(
            name=name, origin=(at, 0, 0), size=(1, 1, 1), material=rock, body="rigid"
        )
    model.fix("xyz", set="held")
    model.initial(velocity=(10, 0, 0), set="free")
    model.remove(set="held", from_="gone")
    model.stage("fly", kind="dynamic", duration=0.2, frames=4)
    model.stage("gone", kind="dynamic", duration=0.2, frames=4)
    ddem.run_deck(model, out=out, quiet=True)
    return out


def pictures(path):
    film = Image.open(path)
    found = []
    for number in range(film.n_frames):
        film.seek(number)
        found.append(np.asarray(film.convert("RGB"), dtype=int))
    return film, found


SEEN = {"view": "xz", "window_size": (600, 400), "edges": "none"}


def columns(picture):
    """Columns of a picture that are not empty, away from text, axes and colour bar."""
    part = picture[120:300, :]
    return np.flatnonzero((np.abs(part - 255).sum(axis=2) > 30).any(axis=0))


def test_animated_blocks_move_and_disappear(folder, tmp_path):
    made = ddem.animate(folder, tmp_path / "film.gif", "block", fps=10, **SEEN)
    film, found = pictures(made)
    assert made == tmp_path / "film.gif" and film.size == (600, 400)
    assert film.n_frames == len(ddem.Results(folder)) == 9
    right = [columns(picture).max() for picture in found]
    # 10 m/s: the same distance between successive pictures, to a pixel or two.
    assert np.ptp(np.diff(right)) <= 2 and min(np.diff(right)) > 20
    left = np.array([columns(picture).min() for picture in found])
    # The camera does not move, and neither does the fixed block until it is removed.
    assert np.ptp(left[:5]) <= 1
    assert (left[5:] > left[0] + 50).all()


def test_animation_has_one_colour_bar(folder, tmp_path):
    """The displacement grows, so the colour changes from red at first to yellow at the end."""
    made = ddem.animate(ddem.Results(folder), tmp_path / "film.gif", cmap="autumn", **SEEN)
    _, found = pictures(made)
    shades = []
    for picture in found:
        at = columns(picture).max() - 15
        shades.append(picture[210, at, 1])
    assert (np.diff(shades) > 5).all()


def test_animation_takes_user_arrays_and_frames(folder, tmp_path):
    values = np.array([np.nan, 1.0])
    look = {"label": "mine", "title": "words", "frames": slice(None, None, 4), "clim": (0, 2)}
    film, _ = pictures(ddem.animate(folder, tmp_path / "film.gif", values, **look, **SEEN))
    assert film.n_frames == 3
    film, found = pictures(ddem.animate(folder, tmp_path / "two.gif", frames=[-1, 0], **SEEN))
    assert columns(found[0]).max() > columns(found[1]).max()
    for field in ("velocity", "fragment"):
        assert ddem.animate(folder, tmp_path / f"{field}.gif", field, frames=[0, -1]).exists()
    camera = ((2.5, -30.0, 0.5), (2.5, 0.5, 0.5), (0, 0, 1))
    _, found = pictures(
        ddem.animate(folder, tmp_path / "near.gif", frames=[0, 1], camera=camera, **SEEN)
    )
    # At a distance of 30.5 m half of the picture is 8.2 m high, so a metre has 24 pixels.
    assert columns(found[1]).max() - columns(found[0]).max() == pytest.approx(0.5 * 24.5, abs=2)


def test_animation_is_written_as_mp4(folder, tmp_path):
    imageio = pytest.importorskip("imageio.v2")
    pytest.importorskip("imageio_ffmpeg")
    made = ddem.animate(folder, tmp_path / "film.mp4", fps=12, **SEEN)
    with imageio.get_reader(made) as film:
        assert film.count_frames() == 9 and film.get_meta_data()["fps"] == 12


def test_animation_reuses_the_scene(folder, tmp_path, monkeypatch):
    import pyvista as pv

    made = []
    add = pv.Plotter.add_mesh
    monkeypatch.setattr(
        pv.Plotter, "add_mesh", lambda self, *args, **keys: made.append(1) or add(self, *args, **keys)
    )
    ddem.animate(folder, tmp_path / "film.gif")
    assert len(made) <= 2


def test_invalid_animations_are_refused(folder, tmp_path, monkeypatch):
    def message(*args, kind=ValueError, **keys):
        return refused(lambda: ddem.animate(folder, *args, **keys), kind)

    assert "'.avi' is not valid" in message("film.avi")
    assert "did you mean 'velocity'" in message("film.gif", "velocty")
    assert "fps: 0" in message("film.gif", fps=0)
    assert "frames: 99 does not exist, there are 9 frames" in message("film.gif", frames=[99])
    assert "frames: the selection is empty" in message("film.gif", frames=slice(0, 0))
    assert "view: 'zx'" in message("film.gif", view="zx")
    assert "camera: expected three vectors" in message(tmp_path / "film.gif", camera=(1, 2, 3))
    import sys

    monkeypatch.setitem(sys.modules, "imageio", None)
    monkeypatch.setitem(sys.modules, "imageio.v2", None)
    assert "imageio[ffmpeg]" in message("film.mp4", kind=ImportError)
