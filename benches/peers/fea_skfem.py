"""The rigid scene by scikit-fem and SciPy: the same finite element analysis, factored once.

Needs python3 with numpy, scipy and scikit-fem (`pip install numpy scipy scikit-fem`). Alone:

    cargo bench --bench fea -- mesh bead.json 10     # writes our mesh of density 10
    OMP_NUM_THREADS=1 python3 benches/peers/fea_skfem.py --mesh bead.json

Six equal steel beads between rigid frictionless flats, just touching; the piston moves as five cycles of a sine. Axisymmetric 8-node
quadrilaterals, trapezoid, massless contact nodes, gaps from the sphere's profile, contact forces at all surface nodes of the pole patches
from the compliances condensed on them. One sparse LU of M + h²/4 K (SuperLU, symmetric mode), then per step one product with M, one solve of
all beads' right-hand sides together, one active set over all contacts at once, started from the last step's. The answer to the contact
forces is a product with columns solved for beforehand, so there is no second solve.

Prints one JSON object: CPU seconds of this process by stage, unknowns, non-zeros of the factor; the last bead's velocity goes to `--out`.
"""

import argparse
import json
import time

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree
from skfem import Basis, BilinearForm, ElementQuadS2, ElementVector, MeshQuad2

YOUNG, POISSON, DENSITY = 201e9, 0.3, 7833.0
AMPLITUDE, FREQUENCY, CYCLES = 1e-6, 73e3, 5
BEADS = 6
LAME = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
SHEAR = YOUNG / (2 * (1 + POISSON))


@BilinearForm
def stiffness(u, v, w):
    r = w.x[0]
    rr, zz, tt = u.grad[0, 0], u.grad[1, 1], u[0] / r
    rz = u.grad[0, 1] + u.grad[1, 0]
    vrr, vzz, vtt = v.grad[0, 0], v.grad[1, 1], v[0] / r
    vrz = v.grad[0, 1] + v.grad[1, 0]
    trace = rr + zz + tt
    energy = LAME * trace * (vrr + vzz + vtt) + 2 * SHEAR * (rr * vrr + zz * vzz + tt * vtt) + SHEAR * rz * vrz
    return energy * 2 * np.pi * r


@BilinearForm
def mass(u, v, w):
    return DENSITY * (u[0] * v[0] + u[1] * v[1]) * 2 * np.pi * w.x[0]


def piston(t):
    """Displacement of the piston, m; at rest after its cycles."""
    return AMPLITUDE * np.sin(2 * np.pi * FREQUENCY * t) if t < CYCLES / FREQUENCY else 0.0


def without_mass(basis, bare):
    """Consistent mass with the rows and columns of `bare` unknowns taken out of each element and the rest scaled to the element's mass."""
    local = mass.elemental(basis).tolocal()
    dofs = basis.element_dofs.T
    axial = np.isin(np.arange(dofs.shape[1]) % 2, [1])
    for element in np.flatnonzero(np.isin(dofs, bare).any(axis=1)):
        matrix = local[element]
        whole = matrix[np.ix_(axial, axial)].sum()
        free = ~np.isin(dofs[element], bare)
        matrix[~free, :] = 0
        matrix[:, ~free] = 0
        matrix *= whole / matrix[np.ix_(axial, axial)].sum()
    n = basis.N
    rows = np.repeat(dofs, dofs.shape[1], axis=1).ravel()
    columns = np.tile(dofs, (1, dofs.shape[1])).ravel()
    return sparse.csr_matrix((local.ravel(), (rows, columns)), shape=(n, n))


