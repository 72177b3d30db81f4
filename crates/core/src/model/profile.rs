//! What varies along a segment: linear between nodes, constant beyond them. And the pieces that nodes cut a
//! segment into.

use super::Vector;

/// Three numbers along a segment, attached to its material.
#[derive(Clone, Debug, PartialEq)]
pub enum Profile {
    /// The same everywhere.
    Constant(Vector),
    /// In order of `at`, at least one.
    Nodes(Vec<Node>),
}

/// A value at a distance from the segment's proximal end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// In m
    pub at: f64,
    /// Curvature (1/m) or stiffness (N·m²) about body x, y, z.
    pub value: Vector,
}

/// A stretch of a segment on which every profile is linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Arc length of its proximal end in the segment, as it is inserted (m)
    pub start: f64,
    /// Arc length of its distal end (m)
    pub end: f64,
    /// Between which nodes it lies: a material coordinate inside, whatever is cut off (m)
    middle: f64,
    /// Material coordinate less arc length (m)
    offset: f64,
    /// A force that acts here, by its index: the piece then is rigid and has no length.
    pub force: Option<usize>,
}

impl Profile {
    /// Base to tip; none where it is constant.
    pub fn nodes(&self) -> &[Node] {
        match self {
            Profile::Constant(_) => &[],
            Profile::Nodes(nodes) => nodes,
        }
    }

    /// Values at the start of a piece, and what is added to them towards its end.
    pub fn on(&self, piece: &Piece) -> (Vector, Vector) {
        match self {
            Profile::Constant(value) => (*value, [0.0; 3]),
            Profile::Nodes(nodes) => {
                let mut value = [0.0; 3];
                let mut rise = [0.0; 3];
                // The nodes around the piece; others have no share in it.
                let after = |s: f64| nodes.partition_point(|node| node.at <= s + piece.offset);
                let (first, last) = (after(piece.start.min(piece.end)), after(piece.start.max(piece.end)));
                let near = first.saturating_sub(1)..nodes.len().min(last + 1);
                for (k, node) in near.clone().zip(&nodes[near]) {
                    let (share, share_rise) = self.share(k, piece);
                    for axis in 0..3 {
                        value[axis] += share * node.value[axis];
                        rise[axis] += share_rise * node.value[axis];
                    }
                }
                (value, rise)
            }
        }
    }

    /// Share of node `k` in the value at the start of a piece, and what is added to it towards the end.
    pub fn share(&self, k: usize, piece: &Piece) -> (f64, f64) {
        let start = self.share_at(k, piece.start + piece.offset);
        (start, self.share_at(k, piece.end + piece.offset) - start)
    }

    /// Share of node `k` in the value at a material coordinate.
    fn share_at(&self, k: usize, s: f64) -> f64 {
        let nodes = self.nodes();
        let after = nodes.partition_point(|node| node.at <= s);
        if after == 0 || after == nodes.len() {
            return f64::from(u8::from(k == after.min(nodes.len() - 1)));
        }
        let (from, to) = (nodes[after - 1].at, nodes[after].at);
        let share = (s - from) / (to - from);
        match k {
            _ if k == after => share,
            _ if k + 1 == after => 1.0 - share,
            _ => 0.0,
        }
    }

    /// The same along a shorter segment: nodes beyond its end give way to one there.
    pub fn up_to(&self, length: f64) -> Profile {
        let Profile::Nodes(nodes) = self else { return self.clone() };
        if nodes.last().is_none_or(|last| last.at <= length) {
            return self.clone();
        }
        let at_end =
            |axis: usize| nodes.iter().enumerate().map(|(k, node)| self.share_at(k, length) * node.value[axis]).sum();
        let mut kept: Vec<Node> = nodes.iter().copied().filter(|node| node.at < length).collect();
        kept.push(Node { at: length, value: [0, 1, 2].map(at_end) });
        Profile::Nodes(kept)
    }

    /// Whether the profile is not constant on a piece.
    pub fn varies_on(&self, piece: &Piece) -> bool {
        let nodes = self.nodes();
        let after = nodes.partition_point(|node| node.at <= piece.middle);
        after > 0 && after < nodes.len()
    }
}

impl Piece {
    /// The piece without length at its end that carries a load.
    pub(super) fn carrier(&self, load: usize) -> Piece {
        Piece { start: self.end, force: Some(load), ..*self }
    }
}

