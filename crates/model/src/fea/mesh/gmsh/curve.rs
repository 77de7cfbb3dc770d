//! Line elements as boundaries: on the surface, in one piece, from one end to the other.

use std::collections::{BTreeMap, HashMap};

use super::{GmshError, Mesh};

pub(super) struct Line {
    pub number: u64,
    pub nodes: [u32; 3],
}

/// The sides of all elements: (smaller corner, larger corner) → middle, and how many elements have it.
pub(super) struct Sides(HashMap<(u32, u32), (u32, usize)>);

impl Sides {
    pub(crate) fn of(mesh: &Mesh) -> Self {
        let mut sides = HashMap::new();
        for element in &mesh.elements {
            let (nodes, corners) = (element.nodes(), element.shape.corners());
            for i in 0..corners {
                let (a, b) = (nodes[i], nodes[(i + 1) % corners]);
                sides.entry((a.min(b), a.max(b))).or_insert((nodes[corners + i], 0)).1 += 1;
            }
        }
        Self(sides)
    }

    fn count(&self, [a, middle, b]: [u32; 3]) -> usize {
        match self.0.get(&(a.min(b), a.max(b))) {
            Some((found, count)) if *found == middle => *count,
            _ => 0,
        }
    }
}

/// The nodes of a boundary from its end at smaller r, then smaller z, to the other.
pub(super) fn in_order(mesh: &Mesh, name: &str, lines: &[Line], sides: &Sides) -> Result<Vec<u32>, GmshError> {
    let place = |node: u32| mesh.nodes[node as usize];
    let boundary = || name.to_owned();
    let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (index, line) in lines.iter().enumerate() {
        let [a, _, b] = line.nodes;
        let count = sides.count(line.nodes);
        if count != 1 {
            let [r, z] = place(a);
            return Err(GmshError::NotOnSurface { boundary: boundary(), element: line.number, r, z, sides: count });
        }
        at.entry(a).or_default().push(index);
        at.entry(b).or_default().push(index);
    }
    let refuse = |node: u32, found| {
        let [r, z] = place(node);
        Err(GmshError::NotOneCurve { boundary: boundary(), r, z, found })
    };
    if let Some((node, _)) = at.iter().find(|(_, lines)| lines.len() > 2) {
        return refuse(*node, "a branch");
    }
    let ends = at.iter().filter(|(_, lines)| lines.len() == 1).map(|(node, _)| *node);
    let before = |a: &u32, b: &u32| {
        let ([r0, z0], [r1, z1]) = (place(*a), place(*b));
        r0.total_cmp(&r1).then(z0.total_cmp(&z1))
    };
    let Some(start) = ends.min_by(before) else {
        return refuse(lines[0].nodes[0], "a closed curve");
    };
    let mut nodes = vec![start];
    let (mut here, mut last) = (start, usize::MAX);
    while let Some(index) = at[&here].iter().copied().find(|index| *index != last) {
        let [a, middle, b] = lines[index].nodes;
        here = if a == here { b } else { a };
        nodes.extend([middle, here]);
        last = index;
    }
    if nodes.len() != 2 * lines.len() + 1 {
        let left = lines.iter().flat_map(|line| line.nodes).find(|node| !nodes.contains(node));
        return refuse(left.unwrap_or(start), "several pieces");
    }
    Ok(nodes)
}
