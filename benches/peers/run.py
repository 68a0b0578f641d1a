"""ddem beside other programs on the same mesh, with the same stiffness and the same steps.

    pip install numpy h5py scipy jax akantu
    python benches/peers/run.py target/release/ddem [--count 10] [--steps 100]

Each program computes the sudden weight of a lattice of blocks with intact joints, small
displacements, standard hexahedra, without damping. All displacements must agree with those of ddem. Programs that are
not installed are named as absent. Results are written to `target/bench/peers.json`, from which
`benches/report.py` makes the table of docs/performance.md.
"""

import argparse
import datetime
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benches"))

import decks  # noqa: E402

PEERS = ("scipy_csr", "jax_elements", "akantu_solid")
TIME_STEP = 2.0e-6
# Largest difference from ddem relative to the largest displacement.
TOLERANCE = 1e-10


def stages(*steps: int) -> str:
    """Dynamic stages with these numbers of steps."""
    text = ""
    for number, count in enumerate(steps):
        text += f"[[stage]]\nname = 'fall {number}'\nkind = 'dynamic'\nframes = 1\n"
        text += f"duration = {count * TIME_STEP!r}\ntime_step = {TIME_STEP!r}\n"
    return text


def run(command: list[str | Path], folder: Path, deck: str) -> dict:
    """Summary of a run of ddem; results are in the folder."""
    (folder / "deck.toml").write_text(deck)
    options = ["--out", folder / "out", "--overwrite", "--quiet"]
    subprocess.run([*command, folder / "deck.toml", *options], check=True)
    return json.loads((folder / "out/summary.json").read_text())


def ddem(binary: Path, folder: Path, kinematics: str, count: int, steps: int, threads: int) -> dict:
    """Best rate of ddem over some steps after the first ones, as for the others. The folder has the
    results after the first steps.
    """
    keys = {"kinematics": kinematics, "element": "standard", "gravity": -9.81, "floor": True}
    text = decks.lattice(count, **keys)
    command = [binary, "--threads", str(threads)]
    short = max(steps // 5, 1)
    measured = run(command, folder, text + stages(steps, *[short] * 20))["stages"][1:]
    assert all(stage["steps"] == short for stage in measured)
    rates = [stage["node_updates_per_second"] for stage in measured]
    summary = run(command, folder, text + stages(steps))
    assert summary["stages"][0]["steps"] == steps
    version = f"ddem {summary['version']}, {kinematics}"
    memory = summary["peak_memory_bytes"] / summary["nodes"]
    return {"version": version, "rate": max(rates), "bytes": memory, "nodes": summary["nodes"]}


def peer(name: str, folder: Path, steps: int, threads: int) -> dict:
    """Results of a peer, in a process of its own."""
    arguments = [name, folder / "out", TIME_STEP, steps, threads]
    command = [sys.executable, Path(__file__).with_name("one.py"), *map(str, arguments)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ddem", type=Path)
    parser.add_argument("--count", type=int, default=10, help="blocks along each edge")
    parser.add_argument("--steps", type=int, default=100)
    arguments = parser.parse_args()
    binary, count, steps = arguments.ddem.resolve(), arguments.count, arguments.steps
    rows, absent, wrong = [], [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kinematics in ("corotational", "small"):
            for threads in (1, 2):
                row = ddem(binary, folder, kinematics, count, steps, threads)
                nodes = row["nodes"]
                rows.append({**row, "threads": threads})
        for name in PEERS:
            for threads in (1, 2):
                row = peer(name, folder, steps, threads)
                if "absent" in row:
                    absent.append(name)
                    break
                if "no threads" in row:
                    continue
                rows.append({**row, "threads": threads})
                if not row["difference"] <= TOLERANCE:
                    wrong.append(f"{row['version']}: {row['difference']:.1e}")
    for row in rows:
        difference = f"{row['difference']:.1e}" if "difference" in row else ""
        print(f"{row['version']:<36}{row['threads']:>2}{row['rate'] / 1e6:>9.2f} M/s "
              f"{row['bytes']:>8.0f} bytes  {difference}")  # fmt: skip
    for name in absent:
        print(f"{name}: not installed")
    date = datetime.date.today().isoformat()
    results = {"nodes": nodes, "rows": rows, "absent": absent, "tolerance": TOLERANCE, "date": date}
    out = ROOT / "target/bench/peers.json"
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(results, indent=1) + "\n")
    for line in wrong:
        print(f"differs from ddem: {line}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
