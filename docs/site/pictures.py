"""Pictures of the site, with their sizes: those of docs/pictures in PNG become lossless WebP, which is half as large."""

from __future__ import annotations

from pathlib import Path

from mkdocs.structure.files import File
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
# Made once, not for each build.
MADE = ROOT / "target" / "pictures"


def place(path):
    """Place in the site of a file of docs/, with another suffix if it is a picture in PNG."""
    return path.removesuffix(".png") + ".webp" if path.endswith(".png") else path


def replaced(files, config):
    """The files of the site, with WebP instead of PNG."""
    MADE.mkdir(parents=True, exist_ok=True)
    for file in list(files):
        if not (file.src_uri.startswith("pictures/") and file.src_uri.endswith(".png")):
            continue
        made = MADE / place(Path(file.src_uri).name)
        if not made.exists() or made.stat().st_mtime < Path(file.abs_src_path).stat().st_mtime:
            with Image.open(file.abs_src_path) as picture:
                # Slower methods bring little.
                picture.save(made, lossless=True, quality=100, method=4)
        files.remove(file)
        files.append(File.generated(config, place(file.src_uri), abs_src_path=str(made)))
    return files


def size(file):
    """Attributes with the size of a picture, so that nothing moves when it has come."""
    if file is None or not file.src_uri.endswith((".webp", ".gif", ".png")):
        return ""
    with Image.open(file.abs_src_path) as picture:
        return f'width="{picture.width}" height="{picture.height}" '
