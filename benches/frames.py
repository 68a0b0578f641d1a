"""Measures what frames cost beside the steps between them.

    python benches/frames.py BINARY [--rounds 3]

BINARY is a program ddem of a release build. It steps a million nodes under gravity with frames that are about 100
steps apart, and once with few frames. The time of a frame is the difference of the times of output.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import decks

# Time of about 300 steps [s].
DURATION = 4e-3
FEW, MANY = 1, 3


def stage(binary: Path, folder: Path, frames: int) -> dict:
    """Summary of the stage of a run."""
    deck = folder / "deck.toml"
    stepping = decks.stepping(DURATION).replace("frames = 1", f"frames = {frames}")
    deck.write_text(decks.lattice(20, gravity=-9.81, floor=True) + stepping)
    out = folder / "out"
    command = [binary, deck, "--out", out, "--overwrite", "--quiet", "--profile"]
    subprocess.run(command, check=True)
    return json.loads((out / "summary.json").read_text())["stages"][0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("binary", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(arguments.rounds):
            few, many = (stage(arguments.binary, Path(folder), n) for n in (FEW, MANY))
            frame = (many["profile"]["output"] - few["profile"]["output"]) / (MANY - FEW)
            steps = 100 * many["wall_seconds"] / many["steps"]
            print(f"a frame {frame:.2f} s, 100 steps {steps:.2f} s: {100 * frame / steps:.1f} %")


if __name__ == "__main__":
    main()
