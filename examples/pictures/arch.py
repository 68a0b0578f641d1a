#!/usr/bin/env python3
"""An arch of dry stones that stands, and a thinner one as it falls.

    cargo run --release -- examples/arch.toml
    python examples/pictures/arch.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display. The second arch runs for half a minute.
"""

import ddem
import numpy as np

from results import ROOT, panel, results, save, scene, sheet

HEYMAN = 0.1075


def thinner(part):
    """The arch with a thickness that is a part of the least one."""
    model = ddem.Model.from_deck(ROOT / "examples" / "arch.toml")
    deck = model.deck
    prism = deck["region"][0]["prism"]
    ratio = part * HEYMAN
    scale = (1.0 + ratio / (1.0 - ratio / 2.0)) / max(x for x, _ in prism["outline"])
    prism["outline"] = [(scale * x, scale * z if z > 0.0 else z) for x, z in prism["outline"]]
    arch = ddem.Model.from_deck(deck).build()
    try:
        arch.relax(max_steps=100_000, quiet=True)
    except ddem.Collapsed as fall:
        print(fall)
    return arch


def main():
    """Draws the arch of the deck above, and one at 0.98 times the least thickness below."""
    frame, arch = ddem.Results(results("arch"))[-1], thinner(0.98)
    figure = sheet((12, 11.2), "Least thickness of a semicircular arch", "Heyman: 0.1075 of the radius; thick orange lines: open joints")
    look = {"joints": "traces", "view": "xz", "bold": 1.6}
    for shown, low, words in ((frame, 5.5, "stands at 1.02 times that"), (arch, 0.4, "falls at 0.98 times that")):
        most = np.linalg.norm(shown.displacement, axis=1).max()
        scale = float(f"{0.08 / most:.0e}")
        stones = np.full(len(shown.elements), np.nan)
        panel(
            figure,
            (0.3, low, 11.4, 4.5),
            f"{words}: displacements × {scale:g}",
            lambda size: scene(shown, stones, (0.0, 0.05, 0.53), 1.4, size, scale=scale, label=" ", **look),
        )
    save(figure, "arch.png")


if __name__ == "__main__":
    main()
