"""Measures, and renews the tables and plots of docs/performance.md.

    python benches/report.py [--no-run]

Runs `cargo bench --bench step`, of which criterion writes the times below `target/criterion`, and
`benches/peers/run.py` with the Python that runs this. It replaces the text between `<!-- measured: NAME -->`
and `<!-- end -->` in the page; the prose around stays. With `--no-run` it uses the results of the last runs.
"""

import argparse
import datetime
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import counts
import plots

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/performance.md"
PICTURES = ROOT / "docs/pictures"
RESULTS = ROOT / "target/bench"
KINEMATICS = ("small", "corotational")
# Smaller models fit into the caches of most machines.
FEWEST_OUT_OF_CACHE = 100_000
# Group, and bytes or operations of a task, as in benches/step/limits.rs.
LIMITS = {
    "triad": ("memory", 24 * 2**24),
    "copy": ("memory", 16 * 2**24),
    "add": ("arithmetic", 12 * 1_000_000 * 4),
    "multiply": ("arithmetic", 12 * 1_000_000 * 4),
    "add eight": ("arithmetic", 12 * 1_000_000 * 8),
    "multiply eight": ("arithmetic", 12 * 1_000_000 * 8),
}


def measure() -> None:
    """Runs the benchmark and the other programs, and notes the machine."""
    before = os.getloadavg()[0]
    subprocess.run(["cargo", "build", "--release"], cwd=ROOT, check=True)
    subprocess.run(["cargo", "bench", "--bench", "step"], cwd=ROOT, check=True)
    peers = [sys.executable, ROOT / "benches/peers/run.py", ROOT / "target/release/ddem"]
    subprocess.run(peers, cwd=ROOT, check=True)
    cpu = re.search(r"model name\s*:\s*(.*)", Path("/proc/cpuinfo").read_text())
    rust = subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True)
    machine = {
        "processor": cpu[1].strip() if cpu else "unknown",
        "cores": os.cpu_count(),
        "rust": rust.stdout.split()[1],
        "date": datetime.date.today().isoformat(),
        "load": before,
    }
    (RESULTS / "machine.json").write_text(json.dumps(machine) + "\n")


def read(name: str) -> dict:
    path = RESULTS / name
    return json.loads(path.read_text()) if path.exists() else {}


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def number(value: int) -> str:
    return f"{value:,}".replace(",", " ")


def times() -> dict[str, float]:
    """Shortest time of each row in any sample `[s]`."""
    shortest = {}
    for path in (ROOT / "target/criterion").glob("**/new/benchmark.json"):
        sample = json.loads((path.parent / "sample.json").read_text())
        each = (time / count for time, count in zip(sample["times"], sample["iters"]))
        shortest[json.loads(path.read_text())["full_id"]] = 1e-9 * min(each)
    return shortest


class Measured:
    """Results of the benchmark."""

    def __init__(self) -> None:
        self.times = times()
        self.rows = read("models.json")
        if not self.rows:
            sys.exit("there are no results: run without --no-run")
        for row in self.rows:
            row["best"] = row["units"] / self.times[row["name"]]
        self.machine = read("machine.json")

    def limit(self, name: str, threads: int) -> float:
        """Limit of the machine, in bytes or operations a second."""
        group, amount = LIMITS[name]
        factor = threads if group == "arithmetic" else 1
        return factor * amount / self.times[f"{group}/{name}/{threads}"]

    def of(self, group: str, **keys: object) -> list[dict]:
        """Rows of a group with the given values."""
        own = (row for row in self.rows if row["group"] == group)
        return [row for row in own if all(row[key] == value for key, value in keys.items())]

    def rates(self, group: str, model: str, nodes: int) -> list[str]:
        """Best rates on one and on two threads, in millions a second."""
        cells = []
        for threads in (1, 2):
            found = self.of(group, model=model, nodes=nodes, threads=threads)
            cells.append(f"{found[0]['best'] / 1e6:.3g}" if found else "–")
        return cells

    def fractions(self, row: dict, kinematics: str) -> tuple[float, float, float]:
        """Fractions of the peaks of additions and multiplications, and of the triad."""
        own, threads = counts.operations(kinematics), row["threads"]
        adds = row["best"] * own.adds / self.limit("add", threads)
        products = row["best"] * own.products / self.limit("multiply", threads)
        memory = row["best"] * counts.traffic(row["nodes"]) / self.limit("triad", threads)
        return adds, products, memory if row["nodes"] >= FEWEST_OUT_OF_CACHE else 0.0


