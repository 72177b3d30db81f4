//! Meshes around voxels are closed whatever the voxels, and lie where the surface is.

use proptest::prelude::*;
use rodsweep::study::{Mesh, surface_nets};
use rodsweep::table::Lattice;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::f64::consts::PI;

const LATTICE: Lattice = Lattice { origin: [-0.0503, 0.0204, 0.0307], spacing: 1e-3 };

/// Voxels whose signed distance is above -1.5 voxels.
fn voxels(distance: impl Fn([f64; 3]) -> f64, reach: i32) -> HashMap<[i32; 3], f64> {
    let mut known = HashMap::new();
    for i in -reach..reach {
        for j in -reach..reach {
            for k in -reach..reach {
                let here = distance([i, j, k].map(|x| (f64::from(x) + 0.5) * LATTICE.spacing));
                if here > -1.5 * LATTICE.spacing {
                    known.insert([i, j, k], here);
                }
            }
        }
    }
    known
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Six times the signed volume between a triangle and the origin.
fn wedge([a, b, c]: [[f64; 3]; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
}

fn volume(mesh: &Mesh) -> f64 {
    mesh.triangles.iter().map(|triangle| wedge(triangle.map(|k| mesh.vertices[k as usize])) / 6.0).sum()
}

/// Every edge has two triangles, which run along it in opposite directions; around every vertex lies one fan of them.
/// Returns Euler's characteristic.
fn check_closed(mesh: &Mesh) -> i64 {
    let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let mut fans: BTreeMap<u32, BTreeMap<u32, u32>> = BTreeMap::new();
    for [a, b, c] in &mesh.triangles {
        for [from, to, opposite] in [[a, b, c], [b, c, a], [c, a, b]] {
            assert_ne!(from, to, "a triangle has three corners");
            *edges.entry([*from, *to]).or_default() += 1;
            fans.entry(*from).or_default().insert(*to, *opposite);
        }
    }
    for ([from, to], count) in &edges {
        assert_eq!((*count, edges.get(&[*to, *from])), (1, Some(&1)), "the edge from {from} to {to}");
    }
    for (vertex, fan) in &fans {
        let (start, mut at, mut length) = (*fan.keys().next().unwrap(), *fan.values().next().unwrap(), 1);
        while at != start {
            (at, length) = (fan[&at], length + 1);
        }
        assert_eq!(length, fan.len(), "around vertex {vertex} lies more than one fan");
    }
    let used: BTreeSet<u32> = mesh.triangles.iter().flatten().copied().collect();
    assert_eq!(used.len(), mesh.vertices.len(), "every vertex is a corner");
    mesh.vertices.len() as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64
}

#[test]
fn a_ball_has_its_volume_and_its_normals() {
    let radius = 0.0153;
    let ball = surface_nets(&voxels(|p| radius - length(p), 18), &LATTICE);
    assert_eq!(check_closed(&ball), 2);
    let share = volume(&ball) / (4.0 / 3.0 * PI * radius.powi(3));
    assert!((share - 1.0).abs() < 0.01, "{share} of the volume");
    for (vertex, normal) in ball.vertices.iter().zip(ball.normals()) {
        let outward: [f64; 3] = std::array::from_fn(|k| vertex[k] - LATTICE.origin[k]);
        assert!((length(outward) - radius).abs() < 0.1 * LATTICE.spacing, "a vertex at {}", length(outward));
        let cosine: f64 = (0..3).map(|k| outward[k] * normal[k]).sum::<f64>() / length(outward);
        assert!(cosine > 0.98, "a normal leans by {cosine}");
    }
}

#[test]
fn a_torus_has_a_hole_and_a_shell_two_sides() {
    let torus = |[x, y, z]: [f64; 3]| 4.2e-3 - (x.hypot(y) - 0.0121).hypot(z);
    let mesh = surface_nets(&voxels(torus, 20), &LATTICE);
    assert_eq!(check_closed(&mesh), 0);
    let share = volume(&mesh) / (2.0 * PI * PI * 0.0121 * 4.2e-3f64.powi(2));
    assert!((share - 1.0).abs() < 0.03, "{share} of the volume");
    let shell = surface_nets(&voxels(|p| 1.1e-3 - (length(p) - 0.012).abs(), 18), &LATTICE);
    assert_eq!(check_closed(&shell), 4);
    let share = volume(&shell) / (4.0 / 3.0 * PI * (0.0131f64.powi(3) - 0.0109f64.powi(3)));
    assert!((share - 1.0).abs() < 0.03, "{share} of the volume");
}

#[test]
fn few_voxels_have_a_surface_too() {
    assert_eq!(surface_nets(&HashMap::new(), &LATTICE), Mesh::default());
    let half = 0.5 * LATTICE.spacing;
    let outside = [([0, 0, 0], -half), ([1, 0, 0], f64::NAN), ([5, 5, 5], 0.0)].into();
    assert_eq!(surface_nets(&outside, &LATTICE), Mesh::default());
    let cube = surface_nets(&[([3, -4, 5], half), ([i32::MAX, 0, 0], half)].into(), &LATTICE);
    assert_eq!((cube.vertices.len(), cube.triangles.len(), check_closed(&cube)), (8, 12, 2));
    assert!(cube.voxels.iter().all(|voxel| *voxel == [3, -4, 5]) && volume(&cube) > 0.0);
    let centre = LATTICE.centre([3, -4, 5]);
    assert!(cube.vertices.iter().all(|vertex| (0..3).all(|k| (vertex[k] - centre[k]).abs() < 0.51e-3)));
    // Voxels that touch in an edge or a corner: two surfaces, or one where the mean lies inside.
    for other in [[1, 1, 0], [1, 1, 1]] {
        let apart = surface_nets(&[([0; 3], half), (other, half)].into(), &LATTICE);
        assert_eq!(check_closed(&apart), 4);
    }
    let joined = surface_nets(&[([0; 3], 2.0 * half), ([1, 1, 0], 2.0 * half)].into(), &LATTICE);
    assert_eq!(check_closed(&joined), 2);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn any_voxels_have_a_closed_surface(
        distances in proptest::collection::vec(prop_oneof![Just(None), (-1.0..1.0f64).prop_map(Some)], 216),
    ) {
        let place = |k: usize| [k % 6, k / 6 % 6, k / 36].map(|x| x as i32);
        let known: HashMap<[i32; 3], f64> = distances
            .iter()
            .enumerate()
            .filter_map(|(k, distance)| distance.map(|distance| (place(k), distance * LATTICE.spacing)))
            .collect();
        let mesh = surface_nets(&known, &LATTICE);
        check_closed(&mesh);
        prop_assert!(volume(&mesh) >= 0.0);
        prop_assert_eq!(mesh.voxels.len(), mesh.vertices.len());
        prop_assert!(mesh.voxels.iter().all(|voxel| known[voxel] > 0.0));
        prop_assert_eq!(&surface_nets(&known, &LATTICE), &mesh);
    }
}
