#!/usr/bin/env bash
# Every check there is. Run from anywhere; leaves only target/ and .venv/ behind.
set -euo pipefail
cd "$(dirname "$0")"
say() { printf '\n== %s\n' "$1"; }

say "format"
cargo fmt --all --check

say "lints"
cargo clippy --workspace --all-targets --locked -- -D warnings

say "documentation"
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked

# Results are read back by VTK's own reader, as ParaView does.
say "VTK for the tests"
[ -x .venv/bin/python ] || python3 -m venv .venv
.venv/bin/python -c 'import vtkmodules.vtkIOHDF' 2>/dev/null ||
    .venv/bin/python -m pip install --quiet --disable-pip-version-check 'vtk==9.5.2'
DDEM_PYTHON="$PWD/.venv/bin/python"
export DDEM_PYTHON

say "tests"
cargo test --workspace --all-targets --locked
cargo test --workspace --doc --locked
printf '\nAll checks passed.\n'