def machine(measured: Measured) -> str:
    about = measured.machine
    return (
        f"Measured on {about['date']} on {about['cores']} threads of an {about['processor']}, with Rust "
        f"{about['rust']}. The machine is shared:\nother programs kept {about['load']:.1f} threads busy when "
        "the run began. Take ratios from these tables, not absolute numbers.\n"
    )


def limits(measured: Measured) -> str:
    names = {
        "triad": ("memory, triad `a = b + 3 c`", "GB/s"),
        "copy": ("memory, copy `a = b`", "GB/s"),
        "add": ("additions, four numbers at once", "10⁹/s"),
        "multiply": ("multiplications, four numbers at once", "10⁹/s"),
        "add eight": ("additions, eight numbers at once", "10⁹/s"),
        "multiply eight": ("multiplications, eight numbers at once", "10⁹/s"),
    }
    rows = []
    for name, (text, unit) in names.items():
        cells = [f"{measured.limit(name, threads) / 1e9:.1f} {unit}" for threads in (1, 2)]
        rows.append([text, *cells])
    return table(["", "1 thread", "2 threads"], rows)


def operations(_: Measured) -> str:
    rows = []
    for name, count in counts.parts().items():
        rows.append([name, f"{count.adds:.0f}", f"{count.products:.0f}"])
    for kinematics in KINEMATICS:
        total = counts.operations(kinematics)
        rows.append([f"**{kinematics}**", f"{total.adds:.0f}", f"{total.products:.0f}"])
    return table(["", "additions", "multiplications"], rows)


def steps(measured: Measured) -> str:
    rows = []
    for nodes in sorted({row["nodes"] for row in measured.of("step")}):
        for kinematics in KINEMATICS:
            found = measured.of("step", model=kinematics, nodes=nodes)
            if not found:
                continue
            used = [measured.fractions(row, kinematics) for row in found]
            cells = [" / ".join(f"{100 * own[k]:.0f}" for own in used) for k in range(3)]
            cells[2] = cells[2] if nodes >= FEWEST_OUT_OF_CACHE else "–"
            rates = measured.rates("step", kinematics, nodes)
            memory = f"{found[0]['bytes']:.0f}"
            rows.append([number(nodes), kinematics, *rates, memory, *cells])
    head = ["nodes", "kinematics", "1 thread, M/s", "2 threads, M/s", "memory, B per node"]
    return table([*head, "% of additions", "% of multiplications", "% of triad"], rows)


def forces(measured: Measured) -> str:
    rows = [[kinematics, *measured.rates("forces", kinematics, 8000)] for kinematics in KINEMATICS]
    return table(["forces alone, 8 000 nodes", "1 thread, M/s", "2 threads, M/s"], rows)


def joints(measured: Measured) -> str:
    words = {
        "none": "none: blocks that do not interact",
        "unbreakable": "intact, unbreakable",
        "checked": "intact, checked in every step",
        "broken": "broken: every pair has failed and slides, opens or closes",
    }
    sizes = (8000, 125_000, 1_000_000)
    rows = []
    for model, text in words.items():
        cells = [" / ".join(measured.rates("joints", model, nodes)) for nodes in sizes]
        memory = [f"{row['bytes']:.0f}" for row in measured.of("joints", model=model, threads=1)]
        rows.append([text, *cells, " / ".join(memory[1:])])
    head = [f"{number(nodes)} nodes" for nodes in sizes]
    return table(["joints", *head, "memory, B per node"], rows)


