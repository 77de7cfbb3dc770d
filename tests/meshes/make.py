"""Makes the Gmsh files of tests/model/fea_gmsh.rs: python3 make.py, with gmsh 4.15 (pip install gmsh).

Sections lie in x = r, y = z; lengths in mm. The files ending in -binary are binary, the others text.
"""

import gmsh


def bead(quadrilaterals):
    """Half disc of radius 0.5 mm whose poles' patches are named."""
    geo = gmsh.model.geo
    points = [geo.addPoint(*p, 0.0) for p in [(0, 0), (0, -0.5), (0.3, -0.4), (0.3, 0.4), (0, 0.5)]]
    centre, south, low, high, north = points
    front = geo.addCircleArc(south, centre, low)
    side = geo.addCircleArc(low, centre, high)
    back = geo.addCircleArc(high, centre, north)
    axis = geo.addLine(north, south)
    surface = geo.addPlaneSurface([geo.addCurveLoop([front, side, back, axis])])
    geo.synchronize()
    gmsh.model.addPhysicalGroup(1, [front], name="front")
    gmsh.model.addPhysicalGroup(1, [back], name="back")
    gmsh.model.addPhysicalGroup(2, [surface], name="chrome-steel")
    if quadrilaterals:
        gmsh.model.mesh.setRecombine(2, surface)


def fine_bead():
    """The same fine enough at its poles to be pressed: 4 um there, growing away from them."""
    geo, mesh = gmsh.model.geo, gmsh.model.mesh
    patch = 0.05
    height = (0.25 - patch**2) ** 0.5
    places = [(0, 0), (0, -0.5), (patch, -height), (0.5, 0), (patch, height), (0, 0.5)]
    centre, south, low, equator, high, north = [geo.addPoint(*p, 0.0) for p in places]
    front = geo.addCircleArc(south, centre, low)
    side = [geo.addCircleArc(low, centre, equator), geo.addCircleArc(equator, centre, high)]
    back = geo.addCircleArc(high, centre, north)
    axis = [geo.addLine(north, centre), geo.addLine(centre, south)]
    surface = geo.addPlaneSurface([geo.addCurveLoop([front, *side, back, *axis])])
    geo.synchronize()
    gmsh.model.addPhysicalGroup(1, [front], name="front")
    gmsh.model.addPhysicalGroup(1, side, name="side")
    gmsh.model.addPhysicalGroup(1, [back], name="back")
    gmsh.model.addPhysicalGroup(2, [surface], name="chrome-steel")
    distance = mesh.field.add("Distance")
    mesh.field.setNumbers(distance, "PointsList", [south, north])
    size = mesh.field.add("MathEval")
    mesh.field.setString(size, "F", f"0.004 + 0.25 * Max(F{distance} - 0.03, 0)")
    mesh.field.setAsBackgroundMesh(size)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)


def ring(name_contact=True, ring_radius=0.55):
    """Half disc of radius 0.25 mm, its flat side clamped, of two materials."""
    geo = gmsh.model.geo
    r = ring_radius
    places = [(r, 0), (r, -0.25), (r - 0.25, 0), (r, 0.25)]
    centre, south, inner, north = [geo.addPoint(*p, 0.0) for p in places]
    lower = geo.addCircleArc(south, centre, inner)
    upper = geo.addCircleArc(inner, centre, north)
    flat_upper = geo.addLine(north, centre)
    flat_lower = geo.addLine(centre, south)
    between = geo.addLine(inner, centre)
    first = geo.addPlaneSurface([geo.addCurveLoop([lower, between, flat_lower])])
    second = geo.addPlaneSurface([geo.addCurveLoop([upper, flat_upper, -between])])
    geo.synchronize()
    gmsh.model.addPhysicalGroup(1, [lower], name="contact" if name_contact else "")
    gmsh.model.addPhysicalGroup(1, [flat_lower, flat_upper], name="clamped")
    gmsh.model.addPhysicalGroup(2, [first], name="resin")
    gmsh.model.addPhysicalGroup(2, [second], name="chrome-steel")


def twice():
    """Two squares, one over the other, as two surfaces of one file."""
    geo = gmsh.model.geo
    for low in [0.0, 0.03]:
        corners = [(0, low), (0.1, low), (0.1, low + 0.1), (0, low + 0.1)]
        points = [geo.addPoint(*p, 0.0) for p in corners]
        lines = [geo.addLine(points[i], points[(i + 1) % 4]) for i in range(4)]
        surface = geo.addPlaneSurface([geo.addCurveLoop(lines)])
        geo.synchronize()
        gmsh.model.addPhysicalGroup(2, [surface], name="resin")
        gmsh.model.addPhysicalGroup(1, [lines[0]], name="front" if low == 0.0 else "back")


def write(name, build, size, binary=False, order=2, incomplete=True, version=4.1):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    if size is not None:
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.ElementOrder", order)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1 if incomplete else 0)
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", 1 if binary else 0)
    build()
    gmsh.model.mesh.generate(2)
    gmsh.write(name + ".msh")
    gmsh.finalize()


if __name__ == "__main__":
    write("bead-triangles", lambda: bead(False), 0.12)
    write("bead-quadrilaterals-binary", lambda: bead(True), 0.12, binary=True)
    write("bead-fine-binary", fine_bead, None, binary=True)
    write("ring", ring, 0.08)
    write("ring-linear", ring, 0.15, order=1)
    write("ring-unnamed", lambda: ring(name_contact=False), 0.15)
    write("ring-beyond-axis", lambda: ring(ring_radius=0.2), 0.15)
    write("bead-nine-nodes", lambda: bead(True), 0.25, incomplete=False)
    write("overlap", twice, 0.06)
    write("bead-version-2", lambda: bead(False), 0.3, version=2.2)
