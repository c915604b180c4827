# Sourced by the commands of this folder: makes .venv at the project's root on first use.
# usage: setup_venv EXTRAS, such as `setup_venv wheel` or `setup_venv wheel,dev`

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv="$root/.venv"

say() { echo "pairsim set-up: $*" >&2; }

# Names on PATH may be shims that fail, so every candidate is run.
is_new_enough() { "$1" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 12))' >/dev/null 2>&1; }

find_python() {
    local candidate
    for candidate in "${PAIRSIM_PYTHON:-}" python3.13 python3.12 python3.14 python3 python \
        "$HOME"/.pyenv/versions/*/bin/python3 /usr/local/bin/python3.* /opt/*/bin/python3; do
        [ -n "$candidate" ] || continue
        candidate=$(command -v "$candidate") || continue
        if is_new_enough "$candidate"; then echo "$candidate"; return 0; fi
    done
    return 1
}

setup_venv() {
    local extras=$1 python options=() wanted
    exec 9>"$root/.venv.lock"
    if ! flock -n 9; then
        say "another set-up is running; waiting for it"
        flock 9
    fi
    wanted="$extras $(sha256sum "$root/pyproject.toml" | cut -d' ' -f1) $root"
    # An install with more extras serves one that asks for fewer.
    if [ -f "$venv/.pairsim-ready" ]; then
        case "$(cat "$venv/.pairsim-ready")" in
            "$wanted" | "$extras,dev ${wanted#* }" | "$extras,mutation ${wanted#* }" | "$extras,dev,mutation ${wanted#* }") exec 9>&-; return 0 ;;
        esac
    fi
    if ! command -v cc >/dev/null && ! command -v gcc >/dev/null; then
        say "no C compiler (cc or gcc) was found; forms are compiled when first used. On Debian: apt install gcc"
        exit 1
    fi
    # Without pip it is what an interrupted set-up left.
    if ! is_new_enough "$venv/bin/python" || ! "$venv/bin/python" -m pip --version >/dev/null 2>&1; then
        python=$(find_python) || {
            say "no Python 3.12 or newer with venv was found; install one, or set PAIRSIM_PYTHON to it"
            exit 1
        }
        # A site's own FEniCSx (Debian, conda, Spack) is used where that Python has it.
        if "$python" -c 'import dolfinx, sys; sys.exit(tuple(map(int, dolfinx.__version__.split(".")[:2])) != (0, 11))' \
            >/dev/null 2>&1; then
            say "using the FEniCSx of $python"
            options=(--system-site-packages)
        fi
        say "making .venv with $python"
        rm -rf "$venv"
        "$python" -m venv "${options[@]}" "$venv" || { rm -rf "$venv"; exit 1; }
    fi
    if grep -q '^include-system-site-packages = true' "$venv/pyvenv.cfg"; then
        extras=$(echo "$extras" | sed 's/\(^\|,\)wheel//; s/^,//')
    fi
    rm -f "$venv/.pairsim-ready"
    say "installing (once; some minutes, about 1 GB)"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check -e "$root${extras:+[$extras]}" || {
        say "the installation failed; run the command again"
        exit 1
    }
    echo "$wanted" >"$venv/.pairsim-ready"
    say "ready"
    exec 9>&-
}
