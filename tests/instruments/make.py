"""Writes the files of this folder with the makers' or other people's writers: NumPy, SciPy, npTDMS, `wave`, and `struct` for the oscilloscopes.

v[i] = 0.25 sin(0.3 i) + 0.05 V, 400 samples every 0.2 us from -10 us on; pip install numpy scipy nptdms
"""

import struct
import wave

import numpy as np
import scipy.io
import scipy.io.wavfile
from nptdms import ChannelObject, GroupObject, TdmsWriter

N, STEP, START = 400, 2e-7, -1e-5
i = np.arange(N)
v = 0.25 * np.sin(0.3 * i) + 0.05
t = START + STEP * i

np.save("volts.npy", np.column_stack([t, v]))
np.savez_compressed("named.npz", time_s=t, velocity_mm_per_s=1e3 * v, note=np.array("text"))
np.savez("rate.npz", fs=5e6, volts_V=v.astype(">f4"), t0=START)
scipy.io.savemat("compressed.mat", {"time_s": t, "velocity_mm_per_s": 1e3 * v}, do_compression=True)
np.savez("clock.npz", time_us=1e6 * t, velocity_mm_per_s=1e3 * v, fs=5.0)
np.savez("rows.npz", t=t, fs=5e6, scope_V=np.vstack([v, -v]), notes=np.arange(5.0))
scipy.io.savemat("version-4.mat", {"Tstart": START, "Tinterval": STEP, "A": v[:, None].astype("f4"), "note": "text"}, format="4")
scipy.io.savemat("structure.mat", {"rec": {"volts_V": v[:, None], "name": "chain"}, "fs": 5e6}, do_compression=False)

with TdmsWriter("segments.tdms") as writer:
    about = {"wf_increment": STEP, "wf_start_offset": START, "unit_string": "V"}
    for part in (v[:150], v[150:]):
        writer.write_segment([ChannelObject("scope", "vibrometer", part, about), ChannelObject("scope", "horn", 2 * part, about)])

# Raw counts with a scale, a channel of texts in between, and a step of 1 s beside a channel of instants.
with TdmsWriter("scaled.tdms") as writer:
    scale = {"NI_Scaling_Status": "unscaled", "NI_Number_Of_Scales": 2, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 1e-5,
             "NI_Scale[0]_Linear_Y_Intercept": 0.1, "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF, "NI_Scale[1]_Scale_Type": "Polynomial",
             "NI_Scale[1]_Polynomial_Coefficients_Size": 2, "NI_Scale[1]_Polynomial_Coefficients[0]": -0.2, "NI_Scale[1]_Polynomial_Coefficients[1]": 2.0,
             "NI_Scale[1]_Polynomial_Input_Source": 0, "unit_string": "V", "wf_increment": 1.0}
    counts = np.round(v / 2e-5).astype("<i2")
    writer.write_segment([GroupObject("scope", scale)])
    for part in (slice(0, 150), slice(150, N)):
        writer.write_segment([ChannelObject("scope", "horn", -counts[part], {"unit_string": "V"})])
        writer.write_segment([ChannelObject("clock", "Time", 1e6 * t[part], {"unit_string": "us"}), ChannelObject("scope", "vibrometer", counts[part], scale)])
        writer.write_segment([ChannelObject("log", "events", ["trigger", "end"])])

# What stands beside the samples in one structure, and units in texts.
scipy.io.savemat("beside.mat", {"rec": {"data": v[:, None], "fs": 1 / STEP, "t0": START, "unit": "V"}, "fs": 1.0})
scipy.io.savemat("units.mat", {"time": 1e6 * t, "data": 1e3 * v, "horizontalUnits": "us", "verticalUnits": "mV"})
np.savez_compressed("units.npz", time=1e6 * t, data=1e3 * v, time_unit="us", data_unit="mV")
np.savez_compressed("contradiction.npz", volts_V=v, fs=1 / STEP, dt=1e3 * STEP)

scipy.io.wavfile.write("doubles.wav", round(1 / STEP), np.column_stack([v, -v]))
form = struct.pack("<HHIIHH", 1, 1, round(1 / STEP), 2 * round(1 / STEP), 2, 16)
counts = np.round(v * 2**15).astype("<i2").tobytes()
chunks = b"WAVEds64" + struct.pack("<IQQQI", 28, 72 + len(counts), len(counts), N, 0) + b"fmt " + struct.pack("<I", len(form)) + form
open("long.wav", "wb").write(b"RF64" + struct.pack("<I", 2**32 - 1) + chunks + b"data" + struct.pack("<I", 2**32 - 1) + counts)

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
counts = np.round((v - 0.05) / 1e-5 + 1000)
open("curve.isf", "wb").write(preamble.encode() + counts.astype(">i2").tobytes() + b"\n")
text = preamble.replace("ENCDG BIN", "ENCDG ASC").replace("#3800", " " + ",".join(f"{c:.0f}" for c in counts))
open("curve-text.isf", "w").write(text + "\n")

