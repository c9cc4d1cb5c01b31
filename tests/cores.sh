#!/usr/bin/env bash
# Runs one program on six cores in QEMU and compares what it says with the host. Gets their compilers and
# QEMU if they can be had; what cannot be had is named and left out.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

for target in thumbv6m-none-eabi thumbv7m-none-eabi thumbv7em-none-eabihf thumbv8m.main-none-eabihf \
    riscv32imc-unknown-none-elf riscv32imafc-unknown-none-elf; do
    timeout 180 rustup target add "$target" || echo "cores: no rustup target $target" >&2
done
if ! command -v qemu-system-riscv32 >/dev/null && [ "$(id -u)" -eq 0 ]; then
    apt-get install -y -qq --no-install-recommends qemu-system-misc ||
        echo "cores: no qemu-system-riscv32" >&2
fi
exec cargo test --locked --test cores -- --nocapture