class Contacts:
    """All contacts of the row at once: g = q + W f, f >= 0, g >= 0, f g = 0."""

    def __init__(self, front, back, cross):
        # front, back: compliance of one bead's faces, outward normal displacement per pressing force; cross: between its two faces.
        n = len(front)
        self.size = (BEADS + 1) * n
        self.matrix = np.zeros((self.size, self.size))
        block = lambda i, j: (slice(i * n, (i + 1) * n), slice(j * n, (j + 1) * n))
        for bead in range(BEADS):
            before, after = bead, bead + 1
            self.matrix[block(before, before)] += front
            self.matrix[block(after, after)] += back
            self.matrix[block(after, before)] += cross
            self.matrix[block(before, after)] += cross.T
        self.forces = np.zeros(self.size)
        self.active = np.zeros(self.size, dtype=bool)
        self.sets = 0

    def solve(self, q):
        active = self.active
        for _ in range(100):
            self.sets += 1
            forces = np.zeros(self.size)
            index = np.flatnonzero(active)
            if len(index):
                forces[index] = np.linalg.solve(self.matrix[np.ix_(index, index)], -q[index])
                gaps = q + self.matrix[:, index] @ forces[index]
            else:
                gaps = q
            changed = np.where(active, forces > 0, gaps < -1e-18)
            if (changed == active).all():
                self.active, self.forces = active, forces
                return forces
            active = changed
        raise RuntimeError("no active set")


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--mesh", required=True, help="JSON of the bead: nodes, quadrilaterals, front, back")
    arguments.add_argument("--step", type=float, default=1e-7)
    arguments.add_argument("--duration", type=float, default=120e-6)
    arguments.add_argument("--out", help="file for the last bead's velocity, one value a line, m/s")
    given = arguments.parse_args()
    clock = [time.process_time()]

    def lap():
        clock.append(time.process_time())
        return clock[-1] - clock[-2]

    with open(given.mesh) as file:
        form = json.load(file)
    nodes = np.array(form["nodes"])
    quads = np.array(form["quadrilaterals"])
    # scikit-fem's isoparametric mesh has a ninth node: where the eight put the middle of the element.
    middle = 0.5 * nodes[quads[:, 4:]].sum(axis=1) - 0.25 * nodes[quads[:, :4]].sum(axis=1)
    points = np.vstack([nodes, middle])
    t = np.hstack([quads, len(nodes) + np.arange(len(quads))[:, None]]).T
    mesh = MeshQuad2(points.T, t)
    basis = Basis(mesh, ElementVector(ElementQuadS2()), intorder=5)
    tree = cKDTree(basis.doflocs[:, 0::2].T)
    dof = lambda places: 2 * tree.query(places)[1]
    assert (basis.doflocs[:, 0::2] == basis.doflocs[:, 1::2]).all()
    # The poles themselves carry no force: their tributary area is zero.
    front = dof(nodes[form["front"][1:]]) + 1
    back = dof(nodes[form["back"][1:]]) + 1
    bare = np.concatenate([dof(nodes[form[name]]) + k for name in ("front", "back") for k in (0, 1)])
    k = stiffness.assemble(basis).tocsr()
    m = without_mass(basis, bare)
    free = np.ones(basis.N, dtype=bool)
    free[0::2][basis.doflocs[0, 0::2] == 0.0] = False
    kept = np.flatnonzero(free)
    place = np.cumsum(free) - 1
    k, m = k[kept][:, kept], m[kept][:, kept]
    front, back = place[front], place[back]
    seconds = {"assembly": lap()}

    h = given.step
    gain = 0.25 * h * h
    factor = splu((m + gain * k).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    seconds["factorisation"] = lap()
    n = len(front)
    push = np.zeros((len(kept), 2 * n))
    push[front, np.arange(n)] = 1.0  # a pressing force at the front pushes along +z
    push[back, n + np.arange(n)] = -1.0
    answer = gain * factor.solve(push)
    # Outward normals: -z at the front, +z at the back; the gap opens by minus the outward displacement.
    contacts = Contacts(answer[front][:, :n], -answer[back][:, n:], -answer[back][:, :n])
    radius = nodes[form["front"][1:], 0]
    a = abs(nodes[form["back"][0], 1])
    depth = a - np.sqrt(a * a - radius * radius)
    rest = np.concatenate([depth] + [2 * depth] * (BEADS - 1) + [depth])
    seconds["condensation"] = lap()

    centre = place[dof(np.array([[0.0, 0.0]]))[0] + 1]
    u, v, acceleration = (np.zeros((len(kept), BEADS)) for _ in range(3))
    steps = round(given.duration / h)
    velocity = np.zeros(steps + 1)
    loads = np.zeros((2 * n, BEADS))
    for step in range(1, steps + 1):
        predicted = u + h * v + gain * acceleration
        u = factor.solve(m @ predicted)
        q = rest.copy()
        q[:n] -= piston(step * h)
        q[: BEADS * n] += u[front].T.ravel()
        q[n:] -= u[back].T.ravel()
        if q.min() < 0.0 or contacts.active.any():
            forces = contacts.solve(q).reshape(BEADS + 1, n)
            loads[:n], loads[n:] = forces[:-1].T, forces[1:].T
            u += answer @ loads
        new = (u - predicted) / gain
        v += 0.5 * h * (acceleration + new)
        acceleration = new
        velocity[step] = v[centre, -1]
    seconds["steps"] = lap()
    seconds["all"] = sum(seconds.values())
    if given.out:
        np.savetxt(given.out, velocity, fmt="%.17e")
    print(
        json.dumps(
            {
                "seconds": seconds,
                "unknowns": BEADS * len(kept),
                "factor_nonzeros": int(factor.L.nnz),
                "steps": steps,
                "active_sets": contacts.sets,
                "peak_m_per_s": float(np.abs(velocity).max()),
            }
        )
    )


if __name__ == "__main__":
    main()
