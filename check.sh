#!/usr/bin/env bash
# Every check there is. Run from anywhere; leaves only target/ and .venv/ behind.
# `./check.sh full` adds tests of the release profile and runs of large models, which need a quiet machine.
set -euo pipefail
cd "$(dirname "$0")"
# Data for the next build would only fill the disk.
export CARGO_INCREMENTAL=0
export PYTHONDONTWRITEBYTECODE=1 MYPY_CACHE_DIR=target/mypy HYPOTHESIS_STORAGE_DIRECTORY=target/hypothesis
say() { printf '\n== %s\n' "$1"; }

say "format"
cargo fmt --all --check

say "lints"
cargo clippy --workspace --all-targets --locked -- -D warnings

say "documentation"
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked

# In a new environment each time: the module is installed as users install it, but for the profile,
# which shares what `cargo test` builds. Results are read back by VTK's own reader, as ParaView does.
say "Python environment with the module"
rm -rf .venv
python3 -m venv .venv
pip() { .venv/bin/python -m pip --quiet --disable-pip-version-check "$@"; }
# Those of old systems do not know the settings below.
pip install --upgrade 'pip>=22.1'
pip install --requirement crates/ddem-py/tests/requirements.txt
pip install --config-settings "build-args=--profile dev" '.[plot,progress]'
DDEM_PYTHON="$PWD/.venv/bin/python"
export DDEM_PYTHON

say "embedding without files"
cargo check --package ddem --no-default-features --lib --locked
if cargo tree --package ddem --no-default-features --edges normal --locked | grep -q hdf5; then
    echo "HDF5 is needed without the feature io" >&2
    exit 1
fi

say "tests"
# Not of the module: its tests are in Python, and a test in Rust would need the library of Python.
cargo test --workspace --exclude ddem-py --all-targets --locked
cargo test --workspace --exclude ddem-py --doc --locked
DDEM_CLI="${CARGO_TARGET_DIR:-$PWD/target}/debug/ddem"
export DDEM_CLI

# Strict: a broken link or anchor fails, but not with `--quiet`. The pages on keys come from the program.
say "documentation site"
pip install --requirement docs/site/requirements.txt
NO_MKDOCS_2_WARNING=1 .venv/bin/mkdocs build --strict

say "Python tests"
.venv/bin/python -m mypy.stubtest ddem._ddem --ignore-disjoint-bases
.venv/bin/python -m mypy --strict examples/beam.py
.venv/bin/python -m pytest --quiet -p no:cacheprovider crates/ddem-py/tests

if [ "${1:-}" = full ]; then
    say "fuzzing targets"
    cargo check --manifest-path fuzz/Cargo.toml --target-dir target/fuzz
    # A compiler can be wrong in one profile only. Optimisation across crates would take longer than the
    # tests.
    say "tests of the release profile"
    CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 CARGO_PROFILE_RELEASE_DEBUG=0 \
        cargo test --release --package ddem-core --package ddem-cut --package ddem-joint --package ddem-mesh --package ddem-mechanics --locked
    say "large runs"
    # Tests that measure their process run alone.
    cargo test --test contract --locked -- --ignored --nocapture million_nodes_are
    cargo test --test contract --locked -- --ignored --nocapture with_a_million_nodes
    cargo test --test contract --locked -- --ignored --nocapture ten_million
    cargo test --test contract --locked -- --ignored --nocapture --skip memory:: --skip endurance::
    cargo test --package ddem-cli --test cli --locked -- --ignored --nocapture
    cargo test --package ddem-core --test it --locked -- --ignored --nocapture
    cargo test --release --package ddem-cut --test it --locked -- --ignored --nocapture
fi
printf '\nAll checks passed.\n'
