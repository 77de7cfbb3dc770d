"""SciPy's LSODA on the rigid scene: six steel beads between rigid flats, five cycles of 73 kHz, 1 um, 120 us.

The right-hand side is compiled by numba. Output: displacement and velocity of every bead on a grid of 0.1 us. The time is the
least of several calls of `scipy.integrate.odeint` (LSODA driven from C, the faster of SciPy's two interfaces to it) after a
warm-up that pays for the compilation. The error is the largest difference of any bead's velocity from a reference, over the
reference's largest velocity; the reference is LSODA's own peer, SciPy's DOP853 at rtol 1e-13, unless a file with one is given.

Usage: python3 lsoda_chain.py [--rtol 1e-8] [--repeat 7] [--reference FILE] [--no-reference]
Prints one JSON object.
"""

import argparse
import json
import math
import sys
import time

try:
    import numba
    import numpy as np
    import scipy
    from scipy.integrate import odeint, solve_ivp
except ImportError as error:
    sys.exit(f"lsoda_chain.py needs numpy, scipy and numba: {error}")

BEADS = 6
RADIUS = 0.5e-3
MODULUS = 201e9 / (1.0 - 0.3**2)
MASS = 4.0 / 3.0 * math.pi * RADIUS**3 * 7833.0
K_BEAD = 4.0 / 3.0 * (MODULUS / 2.0) * math.sqrt(RADIUS / 2.0) / MASS
K_FLAT = 4.0 / 3.0 * MODULUS * math.sqrt(RADIUS) / MASS
OMEGA = 2.0 * math.pi * 73e3
BURST = 5.0 / 73e3
AMPLITUDE = 1e-6


@numba.njit(fastmath=True)
def rate(t, y, dy):
    """dy = [velocities, accelerations] for y = [displacements, velocities]."""
    piston = AMPLITUDE * math.sin(OMEGA * t) if t < BURST else 0.0
    overlap = piston - y[0]
    before = K_FLAT * overlap * math.sqrt(overlap) if overlap > 0.0 else 0.0
    for i in range(BEADS):
        if i + 1 < BEADS:
            overlap = y[i] - y[i + 1]
            stiffness = K_BEAD
        else:
            overlap = y[i]
            stiffness = K_FLAT
        after = stiffness * overlap * math.sqrt(overlap) if overlap > 0.0 else 0.0
        dy[i] = y[BEADS + i]
        dy[BEADS + i] = before - after
        before = after


@numba.njit("float64[::1](float64, float64[::1])")
def right_hand_side(t, y):
    dy = np.empty(2 * BEADS)
    rate(t, y, dy)
    return dy


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rtol", type=float, default=1e-8)
    parser.add_argument("--atol", type=float, default=None, help="default: SciPy's own, 1.49e-8")
    parser.add_argument("--repeat", type=int, default=7)
    parser.add_argument("--reference", help="CSV: one line an instant, one column a bead's velocity, m/s")
    parser.add_argument("--no-reference", action="store_true", help="time only")
    arguments = parser.parse_args()

    times = np.arange(1201) * 1e-7
    start = np.zeros(2 * BEADS)
    options = {"tfirst": True, "rtol": arguments.rtol, "mxstep": 100000}
    if arguments.atol is not None:
        options["atol"] = arguments.atol

    def run():
        return odeint(right_hand_side, start, times, full_output=True, **options)

    run()
    elapsed = []
    for _ in range(arguments.repeat):
        begin = time.perf_counter()
        states, info = run()
        elapsed.append(time.perf_counter() - begin)
    result = {
        "seconds": min(elapsed),
        "median_seconds": sorted(elapsed)[len(elapsed) // 2],
        "rtol": arguments.rtol,
        "steps": int(info["nst"][-1]),
        "evaluations": int(info["nfe"][-1]),
        "scipy": scipy.__version__,
        "numba": numba.__version__,
    }
    if not arguments.no_reference:
        if arguments.reference:
            reference = np.loadtxt(arguments.reference, delimiter=",")
        else:
            reference = exact(start, times)
        error = np.abs(states[:, BEADS:] - reference)
        result["error"] = float(error.max() / np.abs(reference).max())
        result["error_last_bead"] = float(error[:, -1].max() / np.abs(reference[:, -1]).max())
    print(json.dumps(result))


def exact(start, times):
    """Velocities by DOP853 at a tight tolerance, restarted at the end of the burst."""
    before, after = times[times <= BURST], times[times > BURST]
    options = {"method": "DOP853", "rtol": 3e-14, "atol": 1e-16}
    first = solve_ivp(right_hand_side, (0.0, BURST), start, t_eval=np.append(before, BURST), **options)
    second = solve_ivp(right_hand_side, (BURST, times[-1]), first.y[:, -1], t_eval=after, **options)
    return np.hstack([first.y[BEADS:, :-1], second.y[BEADS:, :]]).T


if __name__ == "__main__":
    main()
