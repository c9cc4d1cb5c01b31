#!/usr/bin/env bash
# Runs one program on six cores in QEMU and compares what it says with the host. Gets their compilers and
# QEMU if they can be had; what cannot be had is named and left out.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. tests/apt.sh

# The image's core, which the test insists on.
bash tests/setup.sh

for target in thumbv6m-none-eabi thumbv7m-none-eabi thumbv7em-none-eabihf thumbv8m.main-none-eabihf \
    riscv32imc-unknown-none-elf riscv32imafc-unknown-none-elf; do
    timeout 180 rustup target add "$target" || say "no rustup target $target" >&2
done
command -v qemu-system-riscv32 >/dev/null || apt_install qemu-system-misc || say "no qemu-system-riscv32" >&2
exec cargo test --locked --test cores -- --nocapture
