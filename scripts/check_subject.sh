#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Checks a commit message's first line, "area: what changed": scripts/check_subject.sh FILE
subject=$(head -n 1 "$1")
case $subject in
Merge\ * | Revert\ * | fixup!\ * | squash!\ *) exit 0 ;;
esac
if [ "${#subject}" -gt 72 ]; then
    echo "The subject has ${#subject} characters; 72 are the limit. Say why in the body." >&2
    exit 1
fi
if ! printf '%s\n' "$subject" | grep -Eq '^[A-Za-z0-9_./-]+(, [A-Za-z0-9_./-]+)*: .'; then
    echo "The subject needs its area in front, as in 'resample: a newer load supersedes a pending one'." >&2
    exit 1
fi
