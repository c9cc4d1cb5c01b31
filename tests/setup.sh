#!/usr/bin/env bash
# Installs what the tests need beyond a Rust toolchain: a C compiler for the host, a Rust compiler for the
# Cortex-M4F, QEMU, and Python for the wheel; and what tests leave themselves out without: compilers for C++
# and for C on the Cortex-M4F, CMake, and a browser for the report. Does nothing, quickly, when all is there.
# Says what it uses.
set -euo pipefail

target=thumbv7em-none-eabihf
missing=()
optional=()

. "$(dirname "${BASH_SOURCE[0]}")/apt.sh"

has_installed_target() {
    local libraries
    libraries=$(rustc --print target-libdir --target "$target" 2>/dev/null) && [ -d "$libraries" ]
}

has_debian_toolchain() {
    local sysroot
    [ -x /usr/bin/cargo ] && sysroot=$(/usr/bin/rustc --print sysroot 2>/dev/null) &&
        [ -f "$sysroot/lib/rustlib/src/rust/library/core/src/lib.rs" ] && has_linker
}

# rustup's toolchain brings rust-lld; any LLVM linker will do.
has_linker() {
    local sysroot
    command -v ld.lld >/dev/null ||
        { sysroot=$(rustc --print sysroot 2>/dev/null) &&
            compgen -G "$sysroot/lib/rustlib/*/bin/rust-lld" >/dev/null; }
}

# The report's test opens the page.
browser() {
    command -v chromium || command -v chromium-browser || command -v google-chrome
}

add_rustup_target() {
    command -v rustup >/dev/null || return 1
    say "rustup target add $target"
    # A blocked download must not hang the tests.
    timeout 180 rustup target add "$target"
}

if ! command -v cargo >/dev/null; then
    say "no cargo: install Rust from https://rustup.rs first" >&2
    exit 1
fi
command -v cc >/dev/null || missing+=(gcc libc6-dev)
command -v qemu-system-arm >/dev/null || missing+=(qemu-system-arm)
# The wheel's test makes an environment.
python3 -c 'import ensurepip, venv' 2>/dev/null || missing+=(python3 python3-venv)
if [ ${#missing[@]} -gt 0 ]; then
    apt_install "${missing[@]}"
fi
# tests/from_c.rs and the report's test name what they leave out.
command -v c++ >/dev/null || optional+=(g++)
command -v arm-none-eabi-gcc >/dev/null || optional+=(gcc-arm-none-eabi)
command -v cmake >/dev/null || optional+=(cmake)
browser >/dev/null || optional+=(chromium)
# One by one: a system may lack one of them.
for package in "${optional[@]}"; do
    apt_install "$package" || say "no $package: what needs it is left out" >&2
done
if ! has_installed_target && ! has_debian_toolchain && ! add_rustup_target; then
    # Where rustup cannot download: Debian's compiler with the sources of the core library.
    apt_install rustc-web cargo-web rust-web-src lld
fi

if has_installed_target; then
    say "compiler for $target: $(rustc --version)"
elif has_debian_toolchain; then
    say "compiler for $target: Debian's $(/usr/bin/rustc --version), core from source"
else
    say "no compiler for $target could be installed" >&2
    exit 1
fi
say "emulator: $(qemu-system-arm --version | head -n 1)"
say "browser: $(browser || echo none)"
