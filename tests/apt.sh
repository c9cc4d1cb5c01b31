# Sourced by what installs Debian's packages: setup.sh and cores.sh.

say() { printf '%s: %s\n' "$(basename "$0" .sh)" "$*"; }

# As root, or through sudo.
root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        say "need root (or sudo) to run: $*" >&2
        return 1
    fi
}

apt_install() {
    command -v apt-get >/dev/null || {
        say "no apt-get here; install by hand: $*" >&2
        return 1
    }
    say "apt-get install $*"
    # Once, whatever comes of it: a network that is not there takes its time to say so.
    if [ -z "${apt_lists:-}" ]; then
        apt_lists=asked
        root apt-get update -qq || say "the lists of packages stay as they were" >&2
    fi
    root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@"
}