# Keysight, version 10, two waveforms.
def waveform(values, label):
    head = struct.pack("<5if3d2i", 140, 1, 1, N, 0, 1e-3, START, STEP, START, 2, 1)
    head += struct.pack("<16s16s24s16sdI", b"27 NOV 2026", b"06:31:05", b"MSO-X 3024T:MY1", label, 0.0, 0)
    data = values.astype("<f4").tobytes()
    return head + struct.pack("<ihhi", 12, 1, 4, len(data)) + data

body = waveform(v, b"1") + waveform(2 * v, b"2")
open("two-channels.bin", "wb").write(b"AG10" + struct.pack("<ii", 12 + len(body), 2) + body)


# Rohde & Schwarz: a description, and beside it 32-bit floats of two channels behind three settling samples.
about = {
    "XStart": START, "Resolution": STEP, "SignalRecordLength": N, "LeadingSettlingSamples": 3, "SignalFormat": "FORMAT_FLOAT",
    "MultiChannelExport": "EXPORT_ON", "TraceArithmetics": "ARITHMETICS_AVERAGE", "NumberOfAcquisitions": 8,
}
lines = [f'<Prop Name="{key}" Value="{value}"/>' for key, value in about.items()]
lines.append('<Prop Name="MultiChannelExportState" I_0="STATE_ON" I_1="STATE_OFF" I_2="STATE_ON" I_3="STATE_OFF"/>')
open("pair.bin", "w").write('<?xml version="1.0"?>\n<Database>\n' + "\n".join(lines) + "\n</Database>\n")
both = np.column_stack([np.concatenate([[9, 9, 9], v]), np.concatenate([[9, 9, 9], -v])])
open("pair.Wfm.bin", "wb").write(struct.pack("<II", 4, N + 3) + both.astype("<f4").tobytes())


# Tektronix .wfm, versions 1 (most significant byte first, 16 bits) and 3 (8 bits), 16 samples before the record and 4 behind it.
def tektronix(name, order, version, volts, time, curve, kind, gain, zero):
    d = bytearray(curve + 30)
    d[0:10] = (b"\x0f\x0f" if order == "<" else b"\xf0\xf0") + b":WFM#00%d" % version
    width = kind.itemsize
    struct.pack_into(order + "BI", d, 15, width, len(d))
    struct.pack_into("32s", d, 40, b"bead 6")
    struct.pack_into(order + "I", d, 122, 2)
    struct.pack_into(order + "ddI20s", d, volts, gain, zero, 1, b"V")
    struct.pack_into(order + "I", d, volts + 72, {"h": 0, "b": 7}[kind.char])
    struct.pack_into(order + "ddI20s", d, time, STEP, START, N + 20, b"s")
    struct.pack_into(order + "5I", d, curve + 10, 0, 16 * width, (16 + N) * width, (20 + N) * width, 0)
    whole = np.concatenate([np.full(16, -3), np.round((v - zero) / gain), np.full(4, -3)])
    open(name, "wb").write(d + whole.astype(kind).tobytes())


# Siglent, channels 2 and 4 of version 2 (8 bits), channel 3 of version 4 (16 bits, probe 10x): scale, offset, clock, samples.
def siglent(name, version, shift, channels, codes, wide):
    d = bytearray(0x800 + 2 * shift)
    unit = lambda value, prefix=8, volt=1, ampere=0: struct.pack("<di7i", value, prefix, 0, volt, 1, ampere, 1, 0, 1)
    struct.pack_into("<II", d, 0, version, len(d))
    for channel in range(4):
        scale, offset, probe = channels.get(channel, (1.0, 0.0, 1.0))
        struct.pack_into("<I", d, 4 + shift + 4 * channel, channel in channels)
        for at, value in ((0x14, scale), (0xB4, offset)):
            d[at + shift + 40 * channel : at + shift + 40 * channel + 40] = unit(1e3 * value, 7)
        struct.pack_into("<d", d, 0x240 + shift + 8 * channel, probe)
        if version > 2:
            struct.pack_into("<I", d, 0x26C + shift + 4 * channel, codes)
    # From the left edge on: half a screen of 14 or 10 divisions before the trigger, and a delay.
    divisions = 14 if version == 2 else 10
    for at, value in ((0x198, 5e-6), (0x1C0, START + 0.5 * divisions * 5e-6), (0x1EC, 1 / STEP)):
        d[at + shift : at + shift + 40] = unit(value, volt=0)
    struct.pack_into("<I", d, 0x1E8 + shift, N)
    struct.pack_into("<BB", d, 0x260 + shift, wide, 0)
    struct.pack_into("<I", d, 0x268 + shift, divisions if version > 2 else 0)
    middle, kind = (2**15, "<u2") if wide else (2**7, "u1")
    code = lambda scale, offset, probe, values: np.round((values / probe + offset) / scale * codes + middle).astype(kind).tobytes()
    open(name, "wb").write(d + b"".join(code(*row, v if channel < 3 else -v) for channel, row in channels.items()))


siglent("siglent-2.bin", 2, 0, {1: (0.1, -0.02, 1.0), 3: (0.1, 0.05, 1.0)}, 25, False)
siglent("siglent-4.bin", 4, 4, {2: (0.01, 0.004, 10.0)}, 7680, True)

