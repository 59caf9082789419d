#!/bin/sh
# Print the Python that makes robocal's environment (CPython 3.11 to 3.13 with venv and ensurepip), or say how to get one
# and exit 1. An argument that is not empty is the only candidate.
set -u

say() {
    printf '%s\n' "$*" >&2
}

# The minor version of a CPython 3 that really runs: a pyenv shim may exist and only answer "command not found".
minor_of() {
    "$1" -c 'import sys; cpython = sys.implementation.name == "cpython"; print(sys.version_info[1] if cpython else 0)' \
        2>/dev/null
}

# venv alone is not enough: Debian ships it without ensurepip.
makes_environments() {
    "$1" -c 'import ensurepip, venv' 2>/dev/null
}

# $1: the minor version of a Python that only lacks venv, or nothing.
install_line() {
    if [ "$(uname -s)" = Darwin ]; then
        echo "brew install python@3.${1:-13}"
    elif command -v apt-get >/dev/null 2>&1; then
        for minor in ${1:-13 12 11}; do
            if apt-cache show "python3.$minor-venv" >/dev/null 2>&1; then
                echo "sudo apt-get install python3.$minor-venv"
                return
            fi
        done
        if [ -n "$1" ]; then
            echo "sudo apt-get update && sudo apt-get install python3.$1-venv"
        elif ! apt-cache show python3 >/dev/null 2>&1; then # no package lists yet
            echo "sudo apt-get update && sudo apt-get install python3-venv"
        else
            echo "uv python install 3.13    # this system packages no such Python; uv does: https://docs.astral.sh/uv"
        fi
    elif command -v dnf >/dev/null 2>&1; then
        echo "sudo dnf install python3.${1:-13}"
    elif command -v zypper >/dev/null 2>&1; then
        echo "sudo zypper install python3${1:-13}"
    else
        echo "uv python install 3.${1:-13}    # uv: https://docs.astral.sh/uv"
    fi
}

if [ -z "${1:-}" ]; then
    set -- python3.13 python3.12 python3.11 python3 python
fi

lacking=
for candidate in "$@"; do
    minor=$(minor_of "$candidate") || minor=
    case $minor in
    11 | 12 | 13)
        if makes_environments "$candidate"; then
            command -v "$candidate"
            exit 0
        fi
        say "$candidate is 3.$minor, but lacks venv or ensurepip."
        lacking=${lacking:-$minor}
        ;;
    '') [ $# -gt 1 ] || say "$candidate does not run." ;;
    0) say "$candidate is not CPython, which numba needs." ;;
    *) say "$candidate is 3.$minor; robocal needs 3.11, 3.12 or 3.13." ;;
    esac
done
[ -n "$lacking" ] || [ $# -eq 1 ] || say "No Python from 3.11 to 3.13 was found."
say "Install one with this line, then run make again (or name another with make PYTHON=...):"
say "    $(install_line "$lacking")"
exit 1
