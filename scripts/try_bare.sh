#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Tries the newest commit on bare Debian systems: scripts/try_bare.sh [-k] [RELEASE...] [TARGET...]
#
#   RELEASE  bookworm, trixie; both if none is given
#   TARGET   targets of make; sim and test if none is given
#   -k       keep the systems, and go on with those that were kept
#
# Each system is debootstrap's smallest, with the packages that README asks for and nothing else, in
# build/bare (BARE=FOLDER for another). It takes over the host's certificates, its proxies for apt
# and its configuration of pip. Each target's output lies beside it, RELEASE-TARGET.log. The exit
# code is 1 if a target failed.
set -eu

cd "$(dirname "$0")/.."
# Where the project lies in a system.
home=/srv
packages=$(sed -n 's/^You need Debian [0-9 or]* with \([^,]*\),.*/\1/p' README.md | sed 's/`//g; s/ and / /')

fail() {
    echo "try_bare: $1" >&2
    exit 2
}

# make_system FOLDER RELEASE: a bare system.
make_system() {
    debootstrap --variant=minbase "$2" "$1" || return
    apt-config dump | grep -E '^Acquire::(Check-|https?::)' >"$1/etc/apt/apt.conf.d/90host" || true
    if [ -d /usr/local/share/ca-certificates ]; then
        cp -r /usr/local/share/ca-certificates "$1/usr/local/share/"
    fi
    if [ -e /etc/pip.conf ]; then cp /etc/pip.conf "$1/etc/"; fi
    if [ -e "$HOME/.config/pip/pip.conf" ]; then
        mkdir -p "$1$home/.config/pip"
        cp "$HOME/.config/pip/pip.conf" "$1$home/.config/pip/"
    fi
    inside "$1" "apt-get update && apt-get install -y --no-install-recommends $packages"
}

# inside FOLDER COMMAND: runs a command in a system. Its processes and mounts end with it.
inside() {
    cp -L /etc/resolv.conf /etc/hosts "$1/etc/"
    env -i HOME=$home PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive \
        $(env | grep -E '^(PIP_|https?_proxy=|no_proxy=)[^ ]*$') \
        unshare --mount --pid --fork --kill-child sh -euc '
            mount -t proc proc "$0/proc"
            mount -t tmpfs tmpfs "$0/dev/shm"
            mount -t devpts -o newinstance,ptmxmode=0666 devpts "$0/dev/pts"
            ln -sf pts/ptmx "$0/dev/ptmx"
            exec chroot "$0" sh -euc "$1"' "$1" "$2" </dev/null
}

keep=
releases=
targets=
for word in "$@"; do
    case $word in
    -k) keep=1 ;;
    bookworm | trixie) releases="$releases $word" ;;
    -*) fail "usage: scripts/try_bare.sh [-k] [bookworm] [trixie] [TARGET...]" ;;
    *) targets="$targets $word" ;;
    esac
done
[ -n "$packages" ] || fail "README.md has no line \"You need Debian ... with PACKAGES,\"; write it as it was"
[ "$(id -u)" = 0 ] || fail "debootstrap and chroot need root: sudo scripts/try_bare.sh"
command -v debootstrap >/dev/null 2>&1 || fail "debootstrap is missing; install it with: apt-get install debootstrap"

mkdir -p "${BARE:-build/bare}"
bare=$(cd "${BARE:-build/bare}" && pwd)
failed=0
trap 'exit 130' INT TERM
for release in ${releases:-bookworm trixie}; do
    system=$bare/$release
    log=$bare/$release-system.log
    # No mount of ours is seen here, so nothing of the host can be removed with the system.
    if [ -z "$keep" ]; then trap 'rm -rf --one-file-system "$system"' EXIT; fi
    if [ -z "$keep" ] || [ ! -e "$system$home/plenofir" ]; then
        rm -rf --one-file-system "$system"
        if ! make_system "$system" "$release" >"$log" 2>&1; then
            tail -n 5 "$log" >&2
            fail "$release could not be set up; see $log"
        fi
        git clone -q --no-hardlinks . "$system$home/plenofir"
    fi
    git -C "$system$home/plenofir" fetch -q "$PWD" HEAD
    git -C "$system$home/plenofir" reset -q --hard FETCH_HEAD
    for target in ${targets:-sim test}; do
        log=$bare/$release-$target.log
        begin=$(date +%s)
        result=passed
        inside "$system" "cd $home/plenofir && make $target" >"$log" 2>&1 || result=FAILED
        echo "$release: make $target $result in $(($(date +%s) - begin)) s: $(tail -n 1 "$log")"
        [ $result = passed ] || failed=1
    done
    inside "$system" "python3 --version; ghdl --version | head -n 1; dpkg-query -W | wc -l" || true
    [ -n "$keep" ] || rm -rf --one-file-system "$system"
done
exit $failed
