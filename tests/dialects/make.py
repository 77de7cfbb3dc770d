"""Makes the small records in this folder: one motion, written as instruments and offices write it.

    python3 tests/dialects/make.py

The forms follow the instruments' manuals and exports found in public; none of the files comes from an instrument.
`plain.csv` is the reference. The files after `pyuff` are made by that package (tests/dialects/make_uff.py).
"""

import codecs
import math
import pathlib

here = pathlib.Path(__file__).parent
N, F0, STEP, BEFORE = 100, 73e3, 0.5, 20  # samples, Hz, us, samples before the trigger


def motion():
    """Times in us and velocities in mm/s, as text: the digits are the same in every file."""
    for i in range(N):
        t = (i - BEFORE) * STEP
        ring = 1 - math.exp(-t / 10) if t > 0 else 0.0
        quiet = 0.25 if i % 2 else -0.25
        v = 200 * ring * math.sin(2 * math.pi * F0 * t * 1e-6) + quiet
        yield f"{t:.1f}", f"{v:.2f}"


rows = list(motion())
comma = [(t.replace(".", ","), v.replace(".", ",")) for t, v in rows]
volts = [(t, f"{float(v) / 100:.4f}") for t, v in rows]  # 100 mm/s a volt
seconds = [(f"{float(t) * 1e-6:.8e}", v) for t, v in volts]


def table(pairs, delimiter=",", end="\n"):
    return "".join(f"{t}{delimiter}{v}{end}" for t, v in pairs)


def write(name, text, encoding="utf-8", mark=b""):
    (here / name).write_bytes(mark + text.encode(encoding))


write("plain.csv", "time_us,velocity_mm_per_s\n" + table(rows))

# What offices make of it.
german = "Zeit [µs];Geschwindigkeit [mm/s]\r\n" + table(comma, ";", "\r\n")
write("german.csv", german, mark=codecs.BOM_UTF8)
write("german-windows.csv", german, "cp1252")
write("german-utf16.csv", german, "utf-16-le", codecs.BOM_UTF16_LE)
write("german-utf16-big.csv", german, "utf-16-be", codecs.BOM_UTF16_BE)
write("greek-mu.csv", "Time [μs];Velocity [mm/s]\n" + table(rows, ";"))
write("tabs.txt", "t (us)\tv (mm/s)\n" + table(comma, "\t"))
write("trailing.csv", "Zeit;v\nus;mm/s\n" + table(comma, ";", ";\n"))
write("no-time.csv", "velocity_mm_per_s\n" + "".join(f"{v}\n" for _, v in rows))
write("volts.csv", "time_us,CH1 (V)\n" + table(volts))
write("millivolts.csv", "time_us,CH1 (mV)\n" + table([(t, f"{1e3 * float(v):.1f}") for t, v in volts]))

