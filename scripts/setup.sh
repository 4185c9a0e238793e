#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Sets up what the project needs: scripts/setup.sh venv | ghdl | libpython | pnr | site | compiler | mutants | registers | tests
#
#   venv         creates .venv with the pinned Python packages, the command plenofir and the studies behind it
#   ghdl         makes sure that a GHDL simulator is installed
#   libpython    makes sure that Python's shared library is there, which cocotb loads into the simulator
#   pnr          installs place and route for ECP5, Nexus, Gowin and GateMate
#   site         installs what builds the documentation as a site
#   compiler     makes sure that there is a C++ compiler, which Verilator needs
#   mutants      installs what changes the Python
#   registers    installs what builds the register map's files (hdl-registers)
#   tests        makes sure of what the tests want besides: other people's tools from the package index
#                (scripts/requirements-tests.txt), a C++ compiler, Icarus Verilog, Debian's decoder of monitors'
#                EDID (a second opinion on ours) and compiler of device trees, Tcl, the GHDL that need not compile beside the fast one,
#                and Chromium and Firefox for the tests of the viewer (400 and 300 MB; without them they are skipped)
#
# Debian packages that are missing are installed as root or through sudo. What cannot be installed
# is named in one line, with the command that would install it, and the exit code is 2.
set -eu

cd "$(dirname "$0")/.."

fail() {
    echo "setup: $1" >&2
    exit 2
}

# install_packages WHAT PACKAGE...: installs Debian packages, or says which are missing.
install_packages() {
    what=$1
    shift
    advice="$what is missing; install it with: sudo apt-get install $*"
    command -v apt-get >/dev/null 2>&1 || fail "$what is missing and there is no apt-get; Debian's packages for it: $*"
    if [ "$(id -u)" = 0 ]; then
        as_root=env
    elif command -v sudo >/dev/null 2>&1; then
        as_root=sudo
    else
        fail "$advice"
    fi
    echo "setup: installing $*" >&2
    log=$(mktemp)
    if ! { $as_root apt-get update && $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "$@"; } >"$log" 2>&1 </dev/null; then
        tail -n 5 "$log" >&2
        rm -f "$log"
        fail "$advice"
    fi
    rm -f "$log"
}

setup_venv() {
    stamp=.venv/plenofir-$(cat scripts/requirements.txt pyproject.toml studies/pyproject.toml scripts/setup.sh | sha256sum | cut -c1-16)
    [ -e "$stamp" ] && return
    command -v python3 >/dev/null 2>&1 || install_packages "Python 3.11 or newer" python3 python3-venv
    python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
        fail "$(python3 --version) is too old; Python 3.11 or newer is needed: sudo apt-get install python3"
    python3 -c 'import ensurepip, venv' 2>/dev/null || install_packages "Python's venv module" python3-venv
    echo "setup: creating .venv (about a minute)" >&2
    rm -rf .venv
    python3 -m venv .venv || fail "python3 -m venv .venv failed"
    PIP_DISABLE_PIP_VERSION_CHECK=1
    export PIP_DISABLE_PIP_VERSION_CHECK
    .venv/bin/python -m pip install -qq --use-pep517 --requirement scripts/requirements.txt ||
        fail "Python packages could not be installed; try: .venv/bin/pip install -r scripts/requirements.txt"
    .venv/bin/python -m pip install -qq --no-deps --no-build-isolation --editable . --editable studies ||
        fail "plenofir could not be installed; try: .venv/bin/pip install --no-deps -e . -e studies"
    touch "$stamp"
}

setup_ghdl() {
    command -v ghdl >/dev/null 2>&1 || install_packages "GHDL" ghdl-llvm ghdl-mcode
}

# install_pinned NAME WHAT: installs the packages of scripts/requirements-NAME.txt into .venv, once.
install_pinned() {
    list=scripts/requirements-$1.txt
    stamp=.venv/$1-$(sha256sum "$list" | cut -c1-16)
    [ -e "$stamp" ] && return
    echo "setup: installing $2" >&2
    .venv/bin/python -m pip install -qq --disable-pip-version-check --no-deps --requirement "$list" ||
        fail "$2 could not be installed; try: .venv/bin/pip install --no-deps -r $list"
    touch "$stamp"
}

setup_pnr() {
    install_pinned pnr "nextpnr (its first run takes a minute more)"
}

setup_site() {
    install_pinned site "what builds the site"
}

setup_mutants() {
    install_pinned mutants "what changes the Python"
}

setup_registers() {
    install_pinned registers "what builds the register map's files"
}

setup_compiler() {
    command -v g++ >/dev/null 2>&1 && command -v perl >/dev/null 2>&1 || install_packages "A C++ compiler" g++ make perl
}

setup_tests() {
    install_pinned tests "the tools that tests run"
    setup_registers
    if ! command -v apt-get >/dev/null 2>&1; then
        echo "setup: there is no apt-get; tests of tools that are missing will be skipped" >&2
        return
    fi
    setup_compiler
    command -v iverilog >/dev/null 2>&1 || install_packages "Icarus Verilog" iverilog
    command -v edid-decode >/dev/null 2>&1 || install_packages "edid-decode" edid-decode
    command -v dtc >/dev/null 2>&1 || install_packages "The device tree compiler" device-tree-compiler
    command -v tclsh >/dev/null 2>&1 || install_packages "Tcl, which vendors' scripts are in" tcl
    # A GHDL that is not Debian's is left alone.
    command -v ghdl-mcode >/dev/null 2>&1 || ! command -v ghdl-llvm >/dev/null 2>&1 ||
        install_packages "GHDL's back end mcode" ghdl-mcode
    command -v chromium >/dev/null 2>&1 || (install_packages "Chromium" chromium) ||
        echo "setup: without it tests in the browser will be skipped" >&2
    # It draws with Mesa, on a screen that Xvfb gives it.
    { command -v firefox-esr && command -v Xvfb; } >/dev/null 2>&1 ||
        (install_packages "Firefox" firefox-esr xvfb libgl1-mesa-dri) ||
        echo "setup: without it tests in Firefox will be skipped" >&2
}

has_libpython() {
    .venv/bin/python -c 'import find_libpython, sys; sys.exit(find_libpython.find_libpython() is None)'
}

setup_libpython() {
    has_libpython && return
    name=$(.venv/bin/python -c 'import sys; print("libpython%d.%d" % sys.version_info[:2])')
    install_packages "Python's shared library" "$name"
    has_libpython || fail "$(.venv/bin/python --version) was built without its shared library, which cocotb needs; use Debian's python3"
}

case ${1:-} in
venv) setup_venv ;;
ghdl) setup_ghdl ;;
libpython) setup_libpython ;;
pnr) setup_pnr ;;
site) setup_site ;;
compiler) setup_compiler ;;
mutants) setup_mutants ;;
registers) setup_registers ;;
tests) setup_tests ;;
*) fail "usage: scripts/setup.sh venv | ghdl | libpython | pnr | site | compiler | mutants | registers | tests" ;;
esac