tektronix("tektronix-1.wfm", ">", 1, 166, 478, 790, np.dtype(">i2"), 1e-5, 0.05)
tektronix("tektronix-3.wfm", "<", 3, 168, 488, 808, np.dtype("<i1"), 2.5e-3, 0.05)


# Rigol: one byte a sample; the record's middle in ps.
def counts(values, step, zero):
    return np.round(values / step + zero).astype(np.uint8).tobytes()


MIDDLE = 30_000_000
rate = 1 / STEP

d = bytearray(276)  # DS1000E, channel 2 alone, probe 10x
struct.pack_into("<2B", d, 0, 0xA5, 0xA5)
struct.pack_into("<I", d, 28, N)
struct.pack_into("<ih2xfxB2xih", d, 60, 10_000, 12, 10.0, 1, 10_000, 12)
struct.pack_into("<qqfqq", d, 84, 1, 0, rate, 1, MIDDLE)
open("rigol-e.wfm", "wb").write(d + counts(-v, 0.004, 125 - 12))

d = bytearray(420)  # DS1000B, channels 2 and 4
struct.pack_into("<4B8s", d, 0, 0xA5, 0xA5, 0xA4, 1, b"DS1104B")
struct.pack_into("<I", d, 60, N)
for channel, shift in ((1, -20), (3, 5)):
    struct.pack_into("<ih2xf2xBxih", d, 68 + 24 * channel, 125_000, shift, 1.0, 1, 125_000, shift)
struct.pack_into("<qqfqq", d, 164, 1, 0, rate, 1, MIDDLE)
body = [bytes(N), counts(-v, 0.005, 99 + 20), bytes(N), counts(v, 0.005, 99 - 5)]
open("rigol-b.wfm", "wb").write(d + b"".join(body))

d = bytearray(500)  # DS2000, channel 2 in the memory of both, mean of 32
struct.pack_into("<2BH20s20sHH", d, 0, 0xA5, 0xA5, 0x38, b"DS2D000000001", b"00.03.05", 1, 20)
struct.pack_into("<2B2xII8xHH", d, 64, 2, 1, 500, 500 + N // 2 + 9, 1, 32)
struct.pack_into("<If", d, 92, N, rate)
struct.pack_into("<qq", d, 104, 1, MIDDLE)
struct.pack_into("<B7xffBB", d, 148, 8, 0.1, 0.04, 2, 0)
struct.pack_into("<I", d, 252, N)
whole = counts(v, 0.004, 127 + 10)
open("rigol-2000.wfm", "wb").write(d + whole[0::2] + bytes(9) + whole[1::2])

d = bytearray(660)  # DS4000, channels 1 and 3
struct.pack_into("<2BH20s20sHH", d, 0, 0xA5, 0xA5, 0x38, b"DS4A000000001", b"00.02.03", 1, 24)
struct.pack_into("<B3xIIII", d, 64, 5, 660, 0, 660 + N, 0)
struct.pack_into("<If", d, 96, N, rate)
for channel in (0, 2):
    struct.pack_into("<B7xffBB", d, 124 + 28 * channel, 1, 0.16, -0.05, 0, 2)
struct.pack_into("<I", d, 268, N)
struct.pack_into("<q", d, 568, MIDDLE)
open("rigol-4000.wfm", "wb").write(d + counts(v, 0.005, 127 - 10) + counts(-v, 0.005, 127 - 10))

# HDF5 by h5py, and MATLAB 7.3 by hdf5storage; pip install h5py hdf5storage
import h5py
import hdf5storage

with h5py.File("chunks.h5", "w") as file:
    scope = file.create_group("scope")
    scope["time_s"] = t
    scope.create_dataset("vibrometer", data=v.astype(">f4"), chunks=(64,), compression="gzip", shuffle=True, fletcher32=True).attrs["unit"] = "mm/s"
    file["about"] = "text"
with h5py.File("contradiction.h5", "w") as file:
    file.create_dataset("vibrometer", data=v[:40]).attrs.update({"unit": "V", "fs": 1 / STEP, "dt": 1e3 * STEP})
with h5py.File("columns.h5", "w", libver=("v110", "v110")) as file:
    file.create_dataset("record", data=np.column_stack([t, 1e3 * v]), chunks=(64, 2), compression="lzf")
with h5py.File("infiniium.h5", "w") as file:
    for number, sign in ((1, 1), (2, -1)):
        channel = file.create_group(f"Waveforms/Channel {number}")
        channel.attrs.update({"XInc": STEP, "XOrg": START, "XUnits": "Second", "YInc": 2e-5, "YOrg": 0.05, "YUnits": "Volt"})
        channel[f"Channel {number} Data"] = np.round((sign * v - 0.05) / 2e-5).astype("<i2")
hdf5storage.savemat(
    "matrix-7.3.mat",
    {"rec": {"volts_V": np.column_stack([v, -v]), "name": "chain"}, "fs": np.array([[5e6]]), "flag": np.array([[True]])},
    format="7.3", truncate_existing=True, store_python_metadata=False, compress=True, compress_size_threshold=1,
)