# What instruments write.
write("keysight.csv", "x-axis,1\nsecond,Volt\n" + table(seconds, ",", "\r\n"))
head = ["Revision:,0", "Type:,raw", "Start:,0", f"Points:,{N}", "Count:,1", "XDispRange:,5.0e-05", "XDispOrg:,-1.0e-05"]
head += ["XInc:,5.0E-07", "XOrg:,-1.0E-05", "XUnits:,Second", "YDispRange:,8.0", "YDispOrg:,0.0", "YUnits:,Volt"]
head += ["Frame:,DSO9254A:MY0", "Date:,01 JAN 2020", "Time:,12:00:00", "Max Bandwidth:,2.5E+09", "Data:,"]
infiniium = "".join(f"{line}\n" for line in head)
write("infiniium.csv", infiniium + "".join(f"{v}\n" for _, v in volts))
write("infiniium-xy.csv", infiniium + table(seconds))
stamp = "21-Nov-2019 10:11:12"
lecroy = f"LECROYWR640Zi,12345,Waveform\nSegments,1,SegmentSize,{N}\nSegment,TrigTime,TimeSinceSegment1\n#1,{stamp},0\n"
write("lecroy.csv", lecroy + "Time,Ampl\n" + table(seconds))
part = 60
lecroy = f"LECROYWR640Zi,12345,Waveform\nSegments,2,SegmentSize,{part}\nSegment,TrigTime,TimeSinceSegment1\n"
lecroy += f"#1,{stamp},0\n#2,{stamp},0.01\nTime,Ampl\n"
write("lecroy-segments.csv", lecroy + table([(t, "0.0000") for t, _ in seconds[:part]]) + table(seconds[:part]))
keys = ["Model,MDO4014B-3", "Firmware Version,3.22", "", "Waveform Type,ANALOG", "Point Format,Y", "Horizontal Units,s"]
keys += ["Horizontal Scale,1e-05", "Horizontal Delay,0", "Sample Interval,5e-07", f"Record Length,{N}", "Gating,0.0% to 100.0%"]
keys += ["Probe Attenuation,1", "Vertical Units,V", "Vertical Offset,0", "Vertical Scale,0.5", "Vertical Position,0"]
keys += [",", ",", ",", "Label,", "TIME,CH2"]
write("tektronix.csv", "".join(f"{key}\n" for key in keys) + table(seconds))
write("tektronix-commented.csv", "".join(f"#{key}\n" for key in keys) + table(seconds))
keys = [f"Record Length,{N:.6e}", "Sample Interval,5.000000e-07", "Trigger Point,2.000000e+01", "", "", "", "Source,CH1"]
keys += ["Vertical Units,V", "Vertical Scale,5.000000e-01", "Vertical Offset,0.0", "Horizontal Units,s", "Horizontal Scale,5e-06"]
keys += ["Pt Fmt,Y", "Yzero,0.0", "Probe Atten,1.0", "Model Number,TDS2024B", "Serial Number,C000000", "Firmware Version,FV:v22.11"]
beside = [f"{key if key else ','},,{t},{v},\n" for key, (t, v) in zip(keys + [""] * N, seconds)]
write("tektronix-beside.csv", "".join(beside))
write("rohde-schwarz.csv", "in s,C1 in V\n" + table(seconds))
digilent = ["Digilent WaveForms Oscilloscope Acquisition", "Device Name: Discovery2", "Serial Number: SN:000000000000"]
digilent += ["Date Time: 2019-11-21 10:11:12.000.000.000", "Sample rate: 2e+06Hz", f"Samples: {N}"]
digilent += ["Trigger: Source: Channel 1 Type: Edge Condition: Rise Level: 0 V Hysteresis: Auto HoldOff: 0 s"]
digilent += ["Channel 1: Range: 1 V/div Offset: 0 V"]
write("digilent.csv", "".join(f"#{line}\n" for line in digilent) + "\nTime (s),Channel 1 (V)\n" + table(seconds, ",", "\r\n"))
metres = [(t, f"{float(v) * 1e-1:.5e}") for t, v in seconds]
polytec = "Source File Name:\tC:\\Messung\\Perlen.pvd\nSignal:\tVib Velocity\nPoint Index:\t1\n\n"
write("polytec.txt", polytec + "Time\tVib Velocity\n[ s ]\t[ m/s ]\n" + table(metres, "\t"))