/// Cuts a segment of given length at the nodes of its profiles, always one piece more than there are positions, and at
/// forces, each of which is a piece of its own.
///
/// `forces` are indices and positions; `inserted` is the length of material, above the segment's own, that has been pushed in at its proximal end.
pub fn pieces(profiles: &[&Profile], forces: &[(usize, f64)], length: f64, inserted: f64) -> Vec<Piece> {
    let mut cuts: Vec<f64> = profiles.iter().flat_map(|profile| profile.nodes()).map(|node| node.at).collect();
    cuts.extend(forces.iter().map(|(_, at)| at));
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    let arc_length = |at: f64| (at + inserted).clamp(0.0, length.max(0.0));
    (0..=cuts.len())
        .flat_map(|k| {
            let before = k.checked_sub(1).map(|before| cuts[before]);
            let after = cuts.get(k).copied();
            let middle = match (before, after) {
                (Some(before), Some(after)) => 0.5 * (before + after),
                (None, Some(after)) => after - 1.0,
                (Some(before), None) => before + 1.0,
                (None, None) => 0.0,
            };
            let start = before.map_or(0.0, arc_length);
            let piece = Piece { start, end: after.map_or(length, arc_length), middle, offset: -inserted, force: None };
            let here = forces.iter().filter(move |(_, at)| Some(*at) == after);
            let forces = here.map(move |(index, _)| piece.carrier(*index));
            std::iter::once(piece).chain(forces)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear() -> Profile {
        let node = |at: f64, x: f64| Node { at, value: [x, 0.0, 1.0] };
        Profile::Nodes(vec![node(0.02, 1.0), node(0.06, 5.0), node(0.08, 3.0)])
    }

    fn value(profile: &Profile, length: f64, inserted: f64, s: f64) -> f64 {
        let pieces = pieces(&[profile], &[], length, inserted);
        let piece = pieces.iter().find(|piece| piece.start <= s && s <= piece.end).expect("a piece");
        let (start, rise) = profile.on(piece);
        start[0] + rise[0] * (s - piece.start) / (piece.end - piece.start)
    }

    #[test]
    fn is_linear_between_nodes_and_constant_beyond() {
        let profile = linear();
        for (s, expected) in [(0.01, 1.0), (0.04, 3.0), (0.05, 4.0), (0.07, 4.0), (0.09, 3.0)] {
            assert!((value(&profile, 0.1, 0.0, s) - expected).abs() < 1e-12, "{s}");
        }
    }

    #[test]
    fn is_cut_at_the_end_of_a_shorter_segment() {
        let profile = linear();
        assert_eq!(profile.up_to(0.08), profile);
        for length in [0.01, 0.02, 0.05, 0.06, 0.07] {
            let cut = profile.up_to(length);
            assert!(cut.nodes().iter().all(|node| node.at <= length), "{cut:?}");
            for share in [0.0, 0.3, 0.99, 1.0] {
                let s = share * length;
                assert!((value(&cut, length, 0.0, s) - value(&profile, length, 0.0, s)).abs() < 1e-12, "{length} {s}");
            }
        }
    }

    #[test]
    fn moves_with_the_material() {
        let profile = linear();
        for inserted in [-0.05, -0.03, 0.0, 0.02] {
            for s in [0.001, 0.013, 0.021, 0.038, 0.048] {
                let (there, here) = (value(&profile, 0.1 + inserted, inserted, s), value(&profile, 0.1, 0.0, 0.05));
                assert!(here > 0.0);
                let material = s - inserted;
                if (0.001..0.099).contains(&material) {
                    assert!((there - value(&profile, 0.1, 0.0, material)).abs() < 1e-12, "{inserted} {s}");
                }
            }
        }
    }

    #[test]
    fn pieces_cover_the_segment() {
        let profile = linear();
        for (length, inserted) in [(0.1, 0.0), (0.07, 0.0), (0.05, -0.05), (0.01, 0.0), (0.15, 0.05)] {
            let pieces = pieces(&[&profile, &Profile::Constant([0.0; 3])], &[], length, inserted);
            assert_eq!(pieces.len(), 4);
            assert_eq!((pieces[0].start, pieces[3].end), (0.0, length));
            assert!(pieces.windows(2).all(|pair| pair[0].end == pair[1].start));
        }
    }
}
