//! Scenes by hand.

use rodsweep::model::{
    Base, Coil, CoilWinding, Flexible, Loads, Parameter, Profile, Rigid, Scene, Segment, SegmentKind, ShearElasticity,
    Stiffness, Vector,
};

/// A tube with a coil set between two flexible segments.
pub fn catheter() -> Scene {
    let tube = Stiffness::Tube {
        inner_radius: 0.38e-3,
        outer_radius: 0.5e-3,
        youngs_modulus: 4.0e6,
        shear: ShearElasticity::PoissonRatio(0.45),
    };
    let segment = |name: &str, length| Segment {
        name: name.into(),
        length,
        kind: SegmentKind::Flexible(flexible(tube.clone(), [1.0, -2.0, 0.5])),
    };
    let winding = CoilWinding::Axes { turns: [30.0, 30.0, 100.0], area: [7e-6, 7e-6, 3e-6] };
    let coil = Coil { winding, current: [0.1, -0.2, 0.05], alignment: [0.0; 3] };
    let coil = Segment {
        name: "coil".into(),
        length: 0.013,
        kind: SegmentKind::Rigid(Rigid { coil: Some(coil), ..Rigid::default() }),
    };
    Scene {
        name: "catheter".into(),
        base: Base { position: [0.01, 0.02, 0.03], rotation: [0.1, 0.0, -0.2] },
        flux_density: [0.0, 0.5, 3.0],
        sources: Default::default(),
        loads: Loads { tip_force: Some([1e-3, -2e-3, 0.5e-3]), ..Loads::default() },
        segments: vec![segment("proximal", 0.1), coil, segment("distal", 0.033)],
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    }
}

/// A flexible segment that neither weighs nor shears nor stretches, and carries no magnet.
pub fn flexible(stiffness: Stiffness, rest_curvature: Vector) -> Flexible {
    Flexible {
        stiffness,
        rest_curvature: Profile::Constant(rest_curvature),
        stiffness_shear: None,
        stiffness_axial: None,
        density: None,
        dipole_per_length: None,
        magnet: None,
    }
}

/// Parameters by name; a group stands for its components.
pub fn parameters(scene: &Scene, names: &[&str]) -> Vec<Parameter> {
    names.iter().flat_map(|name| Parameter::parse(scene, name).unwrap()).collect()
}
