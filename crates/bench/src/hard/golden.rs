//! The 25 golden hard cases, with the tips that independent programs found on the branch from rest.

use super::case::{Case, Truth};
use rodsweep::model::{
    Base, Coil, CoilWinding, Flexible, Loads, Profile, Rigid, Scene, Segment, SegmentKind, Stiffness, Vector,
};
use serde::Deserialize;

/// SI units; what is left out is zero. A segment with a stiffness (EIx, EIy, GJ) is flexible.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GoldenCase {
    name: String,
    why: String,
    flux_density: Vector,
    tip_force: Option<Vector>,
    tip_moment: Option<Vector>,
    distributed_force: Option<Vector>,
    #[serde(default)]
    base_position: Vector,
    #[serde(default)]
    base_rotation: Vector,
    segments: Vec<GoldenSegment>,
    /// None where the branch ends before the full load.
    tip: Option<Vector>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GoldenSegment {
    length: f64,
    stiffness: Option<Vector>,
    #[serde(default)]
    rest_curvature: Vector,
    turns_area: Option<Vector>,
    #[serde(default)]
    current: Vector,
}

pub fn golden_cases() -> Vec<Case> {
    let cases: Vec<GoldenCase> = serde_json::from_str(include_str!("golden.json")).expect("the built-in cases read");
    cases.into_iter().map(GoldenCase::case).collect()
}

impl GoldenCase {
    fn case(self) -> Case {
        let loads = Loads {
            tip_force: self.tip_force,
            tip_moment: self.tip_moment,
            distributed_force: self.distributed_force,
            ..Loads::default()
        };
        let scene = Scene {
            name: self.name,
            base: Base { position: self.base_position, rotation: self.base_rotation },
            flux_density: self.flux_density,
            sources: Default::default(),
            loads,
            segments: self.segments.iter().enumerate().map(|(index, segment)| segment.segment(index)).collect(),
            inner_loads: Vec::new(),
            wall: None,
            inserted: 0.0,
            rigid_force_arm: true,
        };
        Case { truth: self.tip.map_or(Truth::Nowhere, Truth::Tip), ..Case::new(scene, &self.why) }
    }
}

impl GoldenSegment {
    fn segment(&self, index: usize) -> Segment {
        let kind = match (self.stiffness, self.turns_area) {
            (Some([bending_x, bending_y, torsion]), _) => SegmentKind::Flexible(Flexible {
                stiffness: Stiffness::Direct { bending_x, bending_y, torsion },
                rest_curvature: Profile::Constant(self.rest_curvature),
                stiffness_shear: None,
                stiffness_axial: None,
                density: None,
                dipole_per_length: None,
                magnet: None,
            }),
            (None, turns_area) => {
                let winding = |area| CoilWinding::Axes { turns: [1.0; 3], area };
                let coil = |area| Coil { winding: winding(area), current: self.current, alignment: [0.0; 3] };
                SegmentKind::Rigid(Rigid { coil: turns_area.map(coil), ..Rigid::default() })
            }
        };
        Segment { name: format!("segment{}", index + 1), length: self.length, kind }
    }
}
