#!/usr/bin/env python3
"""Writes one flight in every form that flight files have, and where it is: tests/golden/flights/.

    pip install pyulog==1.3.0 pymavlink==2.4.50 pymap3d==3.2.0 numpy
    python3 tests/golden/flights.py

The ULog is written by pyulog, from bytes that this script makes and pyulog reads; pymavlink reads the ArduPilot log back;
pymap3d turns places into latitudes. Expected rows: seconds since the first, east, north, up in metres.
"""

import json
import struct
import sys
from pathlib import Path

import numpy as np
import pymap3d
from pymavlink import DFReader
from pyulog import ULog

FOLDER = Path(__file__).resolve().parent / "flights"
TIMES = np.arange(40) / 10
PLACES = np.stack([20 + 5 * np.cos(0.8 * TIMES), -12 + 4 * np.sin(0.8 * TIMES), 9 + 0.25 * TIMES], 1)
ORIGIN = (47.397742, 8.545594, 488.0)
EPOCH_NS = 1_700_000_000_123_456_789
FOOT = 0.3048


def rows(places):
    return [[round(float(t), 6), *map(float, p)] for t, p in zip(TIMES, places)]


def lines(name, header, rows):
    (FOLDER / name).write_text("\n".join([*header, *rows]) + "\n")
    return name


def tum():
    body = [f"{1.7e9 + t:.6f} {x:.6f} {y:.6f} {z:.6f} 0 0 0 1" for t, (x, y, z) in zip(TIMES, PLACES)]
    return lines("tum.txt", ["# timestamp tx ty tz qx qy qz qw"], body), PLACES


def tum_bare():
    body = [f"{1.7e9 + t:.6f} {x:.6f} {y:.6f} {z:.6f} 0 0 0 1" for t, (x, y, z) in zip(TIMES, PLACES)]
    return lines("tum_without_header.tum", [], body), PLACES


def euroc():
    names = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
    body = [f"{EPOCH_NS + round(t * 1e9)},{x:.6f},{y:.6f},{z:.6f},1,0,0,0" for t, (x, y, z) in zip(TIMES, PLACES)]
    return lines("euroc.csv", [names], body), PLACES


def geodetic():
    lat, lon, h = pymap3d.enu2geodetic(*PLACES.T, *ORIGIN)
    return lat, lon, h


def local(lat, lon, height, start):
    return np.stack(pymap3d.geodetic2enu(lat, lon, height, lat[0], lon[0], start), 1)


def airdata():
    lat, lon, h = geodetic()
    above = h - ORIGIN[2]
    names = "time(millisecond),datetime(utc),latitude,longitude,height_above_takeoff(feet),speed(mph)"
    body = [
        f"{round(1000 * t)},2026-01-01 10:00:00,{a:.10f},{o:.10f},{z / FOOT:.6f},3"
        for t, a, o, z in zip(TIMES, lat, lon, above)
    ]
    # The receiver says its last fix twice.
    body.insert(7, body[6])
    return lines("airdata.csv", [names], body), local(lat, lon, above, 0.0)


def dji():
    lat, lon, h = geodetic()
    names = "OSD.flyTime [s],OSD.latitude,OSD.longitude,OSD.height [ft],OSD.altitude [ft]"
    above = h - ORIGIN[2]
    body = [
        f"{t:.1f},{a:.10f},{o:.10f},{z / FOOT:.6f},{(z + 488) / FOOT:.6f}" for t, a, o, z in zip(TIMES, lat, lon, above)
    ]
    return lines("dji.csv", [names], body), local(lat, lon, above, 0.0)


def any_csv():
    lat, lon, h = geodetic()
    body = [f"{t:.1f};{a:.10f};{o:.10f};{z:.6f}".replace(".", ",") for t, a, o, z in zip(TIMES, lat, lon, h)]
    return lines("geodetic.csv", ["time_s;lat;lon;alt"], body), local(lat, lon, h, h[0])