def others(measured: Measured) -> str:
    rows = []
    for nodes in (27_000, 216_000):
        cells = measured.rates("relaxation", "blocks", nodes)
        rows.append([f"relaxation, {number(nodes)} nodes in blocks of two divisions", *cells, "M nodes/s"])
    cells = measured.rates("contacts", "deformable", 27_000)
    rows.append(["1 000 deformable cubes of two divisions in contact", *cells, "M nodes/s"])
    cells = measured.rates("springs", "blocks", 216_000)
    rows.append(["27 000 cubes of one division on springs that break, 216 000 nodes", *cells, "M nodes/s"])
    for nodes in (7664, 69_200):
        cells = measured.rates("cells", "deformable", nodes)
        memory = measured.of("cells", model="deformable", nodes=nodes)[0]["bytes"]
        rows.append([f"cells between three joint sets, {number(nodes)} nodes", *cells, f"M nodes/s, {memory:.0f} B per node"])
    found = [row for row in measured.of("cells", model="rigid") if row["nodes"] == 69_200]
    cells = [f"{1e6 / row['best']:.2f}" for row in found]
    rows.append(["the same cells as rigid bodies", *cells, "µs per pair of a joint"])
    for model, text in (("joined", "joined in one lattice"), ("loose", "each alone, in contact")):
        found = measured.of("rigid", model=model)
        large = [row for row in found if row["nodes"] > 10_000]
        cells = [f"{1e6 / row['best']:.2f}" for row in large]
        points = number(int(large[0]["units"]))
        rows.append([f"10 648 rigid cubes, {text}, {points} points", *cells, "µs per point"])
    return table(["", "1 thread", "2 threads", ""], rows)


def peers(measured: Measured) -> str:
    found = read("peers.json")
    if not found:
        return "Not measured yet: `python benches/peers/run.py`.\n"
    rows = []
    for version in dict.fromkeys(row["version"] for row in found["rows"]):
        own = [row for row in found["rows"] if row["version"] == version]
        rates = {row["threads"]: f"{row['rate'] / 1e6:.3g}" for row in own}
        cells = [rates.get(threads, "–") for threads in (1, 2)]
        difference = own[0].get("difference")
        text = "–" if difference is None else f"{difference:.0e}"
        rows.append([version, *cells, f"{own[0]['bytes']:.0f}", text])
    head = ["program", "1 thread, M/s", "2 threads, M/s", "process peak, B per node", "difference"]
    text = table(head, rows)
    rate = {row["version"]: row["rate"] for row in found["rows"] if row["threads"] == 1}
    csr = [value for version, value in rate.items() if "CSR" in version]
    ratios = [
        f"{value / csr[0]:.1f} ({version.split(', ')[1]})"
        for version, value in rate.items()
        if version.startswith("ddem") and csr
    ]
    text += f"\nddem over SciPy CSR, one thread each: {', '.join(ratios)}. Measured on {found.get('date', 'an unknown date')}. "
    absent = ", ".join(name.split("_")[0] for name in found["absent"])
    return text + (f"Not installed, and not measured: {absent}.\n" if absent else "\n")


def draw(measured: Measured) -> None:
    """Draws the plots."""
    series = {}
    for kinematics in KINEMATICS:
        for threads in (1, 2):
            rows = measured.of("step", model=kinematics, threads=threads)
            name = f"{kinematics}, {threads} thread{'s' * (threads > 1)}"
            series[name] = sorted((row["nodes"], row["best"] / 1e6) for row in rows)
    title = "Node updates per second, intact joints (millions)"
    series = {name: points for name, points in series.items() if points}
    plots.lines(PICTURES / "performance-rates.svg", title, "nodes", "M/s", series)
    bars = []
    for row in measured.of("step", threads=1):
        if row["nodes"] < 8000:
            continue
        adds, _, memory = measured.fractions(row, row["model"])
        name = f"{row['model']}, {number(row['nodes'])} nodes"
        kind = "memory" if memory > adds else "additions"
        bars.append((f"{name}: {kind}", 100 * max(adds, memory), kind))
    if bars:
        title = "Part of the nearer limit in use, one thread"
        plots.bars(PICTURES / "performance-limits.svg", title, "%", bars)


TABLES = {
    "machine": machine,
    "limits": limits,
    "operations": operations,
    "steps": steps,
    "forces": forces,
    "joints": joints,
    "others": others,
    "peers": peers,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--no-run", action="store_true", help="use the results of the last runs")
    arguments = parser.parse_args()
    if not arguments.no_run:
        measure()
    measured = Measured()
    page = PAGE.read_text()
    for name, text in TABLES.items():
        begins = f"<!-- measured: {name} -->"
        if begins not in page:
            sys.exit(f"{PAGE} has no `{begins}`")
        head, rest = page.split(begins, 1)
        rest = rest.split("<!-- end -->", 1)[1]
        page = f"{head}{begins}\n\n{text(measured)}\n<!-- end -->{rest}"
    PAGE.write_text(page)
    draw(measured)


if __name__ == "__main__":
    main()
