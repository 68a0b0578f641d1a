"""Compares the speed of two builds of ddem: part of how a change is accepted.

    python benches/compare.py OLD NEW [--rounds 5] [--only WORD] [--limit 2]

OLD and NEW are binaries of ddem, for example of the release builds before and after a change. Both
run the same decks in turns, old-new-new-old. What counts is the processor time of the steps of all
threads: that of a run with many steps less that of a run with few, so that start-up and output
cancel, each the least of all rounds. Other programs on the machine disturb it much less than wall
time. A deck on which the new build is more than the limit (2 %) slower gets up to four times the
rounds before it counts as slower. Exits with status 1 if any deck is slower. Compare a binary with
itself to see the noise of the machine.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import decks

STRONG = "cohesion = 1e12\ntension = 1e12\nfriction = 2\n"
WEAK = "cohesion = 0.0\ntension = 0.0\nfriction = 2\n"


# Simulated time of the run with few steps, as a part of that of the other run.
SHORT = 1 / 50


def cases() -> dict[str, tuple[str, str, int]]:
    """Decks by name: with many steps, with few, and the number of threads."""
    found = {}

    def add(name: str, text: str, many: str, few: str, threads: tuple[int, ...]) -> None:
        for number in threads:
            found[f"{name}, {number} thread{'s' * (number > 1)}"] = text + many, text + few, number

    for count, duration in ((4, 0.15), (10, 5e-3), (20, 6e-4)):
        stages = decks.stepping(duration), decks.stepping(SHORT * duration)
        add(f"intact, {125 * count**3} nodes", decks.lattice(count), *stages, (1, 2))
    stages = decks.stepping(4e-3), decks.stepping(SHORT * 4e-3)
    add("checked, 125000 nodes", decks.lattice(10, strength=STRONG), *stages, (1,))
    # The first stage breaks the joints.
    broken = decks.lattice(8, strength=WEAK) + decks.torn(8) + decks.stepping(2e-4, "tears")
    add("broken, 64000 nodes", broken, *stages, (1,))
    stages = decks.stepping(0.01), decks.stepping(SHORT * 0.01)
    add("breaking springs, 27000 blocks", decks.springs(30), *stages, (1, 2))
    relaxation = decks.lattice(20, divisions=2, gravity=-9.81, floor=True)
    add("relaxation, 216000 nodes", relaxation, decks.relaxing(200), decks.relaxing(4), (1, 2))
    return found


def seconds(binary: Path, deck: Path, threads: int) -> float:
    """Processor time of a run."""
    out = deck.parent / "out"
    command = [binary, deck, "--out", out, "--threads", str(threads), "--overwrite", "--quiet"]
    process = subprocess.Popen(command)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{binary} ended with status {process.returncode}")
    return usage.ru_utime + usage.ru_stime


@dataclass
class Pair:
    """Processor times of the old and the new build on one deck, with many steps and with few."""

    decks: tuple[Path, Path]
    threads: int
    times: dict[tuple[int, int], list[float]] = field(default_factory=dict)

    def run(self, binaries: list[Path], rounds: int) -> None:
        for k in range(rounds):
            for side in (0, 1) if k % 2 == 0 else (1, 0):
                for length, deck in enumerate(self.decks):
                    time = seconds(binaries[side], deck, self.threads)
                    self.times.setdefault((side, length), []).append(time)

    def steps(self, side: int) -> float:
        """Least processor time of the steps."""
        return min(self.times[side, 0]) - min(self.times[side, 1])

    @property
    def ratio(self) -> float:
        """Speed of the new build over that of the old one."""
        return self.steps(0) / self.steps(1)

    @property
    def rounds(self) -> int:
        return len(self.times[0, 0])

    def spread(self) -> float:
        """Median run of the old build over its shortest one, in per cent of the steps."""
        ordered = sorted(self.times[0, 0])
        return 100 * (ordered[len(ordered) // 2] - ordered[0]) / self.steps(0)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--limit", type=float, default=2.0, help="allowed loss in per cent")
    parser.add_argument("--only", default="", help="a word in the names of the decks to run")
    arguments = parser.parse_args()
    binaries = [arguments.old.resolve(), arguments.new.resolve()]
    least = 1 - arguments.limit / 100
    slower = []
    print(f"{'':<38}{'old, s':>9}{'new, s':>9}{'speed':>9}{'spread':>10}")
    for name, (*texts, threads) in cases().items():
        if arguments.only not in name:
            continue
        with tempfile.TemporaryDirectory() as folder:
            paths = Path(folder) / "many/deck.toml", Path(folder) / "few/deck.toml"
            for path, text in zip(paths, texts):
                path.parent.mkdir()
                path.write_text(text)
            pair = Pair(paths, threads)
            pair.run(binaries, arguments.rounds)
            while pair.ratio < least and pair.rounds < 4 * arguments.rounds:
                pair.run(binaries, arguments.rounds)
        mark = "  SLOWER" if pair.ratio < least else ""
        times = "".join(f"{pair.steps(side):>9.3f}" for side in (0, 1))
        print(f"{name:<38}{times}{pair.ratio:>9.3f}{pair.spread():>8.1f} %{mark}", flush=True)
        if mark:
            slower.append(name)
    if slower:
        print(f"slower by more than {arguments.limit} %: {', '.join(slower)}")
    return int(bool(slower))


if __name__ == "__main__":
    sys.exit(main())
