//! Triangles around a set of voxels.

mod cell;
mod surface_nets;

pub use surface_nets::surface_nets;

use crate::model::Vector;

/// A surface of triangles around voxels. Every edge has exactly two of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// (m)
    pub vertices: Vec<Vector>,
    /// Places of their corners in `vertices`; seen from outside counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
    /// For each vertex the nearest voxel inside.
    pub voxels: Vec<[i32; 3]>,
}

impl Mesh {
    /// Outward unit normals at the vertices: those of the triangles around, by area. Zero where these have none.
    pub fn normals(&self) -> Vec<Vector> {
        let mut normals = vec![[0.0; 3]; self.vertices.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|corner| self.vertices[corner as usize]);
            let (p, q): (Vector, Vector) = (std::array::from_fn(|k| b[k] - a[k]), std::array::from_fn(|k| c[k] - a[k]));
            let across = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
            for corner in triangle {
                (0..3).for_each(|k| normals[*corner as usize][k] += across[k]);
            }
        }
        for normal in &mut normals {
            let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.0 {
                *normal = normal.map(|x| x / length);
            }
        }
        normals
    }
}
