#!/usr/bin/env bash
# The files of a release, in dist/: the Python module, the program, the crates, what they contain, and checksums. All are
# tried as users have them. For Linux on x86-64; run `./check.sh full` first. Needs what building ddem needs, and Python.
set -euo pipefail
cd "$(dirname "$0")"
say() { printf '\n== %s\n' "$1"; }
fail() { printf '%s\n' "$1" >&2; exit 1; }

[ -z "$(git status --porcelain)" ] || fail "commit all changes first: a release is a revision of the repository"
SOURCE_DATE_EPOCH="$(git log -1 --format=%ct)"
# Of its own: the linker and the flags would rebuild what `cargo build` has made.
export SOURCE_DATE_EPOCH CARGO_TARGET_DIR="$PWD/target/dist"
version="$(cargo pkgid --package ddem-cli)"
version="${version##*[#@]}"
name="ddem-$version-x86_64-linux"
rm -rf dist
mkdir dist

say "tools"
tools="$CARGO_TARGET_DIR/tools"
python3 -m venv "$tools"
"$tools/bin/pip" install --quiet --disable-pip-version-check maturin==1.16.0 ziglang==0.17.1
export PATH="$tools/bin:$PATH"
# Rust sources in messages without the paths of this machine.
export RUSTFLAGS="--remap-path-prefix=$PWD=ddem --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo"
# With glibc 2.17, the oldest that Rust supports: zig links against it on any machine. Maturin refuses what needs a later
# one or another library, and lists what it builds in.
wheel_of() { maturin build --release --locked --strip --zig --compatibility manylinux2014 "$@"; }

# What zig links to a program: its own small library, and how to unwind the stack.
zig="$(echo "$tools"/lib/python3.*/site-packages/ziglang)"
licences() { python3 licences.py "$1" "$2" "zig=$zig/LICENSE" "libunwind=$zig/lib/libunwind/LICENSE.TXT"; }

say "Python module"
others="LICENSE-THIRD-PARTY.txt" # one of `license-files` in pyproject.toml
licences ddem-py "$others"
wheel_of --out dist
rm "$others"
wheel="$(echo dist/*.whl)"
python3 -m zipfile --list "$wheel" | grep "$others" || fail "the wheel has no licences of others"

say "program"
# Out of a wheel, for which all is checked and listed in the same way.
packed="$CARGO_TARGET_DIR/program"
rm -rf "$packed"
wheel_of --manifest-path crates/ddem-cli/Cargo.toml --bindings bin --out "$packed"
python3 -m zipfile --extract "$packed"/*.whl "$packed"
install -D --mode 755 "$packed"/*.data/scripts/ddem "$packed/$name/ddem"
cp LICENSE-APACHE LICENSE-MIT "$packed/$name"
licences ddem-cli "$packed/$name/$others"
tar --create --gzip --file "dist/$name.tar.gz" --owner=0 --group=0 --mtime="@$SOURCE_DATE_EPOCH" --directory "$packed" "$name"
cp "$packed"/*.dist-info/sboms/*.json "dist/$name.cdx.json"

say "crates"
# Builds each as it will be on crates.io, with the others from these packages. ddem-py is the Python module.
cargo package --workspace --exclude ddem-py --locked
cp "$CARGO_TARGET_DIR"/package/*-"$version".crate dist/

say "checksums"
(cd dist && sha256sum -- *) >"$CARGO_TARGET_DIR/SHA256SUMS"
mv "$CARGO_TARGET_DIR/SHA256SUMS" dist/
cat dist/SHA256SUMS

# As users have them: no compiler, no path but that of Python, an empty environment for the program.
trial="$(mktemp --directory)"
trap 'rm -rf "$trial"' EXIT

sed '1,/^## Python in ten lines/d; /^## /,$d' README.md | sed -n '/^```python/,/^```/{/^```/!p}' >"$trial/ten.py"
# With every CPython at hand: the wheel is one for all of them.
tried=""
for python in python3 python3.{10..20}; do
    found="$("$python" --version 2>&1)" || continue
    [[ "$tried" != *"$found;"* ]] || continue
    tried="$tried$found;"
    say "trial of the Python module with $found"
    "$python" -m venv "$trial/python"
    PATH="$trial/python/bin" pip install --quiet --disable-pip-version-check --only-binary :all: "$wheel[plot]"
    (cd "$trial" && PATH="$trial/python/bin" python ten.py)
    [ -s "$trial/cantilever.png" ] || fail "the ten lines of README.md drew no picture"
    rm -r "$trial/python" "$trial/cantilever.png"
done
[ -n "$tried" ] || fail "no Python starts"

say "trial of the program"
tar --extract --file "dist/$name.tar.gz" --directory "$trial" --strip-components 1
cp examples/block.toml "$trial"
cd "$trial"
env -i ./ddem --version
# tan 35° / tan 30° = 1.213, within the resolution of the search.
env -i ./ddem block.toml
env -i ./ddem info results/block >block.txt
grep 'factor of safety 1\.21' block.txt || fail "the program finds another factor of safety"
env -i ./ddem new slope
env -i ./ddem slope.toml
env -i ./ddem info results/slope
printf '\nThe release is in dist/.\n'
