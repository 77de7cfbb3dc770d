"""Writes the files of this folder with the makers' or other people's writers: NumPy, SciPy, npTDMS, `wave`, and `struct` for the oscilloscopes.

v[i] = 0.25 sin(0.3 i) + 0.05 V, 400 samples every 0.2 us from -10 us on; pip install numpy scipy nptdms
"""

import struct
import wave

import numpy as np
import scipy.io
from nptdms import ChannelObject, TdmsWriter

N, STEP, START = 400, 2e-7, -1e-5
i = np.arange(N)
v = 0.25 * np.sin(0.3 * i) + 0.05
t = START + STEP * i

np.save("volts.npy", np.column_stack([t, v]))
np.savez_compressed("named.npz", time_s=t, velocity_mm_per_s=1e3 * v, note=np.array("text"))
np.savez("rate.npz", fs=5e6, volts_V=v.astype(">f4"), t0=START)
scipy.io.savemat("compressed.mat", {"time_s": t, "velocity_mm_per_s": 1e3 * v}, do_compression=True)
scipy.io.savemat("structure.mat", {"rec": {"volts_V": v[:, None], "name": "chain"}, "fs": 5e6}, do_compression=False)

with TdmsWriter("segments.tdms") as writer:
    about = {"wf_increment": STEP, "wf_start_offset": START, "unit_string": "V"}
    for part in (v[:150], v[150:]):
        writer.write_segment([ChannelObject("scope", "vibrometer", part, about), ChannelObject("scope", "horn", 2 * part, about)])

with wave.open("full-scale.wav", "wb") as sound:
    sound.setparams((2, 3, 5000000, N, "NONE", ""))
    counts = np.round(v * 2**23).astype(int)
    sound.writeframes(b"".join(struct.pack("<i", int(c))[:3] + struct.pack("<i", -int(c))[:3] for c in counts))

# LeCroy, template LECROY_2_3, 16 bits, least significant byte first.
gain, offset = 1.0 / 65536, -0.05
raw = np.round((v + offset) / gain).astype("<i2").tobytes()
d = bytearray(346)
struct.pack_into("<16s16sHH", d, 0, b"WAVEDESC", b"LECROY_2_3", 1, 1)
struct.pack_into("<I", d, 36, 346)
struct.pack_into("<I", d, 60, len(raw))
struct.pack_into("<16sI16s", d, 76, b"LECROYHDO4024", 1, b"")
struct.pack_into("<I", d, 116, N)
struct.pack_into("<II", d, 144, 1, 16)
struct.pack_into("<ff", d, 156, gain, offset)
struct.pack_into("<fdd", d, 176, STEP, START, START)
struct.pack_into("<48s48s", d, 196, b"V", b"S")
struct.pack_into("<H", d, 344, 1)
open("averaged.trc", "wb").write(b"#9%09d" % (len(d) + len(raw)) + d + raw)

# Tektronix, 16 bits, most significant byte first.
preamble = (
    ':WFMPRE:BYT_NR 2;BIT_NR 16;ENCDG BIN;BN_FMT RI;BYT_OR MSB;NR_PT 400;WFID "Ch2, DC coupling, 100.0mV/div, 400 points, Sample mode";'
    f'PT_FMT Y;XINCR {STEP};PT_OFF 50;XZERO 0.0;XUNIT "s";YMULT 1.0E-5;YZERO 5.0E-2;YOFF 1000;YUNIT "V";:CURVE #3800'
)
open("curve.isf", "wb").write(preamble.encode() + np.round((v - 0.05) / 1e-5 + 1000).astype(">i2").tobytes() + b"\n")

# Keysight, version 10, two waveforms.
def waveform(values, label):
    head = struct.pack("<5if3d2i", 140, 1, 1, N, 0, 1e-3, START, STEP, START, 2, 1)
    head += struct.pack("<16s16s24s16sdI", b"27 NOV 2026", b"06:31:05", b"MSO-X 3024T:MY1", label, 0.0, 0)
    data = values.astype("<f4").tobytes()
    return head + struct.pack("<ihhi", 12, 1, 4, len(data)) + data

body = waveform(v, b"1") + waveform(2 * v, b"2")
open("two-channels.bin", "wb").write(b"AG10" + struct.pack("<ii", 12 + len(body), 2) + body)
