#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs the quick tests of the golden model with other versions of the dependencies than the pinned ones:
# scripts/try_versions.sh lowest|newest
#
#   lowest  the lowest versions that pyproject.toml allows
#   newest  the newest that the package index has
#
# The environment is made anew in build/versions/, by uv.
set -eu

cd "$(dirname "$0")/.."

case ${1:-} in
lowest) resolution=lowest-direct ;;
newest) resolution=highest ;;
*)
    echo "usage: scripts/try_versions.sh lowest | newest" >&2
    exit 2
    ;;
esac
folder=build/versions/$1
rm -rf "$folder"
python3 -m venv "$folder"
python=$folder/bin/python
$python -m pip install -qq --disable-pip-version-check uv
$python -m uv pip install -q --python "$python" --resolution "$resolution" --editable . --editable studies
# The tests' own packages, the newest ones that go with these.
$python -m uv pip install -q --python "$python" pytest hypothesis imageio array-api-strict
$python -m uv pip list --python "$python"
# What a test asks of the newest typer, and what wants Dask, is left out.
$python -m pytest -q -p no:cacheprovider golden/tests -m quick \
    --ignore golden/tests/commands/test_any_call.py --ignore golden/tests/refocus/test_batch_kills.py
