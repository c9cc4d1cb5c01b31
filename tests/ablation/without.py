#!/usr/bin/env python3
"""Writes a recursive blob with some of its hypotheses made impossible: the rows of docs/choices.md.

    python3 tests/ablation/without.py models/recursive.bnkf jump outlier --out nominal_burst.bnkf

Their priors become the least that a blob may hold, 1e-9, what they multiply noises with becomes one (a likelihood can be
worth more than 1e-9), and the checksum is made again. Frequencies are still learned in flight from what is left.
Offsets are those of firmware/BLOB.md.
"""

import argparse
import struct
import zlib
from pathlib import Path

HEADER_LEN = 24
CRC_AT = 12
# Where the prior stands, and how many multipliers follow it.
PARAMETERS = {"burst": (22, 3), "jump": (26, 3), "outlier": (30, 1)}
LEAST = 1e-9


def checksum(blob: bytes) -> int:
    """Over all bytes but the checksum's own."""
    return zlib.crc32(blob[CRC_AT + 4 :], zlib.crc32(blob[:CRC_AT]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("blob", type=Path)
    parser.add_argument("hypotheses", nargs="+", choices=PARAMETERS)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    blob = bytearray(args.blob.read_bytes())
    if blob[:4] != b"BNKF" or struct.unpack_from("<I", blob, CRC_AT)[0] != checksum(blob):
        raise SystemExit(f"{args.blob}: not a blob, or damaged")
    if blob[6] != 2:
        raise SystemExit(f"{args.blob}: not a recursive blob")
    for name in args.hypotheses:
        prior, multipliers = PARAMETERS[name]
        values = [LEAST] + [1.0] * multipliers
        struct.pack_into(f"<{len(values)}f", blob, HEADER_LEN + 4 * prior, *values)
    struct.pack_into("<I", blob, CRC_AT, checksum(blob))
    args.out.write_bytes(blob)


if __name__ == "__main__":
    main()