# Oscilloscopes whose instants stand in the header, or have few digits, or are not written.
start, step = -BEFORE * STEP * 1e-6, STEP * 1e-6
write("rigol.csv", f"X,CH1,Start,Increment,\nSequence,Volt,{start:e},{step:e}\n" + "".join(f"{i},{v},\n" for i, (_, v) in enumerate(volts)))
write("rigol-no-x.csv", f"CH1,Start,Increment,\nVolt,{start:e},{step:e}\n" + "".join(f"{v},\n" for _, v in volts))
write("rigol-inline.csv", f"CH1V,t0 ={start:e}, tInc = {step:e},\n" + "".join(f"{v},\n" for _, v in volts))
write("rigol-old.csv", "X,CH1\nSecond,Volt,\n" + "".join(f"{t},{v}, \n" for t, v in seconds))
write("rigol-old-names.csv", "Time,X(CH1),\nSecond,Volt,\n" + "".join(f"{t},{v},\n" for t, v in seconds))
ultrascope = '"Model Number","DS1102E"\n"Sampling Rate","2.000MSa"\n\n"Time (s)","Voltage (V)"\n'
write("rigol-ultrascope.csv", ultrascope + table(seconds))
siglent = f"Record Length,Analog:{N}\nSample Interval,CH1:{step:.7f}\nVertical Units,CH1:V,,,\nVertical Scale,CH1:0.50,,,\n"
siglent += "Horizontal Units,s\nHorizontal Scale,0.00001\nModel Number,SDS1104X-E\nSource,CH1\nSecond,Volt\n"
write("siglent.csv", siglent + "".join(f" {float(t):.5f},{v}\n" for t, v in seconds))
value = siglent.replace("Vertical Units,CH1:V,,,", "Vertical Units,CH1:V").replace("Second,Volt", "Second,Value")
write("siglent-value.csv", value + "".join(f"{float(t):.5f},{v}\n" for t, v in seconds))
blank = [(f"{start - k * step:.8e}", "") for k in (3, 2, 1)]
write("keysight-blank.csv", "x-axis,1\nsecond,Volt\n" + table(blank + seconds, ",", "\r\n"))
few = f"Model,MSO2024\nSample Interval,{step:e}\nRecord Length,{N}\nVertical Units,V\nHorizontal Units,S\n\nTIME,CH1\n"
write("tektronix-few-digits.csv", few + "".join(f"{float(t):.1e},{v}\n" for t, v in seconds))
write("rohde-schwarz-hmo.csv", "in s,CH1 in V\n" + "".join(f"{float(t):.2e},{v}\n" for t, v in seconds))
keys = [f"Record Length,{N}", f"Sample Interval,{step:e}", "Source,CH1", "Vertical Units,V", "Horizontal Units,s"]
two = [f"{key},,{t},0.5,,{key.replace('CH1', 'CH2')},,{t},{v},\n" for key, (t, v) in zip(keys + [","] * N, seconds)]
write("tektronix-two.csv", "".join(two))
hantek = "#timebase=80000000(ps)\n,#voltbase=2000000(uV)\n#size=100\n"
write("hantek.csv", hantek + table([(t, f"{1e3 * float(v):.1f}") for t, v in seconds]))
instek = f"Memory Length,{N},\nTrigger Level,0,\nSource,CH1,\nVertical Units,V,\nVertical Scale,5.0E-02,\nHorizontal Units,S,\n"
instek += f"Sampling Period,{step:.1E},\n"
write("gwinstek.csv", instek + "Mode,Detail,\nWaveform Data,\n" + "".join(f"{t},{v},\n" for t, v in seconds))
write("gwinstek-fast.csv", instek + "Mode,Fast,\nWaveform Data,\n" + "".join(f"{round(float(v) / 2e-3)},\n" for _, v in volts))
head = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\t{}\nTime_Pref\tRelative\n"
head += f"***End_of_Header***\t\n\nChannels\t1\nSamples\t{N}\nY_Unit_Label\tVolts\nX_Dimension\tTime\nX0\t{start:E}\n"
head += f"Delta_X\t{step:E}\n***End_of_Header***\t\t\nX_Value\tVoltage\tComment\n"
write("labview.lvm", head.format("No") + "".join(f"\t{v}\n" for _, v in volts))
write("labview-times.lvm", head.format("One") + "".join(f"{t}\t{v}\t\n" for t, v in seconds))
keys = ['"Header Size",16', '"Model Name","DL850"', '"TraceName","CH1   "', f'"BlockSize",{N}', '"VUnit","V    "']
keys += ['"SampleRate",2.0E+06', f'"HResolution",{step:E}', f'"HOffset",{start:E}', ""]
write("yokogawa.csv", "".join(f"{key}\n" for key in keys) + "".join(f"{v},\n" for _, v in volts))
write("rto.csv", f"SignalFormat:FLOAT:\nXStart:{start:e}:\nResolution:{step:e}:\nRecordLength:{N}:\n")
write("rto.Wfm.csv", "".join(f"{v}\n" for _, v in volts))
write("picoscope.csv", "Time,Channel A\n(us),(V)\n\n" + table(volts))
write("blanks.txt", "Time (s)   CH1 (V)\n" + "".join(f"  {t}   {v}\n" for t, v in seconds))
write("carriage-returns.csv", ("time_s,ch1 (V)\n" + table(seconds)).replace("\n", "\r"))
write("frames.csv", "v (V)\n" + "".join(f"#Frame,{k},of,2\n" + "".join(f"{v}\n" for _, v in volts) for k in (1, 2)))
