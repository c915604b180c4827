# Sourced by the commands of this folder: makes .venv at the project's root on first use.
# usage: setup_venv EXTRAS, such as `setup_venv fenicsx` or `setup_venv fenicsx,dev`

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv="$root/.venv"
uv_python=3.13 # where no interpreter is new enough
other_ways="docs/how-to/install.md has others: conda, pixi, a container, the FEniCSx of a cluster"

# Help needs no installation: that of a module is its docstring, that of a script alone the comment at its head.
show_help() {
    local script=$1
    if [ -f "$script.py" ]; then
        sed -n '/^"""/,/"""$/p' "$script.py" | sed '1s/^"""//; /^"""$/q' | sed '/^"""$/d'
    else
        sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$script"
    fi
}

say() { echo "pairsim set-up: $*" >&2; }

# Where all is installed the modules themselves say more; that of pairsim is the program's own.
for argument in "$@"; do
    case "$argument" in -h | --help) ;; *) continue ;; esac
    if [ "$(basename "$0")" != pairsim ] && { [ ! -f "$0.py" ] || [ ! -f "$venv/.pairsim-ready" ]; }; then
        show_help "$0"
        exit 0
    fi
done

# Names on PATH may be shims that fail, so every candidate is run.
is_new_enough() { "$1" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 12))' >/dev/null 2>&1; }

find_python() {
    local candidate
    for candidate in python3.13 python3.12 python3.14 python3 python \
        "$HOME"/.pyenv/versions/*/bin/python3 /usr/local/bin/python3.* /opt/*/bin/python3; do
        candidate=$(command -v "$candidate") || continue
        if is_new_enough "$candidate"; then echo "$candidate"; return 0; fi
    done
    return 1
}

# A path of uv: the user's, or one that the pip of an older Python can install into .uv.
find_uv() {
    local candidate
    for candidate in uv "$HOME/.local/bin/uv" "$root/.uv/bin/uv"; do
        if "$candidate" --version >/dev/null 2>&1; then echo "$candidate"; return 0; fi
    done
    for candidate in python3 python /usr/bin/python3; do
        "$candidate" -m pip --version >/dev/null 2>&1 || continue
        say "installing uv into .uv with the pip of $(command -v "$candidate")"
        "$candidate" -m pip install --quiet --disable-pip-version-check --upgrade --target "$root/.uv" uv >&2 || continue
        if "$root/.uv/bin/uv" --version >/dev/null 2>&1; then echo "$root/.uv/bin/uv"; return 0; fi
    done
    return 1
}

# The path of a Python that uv downloads, into the user's folder of such interpreters.
python_of_uv() {
    local uv found
    say "no Python 3.12 or newer with the module venv was found; uv can download $uv_python"
    uv=$(find_uv) || return 1
    export UV_PYTHON_PREFERENCE=only-managed UV_PYTHON_INSTALL_BIN=0
    "$uv" python install --no-progress "$uv_python" >&2 || return 1 # with --quiet it would not say why it fails
    found=$(cd / && "$uv" python find "$uv_python") && is_new_enough "$found" && echo "$found"
}

# The path of the Python that makes .venv: the user's choice, one of the machine, or one that uv downloads.
choose_python() {
    if [ -n "${PAIRSIM_PYTHON:-}" ]; then
        if is_new_enough "$PAIRSIM_PYTHON"; then command -v "$PAIRSIM_PYTHON"; return; fi
        say "PAIRSIM_PYTHON is $PAIRSIM_PYTHON, which is no Python 3.12 or newer with the module venv"
        return 1
    fi
    find_python || python_of_uv && return
    say "uv could not bring a Python; install 3.12 or newer (on Debian and Ubuntu python3-venv, too), or set" \
        "PAIRSIM_PYTHON to an interpreter"
    return 1
}

has_fenicsx() {
    "$1" -c 'import dolfinx, sys; sys.exit(tuple(map(int, dolfinx.__version__.split(".")[:2])) != (0, 11))' >/dev/null 2>&1
}

includes() { # whether the list $1 has all entries of the list $2
    local entry
    for entry in ${2//,/ }; do
        case ",$1," in *",$entry,"*) ;; *) return 1 ;; esac
    done
}

setup_venv() {
    local extras=$1 python options=() wanted state installed size
    if [ "$(uname -s)" != Linux ]; then
        say "the commands in scripts/ are for Linux, this is $(uname -s); $other_ways"
        exit 1
    fi
    exec 9>"$root/.venv.lock"
    if ! flock -n 9; then
        say "another set-up is running; waiting for it"
        flock 9
    fi
    state="$(sha256sum "$root/pyproject.toml" | cut -d' ' -f1) $root"
    # The commands of this folder ask for different extras; what one of them has installed, another keeps.
    if [ -f "$venv/.pairsim-ready" ]; then
        wanted=$(cat "$venv/.pairsim-ready")
        installed=${wanted%% *}
        if [ "${wanted#* }" = "$state" ] && includes "$installed" "$extras"; then exec 9>&-; return 0; fi
        extras=$(printf '%s\n' ${installed//,/ } ${extras//,/ } | sort -u | paste -sd,)
    fi
    wanted="$extras $state"
    if ! command -v cc >/dev/null && ! command -v gcc >/dev/null; then
        say "no C compiler (cc or gcc) was found; forms are compiled when first used. On Debian: apt install gcc"
        exit 1
    fi
    # Without pip it is what an interrupted set-up left.
    if ! is_new_enough "$venv/bin/python" || ! "$venv/bin/python" -m pip --version >/dev/null 2>&1; then
        python=$(choose_python) || exit 1
        # A site's own FEniCSx (Debian, conda, Spack) is used where that Python has it.
        if has_fenicsx "$python"; then
            say "using the FEniCSx of $python"
            options=(--system-site-packages)
        elif [ "$(uname -m)" != x86_64 ]; then
            say "the wheel of FEniCSx is for x86_64, this is $(uname -m); $other_ways"
            exit 1
        fi
        say "making .venv with $python"
        rm -rf "$venv"
        "$python" -m venv "${options[@]}" "$venv" || { rm -rf "$venv"; exit 1; }
    fi
    if grep -q '^include-system-site-packages = true' "$venv/pyvenv.cfg"; then
        extras=$(echo "$extras" | sed 's/\(^\|,\)fenicsx//; s/^,//')
    fi
    rm -f "$venv/.pairsim-ready"
    if includes "$extras" dev; then size="2 GB"; else size="1.4 GB"; fi
    say "installing (once; some minutes, $size)"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check -e "$root${extras:+[$extras]}" || {
        say "the installation failed; the same command tries again. Where pip finds no dolfinx-solver-real, the system" \
            "is older than its wheel (glibc 2.34); $other_ways"
        exit 1
    }
    echo "$wanted" >"$venv/.pairsim-ready"
    say "ready"
    exec 9>&-
}
