//! Rectangular sections as Gmsh files: bodies that no other mesher of the program makes.

use std::{
    fmt::Write as _,
    fs, io,
    path::{Path, PathBuf},
};

/// A side of the rectangle, or the part of it up to a coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Side {
    /// z least, r up to here (m).
    Bottom(f64),
    Top,
    /// r least, z up to here (m).
    Inner(f64),
}

/// A rectangle of 8-node quadrilaterals, with named boundaries.
pub(super) struct Rectangle<'a> {
    /// Corners of the elements in r, ascending, m.
    pub r: Vec<f64>,
    /// In z, ascending, m.
    pub z: Vec<f64>,
    pub boundaries: &'a [(&'a str, &'a [Side])],
}

impl Rectangle<'_> {
    /// Write `NAME.msh` (Gmsh 4.1, text) into a folder.
    pub fn write(&self, folder: &Path, name: &str) -> io::Result<PathBuf> {
        let path = folder.join(format!("{name}.msh"));
        fs::write(&path, self.text())?;
        Ok(path)
    }

    /// Number of the node at half-steps i of r and j of z, from 1; the middles of elements have numbers but are no nodes.
    fn node(&self, i: usize, j: usize) -> usize {
        j * (2 * self.r.len() - 1) + i + 1
    }

    fn text(&self) -> String {
        let half = |corners: &[f64], i: usize| 0.5 * (corners[i / 2] + corners[i.div_ceil(2)]);
        let (columns, rows) = (2 * self.r.len() - 1, 2 * self.z.len() - 1);
        let edges: Vec<Vec<[usize; 3]>> = self.boundaries.iter().map(|(_, sides)| self.edges(sides)).collect();
        // Writing to a string cannot fail.
        let mut text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n".to_owned();
        let count = self.boundaries.len();
        let _ = writeln!(text, "$PhysicalNames\n{count}");
        for (tag, (name, _)) in self.boundaries.iter().enumerate() {
            let _ = writeln!(text, "1 {} \"{name}\"", tag + 1);
        }
        let _ = writeln!(text, "$EndPhysicalNames\n$Entities\n0 {count} 1 0");
        for tag in 1..=count {
            let _ = writeln!(text, "{tag} 0 0 0 1 1 0 1 {tag} 0");
        }
        let _ = writeln!(text, "1 0 0 0 1 1 0 0 0\n$EndEntities");
        let nodes: Vec<(usize, f64, f64)> = (0..rows)
            .flat_map(|j| (0..columns).map(move |i| (i, j)))
            .filter(|(i, j)| i % 2 == 0 || j % 2 == 0)
            .map(|(i, j)| (self.node(i, j), half(&self.r, i), half(&self.z, j)))
            .collect();
        let _ = writeln!(text, "$Nodes\n1 {0} 1 {1}\n2 1 0 {0}", nodes.len(), columns * rows);
        for (number, ..) in &nodes {
            let _ = writeln!(text, "{number}");
        }
        for (_, r, z) in &nodes {
            let _ = writeln!(text, "{r:e} {z:e} 0");
        }
        let squares = (self.r.len() - 1) * (self.z.len() - 1);
        let all = squares + edges.iter().map(Vec::len).sum::<usize>();
        let _ = writeln!(text, "$EndNodes\n$Elements\n{} {all} 1 {all}", count + 1);
        let mut number = 0;
        let mut element = |text: &mut String, nodes: &[usize]| {
            number += 1;
            let _ = write!(text, "{number}");
            for node in nodes {
                let _ = write!(text, " {node}");
            }
            text.push('\n');
        };
        for (tag, edges) in edges.iter().enumerate() {
            let _ = writeln!(text, "1 {} 8 {}", tag + 1, edges.len());
            edges.iter().for_each(|edge| element(&mut text, edge));
        }
        let _ = writeln!(text, "2 1 16 {squares}");
        for j in (0..rows - 1).step_by(2) {
            for i in (0..columns - 1).step_by(2) {
                let at = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)];
                element(&mut text, &at.map(|(a, b)| self.node(i + a, j + b)));
            }
        }
        text + "$EndElements\n"
    }

    /// Edges of quadratic lines: ends, then the middle.
    fn edges(&self, sides: &[Side]) -> Vec<[usize; 3]> {
        let (top, slack) = (2 * (self.z.len() - 1), 1e-12);
        let along_r = |j: usize, to: f64| -> Vec<[usize; 3]> {
            let inside = (1..self.r.len()).filter(|k| self.r[*k] <= to + slack);
            inside.map(|k| [self.node(2 * k - 2, j), self.node(2 * k, j), self.node(2 * k - 1, j)]).collect()
        };
        let edges = sides.iter().flat_map(|side| match *side {
            Side::Bottom(to) => along_r(0, to),
            Side::Top => along_r(top, f64::INFINITY),
            Side::Inner(to) => {
                let inside = (1..self.z.len()).filter(|k| self.z[*k] <= to + slack);
                inside.map(|k| [self.node(0, 2 * k - 2), self.node(0, 2 * k), self.node(0, 2 * k - 1)]).collect()
            }
        });
        edges.collect()
    }
}

/// Coordinates that start with steps of `first` and grow by `growth` up to `coarsest` (m) until `length` is reached exactly.
pub(super) fn graded(length: f64, first: f64, growth: f64, coarsest: f64) -> Vec<f64> {
    let mut at = vec![0.0];
    let mut step = first;
    while at[at.len() - 1] < length {
        at.push(at[at.len() - 1] + step);
        step = (step * growth).min(coarsest);
    }
    let stretch = length / at[at.len() - 1];
    at.iter().map(|place| place * stretch).collect()
}
