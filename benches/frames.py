"""Measures what frames cost beside the steps between them.

    python benches/frames.py BINARY [--rounds 5]

BINARY is a program ddem of a release build. It steps a million nodes under gravity, with many frames and with one.
The time of a frame comes from the difference of the times of output; the last line is the median of the rounds.
"""

import argparse
import json
import statistics
import subprocess
import tempfile
from pathlib import Path

import decks

# Time of about 100 steps [s].
DURATION = 1.4e-3
FEW, MANY = 1, 21


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
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    parts = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(arguments.rounds):
            few, many = (stage(arguments.binary, Path(folder), n) for n in (FEW, MANY))
            frame = (many["profile"]["output"] - few["profile"]["output"]) / (MANY - FEW)
            steps = 100 * many["wall_seconds"] / many["steps"]
            parts.append(frame / steps)
            print(f"a frame {frame:.2f} s, 100 steps {steps:.2f} s: {100 * parts[-1]:.1f} %")
    print(f"a frame every 100 steps: {100 * statistics.median(parts):.1f} %")


if __name__ == "__main__":
    main()
