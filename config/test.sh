#!/usr/bin/env bash
# Lints and tests everything; needs what `config/setup.sh --test` installs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-${TMPDIR:-/tmp}}   # Mesa complains without one
export MIS_SLAM_PYTHON=${MIS_SLAM_PYTHON:-$PWD/target/python/bin/python}

step() { printf '\n=== %s\n' "$*"; }

step "format"
cargo fmt --all --check
step "web page: types, lint, unit tests"
(cd clients/web && npm run --silent check && npm test --silent)
step "clippy"
cargo clippy --workspace --all-targets --locked -- -D warnings
step "programs that the end-to-end tests start"
cargo build --workspace --bins --locked
step "tests"
cargo test --workspace --locked
