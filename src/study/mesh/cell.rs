//! One cell between eight centres: which of its crossed edges belong to one sheet of the surface.

/// From a centre one step along an axis.
pub(super) type Edge = ([i32; 3], usize);

/// The edges of a cell, by axis and by their place along the two others.
pub(super) const EDGES: usize = 12;

pub(super) fn step(mut point: [i32; 3], axis: usize, by: i32) -> [i32; 3] {
    point[axis] += by;
    point
}

/// The two axes after an axis, in a circle.
pub(super) fn others(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// The edges of the cell whose lowest corner this is.
pub(super) fn edges(cell: [i32; 3]) -> [Edge; EDGES] {
    std::array::from_fn(|k| {
        let [u, w] = others(k / 4);
        (step(step(cell, u, (k % 2) as i32), w, (k / 2 % 2) as i32), k / 4)
    })
}

/// The place of an edge in its cell.
pub(super) fn place(cell: [i32; 3], (from, axis): Edge) -> usize {
    let [u, w] = others(axis);
    4 * axis + (from[u] - cell[u]) as usize + 2 * (from[w] - cell[w]) as usize
}

/// Four centres in a plane across `axis`; `base` is the lowest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Face {
    pub base: [i32; 3],
    pub axis: usize,
}

impl Face {
    pub(super) fn edges(self) -> [Edge; 4] {
        let [u, w] = others(self.axis);
        [(self.base, u), (step(self.base, u, 1), w), (step(self.base, w, 1), u), (self.base, w)]
    }

    /// For each of its edges the one with which it bounds a piece of the surface's trace on the face. Corners that face
    /// each other are joined where the mean over the face lies on their side. The face alone decides, so that the cells on
    /// both sides agree.
    pub(super) fn partners(self, field: &impl Fn([i32; 3]) -> f64) -> [Option<usize>; 4] {
        let [u, w] = others(self.axis);
        let right = step(self.base, u, 1);
        let values = [self.base, right, step(right, w, 1), step(self.base, w, 1)].map(field);
        let inside = values.map(|value| value > 0.0);
        let crossed: Vec<usize> = (0..4).filter(|k| inside[*k] != inside[(k + 1) % 4]).collect();
        let mut partners = [None; 4];
        let mut join = |a: usize, b: usize| (partners[a], partners[b]) = (Some(b), Some(a));
        if let [a, b] = crossed[..] {
            join(a, b);
        } else if crossed.len() == 4 {
            let joined = values.iter().sum::<f64>() > 0.0;
            let cut = if inside[0] != joined { 0 } else { 1 };
            join(cut, (cut + 3) % 4);
            join(cut + 1, cut + 2);
        }
        partners
    }
}

/// The faces of a cell.
fn faces(cell: [i32; 3]) -> [Face; 6] {
    std::array::from_fn(|k| Face { base: step(cell, k / 2, (k % 2) as i32), axis: k / 2 })
}

/// For each edge of a cell the number of its sheet, counted from zero; `None` where the surface does not cross it.
pub(super) fn sheets(cell: [i32; 3], field: &impl Fn([i32; 3]) -> f64) -> [Option<usize>; EDGES] {
    let mut next: [Vec<usize>; EDGES] = Default::default();
    for face in faces(cell) {
        let edges = face.edges();
        for (k, partner) in face.partners(field).into_iter().enumerate() {
            next[place(cell, edges[k])].extend(partner.map(|partner| place(cell, edges[partner])));
        }
    }
    let mut sheets = [None; EDGES];
    let mut count = 0;
    for start in 0..EDGES {
        if next[start].is_empty() || sheets[start].is_some() {
            continue;
        }
        let mut open = vec![start];
        while let Some(edge) = open.pop() {
            if sheets[edge].replace(count).is_none() {
                open.extend(&next[edge]);
            }
        }
        count += 1;
    }
    sheets
}