def px4():
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000)

    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    out += message("B", bytes(8) + bytes(8) + bytes(24))
    fields = "uint64_t timestamp;float x;float y;float z;bool xy_valid;bool z_valid;uint8_t[6] _padding0;"
    out += message("F", f"vehicle_local_position:{fields}".encode())
    out += message("F", b"other:uint64_t timestamp;float x;float[4] q;")
    for multi_id, identity, name in ((0, 0, b"vehicle_local_position"), (1, 1, b"vehicle_local_position"), (0, 2, b"other")):
        out += message("A", struct.pack("<BH", multi_id, identity) + name)
    for t, (x, y, z) in zip(TIMES, PLACES):
        stamp = 5_000_000 + round(t * 1e6)
        if t == 0:
            # Not yet valid: left out.
            bad = struct.pack("<HQfff??6x", 0, stamp - 100_000, 900.0, 900.0, 900.0, False, True)
            out += message("D", bad[:-6])
        data = struct.pack("<HQfff??", 0, stamp, y, x, -z, True, True)
        out += message("D", data)
        out += message("D", struct.pack("<HQfff??", 1, stamp, 1.0, 2.0, 3.0, True, True))
        out += message("D", struct.pack("<HQf4f", 2, stamp, 7.0, 1.0, 0.0, 0.0, 0.0))
    raw = FOLDER / "raw.ulg"
    raw.write_bytes(out)
    log = ULog(str(raw))
    log.write_ulog(str(FOLDER / "px4.ulg"))
    raw.unlink()
    return "px4.ulg", PLACES.astype(np.float32)


def ardupilot():
    out = b""

    def fmt(kind, length, name, types, labels):
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, length, name, types, labels)

    out += fmt(128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    out += fmt(1, 3 + 8 + 1 + 12, b"XKF1", b"QBfff", b"TimeUS,C,PN,PE,PD")
    out += fmt(2, 3 + 8 + 12, b"POS", b"QLLf", b"TimeUS,Lat,Lng,Alt")
    for t, (x, y, z) in zip(TIMES, PLACES):
        stamp = 9_000_000 + round(t * 1e6)
        out += b"\xa3\x95\x01" + struct.pack("<QBfff", stamp, 0, y, x, -z)
        out += b"\xa3\x95\x01" + struct.pack("<QBfff", stamp, 1, 5.0, 6.0, 7.0)
        out += b"\xa3\x95\x02" + struct.pack("<Qiif", stamp, 473977420, 85455940, 488.0)
    path = FOLDER / "ardupilot.bin"
    path.write_bytes(out)
    reader = DFReader.DFReader_binary(str(path))
    found = []
    while (entry := reader.recv_match(type="XKF1")) is not None:
        if entry.C == 0:
            found.append((entry.PE, entry.PN, -entry.PD))
    assert np.array_equal(np.array(found, np.float32), PLACES.astype(np.float32))
    return "ardupilot.bin", PLACES.astype(np.float32)


def ardupilot_pos():
    lat, lon, h = geodetic()
    out = b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", 128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    out += b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", 2, 23, b"POS", b"QLLf", b"TimeUS,Lat,Lng,Alt")
    lat7, lon7, alt = np.round(lat * 1e7), np.round(lon * 1e7), h.astype(np.float32)
    for t, a, o, z in zip(TIMES, lat7, lon7, alt):
        out += b"\xa3\x95\x02" + struct.pack("<Qiif", round(t * 1e6), int(a), int(o), z)
    (FOLDER / "ardupilot_pos.bin").write_bytes(out)
    z = alt.astype(float)
    return "ardupilot_pos.bin", local(lat7 * 1e-7, lon7 * 1e-7, z, z[0])


def main():
    FOLDER.mkdir(exist_ok=True)
    forms = [tum, tum_bare, euroc, airdata, dji, any_csv, px4, ardupilot, ardupilot_pos]
    expected = {name: rows(places) for name, places in (form() for form in forms)}
    (FOLDER / "expected.json").write_text(json.dumps(expected) + "\n")


if __name__ == "__main__":
    sys.exit(main())
