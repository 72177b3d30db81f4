//! Surface nets over sparse voxels: a vertex in each cell that the surface crosses, at the mean of the crossings.
//!
//! A cell through which several sheets pass has a vertex for each, so that every edge has two triangles. Two sheets that
//! would share an edge get one each, over a vertex of its own.

use super::Mesh;
use super::cell::{EDGES, Edge, Face, edges, others, place, sheets, step};
use crate::model::Vector;
use crate::table::Lattice;
use std::collections::HashMap;

/// Crossings stay away from centres by this share of a voxel, so that triangles have an area.
const LEAST_SHARE: f64 = 0.02;
/// Voxels further than this from the origin do not count.
const FURTHEST: u32 = 1 << 30;

/// The surface on which a signed distance (m), known at the centres of voxels, is zero.
///
/// Inside it is positive. A voxel without a distance, or with one that is not finite, lies outside by half a voxel. Voxels
/// inside that only share an edge or a corner are joined where the mean over the four centres between them is positive.
pub fn surface_nets(distance: &HashMap<[i32; 3], f64>, lattice: &Lattice) -> Mesh {
    Nets { distance, lattice, mesh: Mesh::default(), cells: HashMap::new(), middles: HashMap::new() }.draw()
}

struct Nets<'a> {
    distance: &'a HashMap<[i32; 3], f64>,
    lattice: &'a Lattice,
    mesh: Mesh,
    /// The vertex on each edge of a cell.
    cells: HashMap<[i32; 3], [u32; EDGES]>,
    /// Vertices on faces: of the piece that ends at these two edges of the face.
    middles: HashMap<(Face, usize), u32>,
}

impl Nets<'_> {
    fn draw(mut self) -> Mesh {
        let near = |voxel: &[i32; 3]| voxel.iter().all(|index| index.unsigned_abs() < FURTHEST);
        let mut inside: Vec<[i32; 3]> =
            self.distance.keys().copied().filter(|voxel| near(voxel) && self.field(*voxel) > 0.0).collect();
        inside.sort_unstable();
        let mut crossings: Vec<(Edge, bool)> = Vec::new();
        for voxel in inside {
            for axis in 0..3 {
                for side in [-1, 1] {
                    let outside = step(voxel, axis, side);
                    if self.field(outside) <= 0.0 {
                        crossings.push(((if side < 0 { outside } else { voxel }, axis), side > 0));
                    }
                }
            }
        }
        for (edge, _) in &crossings {
            around(*edge).into_iter().for_each(|cell| self.add_vertices(cell));
        }
        for (edge, rises) in crossings {
            self.add_triangles(edge, rises);
        }
        self.mesh
    }

    fn field(&self, voxel: [i32; 3]) -> f64 {
        let known = self.distance.get(&voxel).copied().filter(|distance| distance.is_finite());
        known.unwrap_or(-0.5 * self.lattice.spacing)
    }

    /// Where the surface crosses an edge, counted in voxels from a centre.
    fn crossing(&self, (from, axis): Edge) -> Vector {
        let (a, b) = (self.field(from), self.field(step(from, axis, 1)));
        let mut at = from.map(f64::from);
        at[axis] += (a / (a - b)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        at
    }

    fn add_vertex(&mut self, at: Vector, voxel: [i32; 3]) -> u32 {
        self.mesh.vertices.push(self.lattice.place(at));
        self.mesh.voxels.push(voxel);
        (self.mesh.vertices.len() - 1) as u32
    }

    fn add_vertices(&mut self, cell: [i32; 3]) {
        if self.cells.contains_key(&cell) {
            return;
        }
        let sheets = sheets(cell, &|voxel| self.field(voxel));
        let edges = edges(cell);
        let mut vertices = [u32::MAX; EDGES];
        for sheet in 0..sheets.iter().flatten().max().map_or(0, |last| last + 1) {
            let here: Vec<usize> = (0..EDGES).filter(|edge| sheets[*edge] == Some(sheet)).collect();
            let vertex = self.add_mean(&here.iter().map(|edge| edges[*edge]).collect::<Vec<Edge>>());
            here.into_iter().for_each(|edge| vertices[edge] = vertex);
        }
        self.cells.insert(cell, vertices);
    }

    /// A vertex at the mean of the crossings of some edges.
    fn add_mean(&mut self, edges: &[Edge]) -> u32 {
        let mut at = [0.0; 3];
        for edge in edges {
            let crossing = self.crossing(*edge);
            (0..3).for_each(|k| at[k] += crossing[k] / edges.len() as f64);
        }
        let ends = edges.iter().flat_map(|(from, axis)| [*from, step(*from, *axis, 1)]);
        let away = |voxel: &[i32; 3]| (0..3).map(|k| (f64::from(voxel[k]) - at[k]).powi(2)).sum::<f64>();
        let inside = ends.filter(|voxel| self.field(*voxel) > 0.0);
        let nearest = inside.min_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b)));
        self.add_vertex(at, nearest.unwrap_or_default())
    }

    fn vertex(&self, cell: [i32; 3], edge: Edge) -> u32 {
        self.cells.get(&cell).map_or(u32::MAX, |vertices| vertices[place(cell, edge)])
    }

    /// Joins the vertices of the four cells around an edge that the surface crosses; `rises` if it ends outside.
    fn add_triangles(&mut self, edge: Edge, rises: bool) {
        let cells = around(edge);
        let mut polygon = Vec::new();
        let mut first_middle = None;
        for k in 0..4 {
            polygon.push(self.vertex(cells[k], edge));
            if let Some(middle) = self.middle(cells[k], cells[(k + 1) % 4], edge) {
                first_middle.get_or_insert(polygon.len());
                polygon.push(middle);
            }
        }
        let start = match first_middle {
            Some(middle) => middle,
            None => {
                let apart = |a: u32, b: u32| {
                    let [a, b] = [a, b].map(|vertex| self.mesh.vertices[vertex as usize]);
                    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>()
                };
                usize::from(apart(polygon[1], polygon[3]) < apart(polygon[0], polygon[2]))
            }
        };
        polygon.rotate_left(start);
        for pair in polygon[1..].windows(2) {
            let [a, b] = if rises { [pair[0], pair[1]] } else { [pair[1], pair[0]] };
            self.mesh.triangles.push([polygon[0], a, b]);
        }
    }

    /// A vertex on the face between two cells, where another piece of the surface there joins the same two vertices.
    fn middle(&mut self, a: [i32; 3], b: [i32; 3], edge: Edge) -> Option<u32> {
        let axis = (0..3).find(|k| a[*k] != b[*k])?;
        let face = Face { base: std::array::from_fn(|k| a[k].max(b[k])), axis };
        let edges = face.edges();
        let here = edges.iter().position(|other| *other == edge)?;
        let partners = face.partners(&|voxel| self.field(voxel));
        let opposite = (here + 2) % 4;
        partners[opposite]?;
        let is_same = |cell| self.vertex(cell, edges[opposite]) == self.vertex(cell, edge);
        if !is_same(a) || !is_same(b) {
            return None;
        }
        let partner = partners[here]?;
        let key = (face, here.min(partner));
        if let Some(vertex) = self.middles.get(&key) {
            return Some(*vertex);
        }
        let vertex = self.add_mean(&[edge, edges[partner]]);
        self.middles.insert(key, vertex);
        Some(vertex)
    }
}

/// The cells around an edge, counter-clockwise as seen from its end.
fn around((from, axis): Edge) -> [[i32; 3]; 4] {
    let [u, w] = others(axis);
    [step(step(from, u, -1), w, -1), step(from, w, -1), from, step(from, u, -1)]
}
