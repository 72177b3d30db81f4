//! Reproducible random numbers and rods for tests.

use rodsweep::model::{Axis, Matrix, Rod, RodSegment, Slot, Units, Vector};

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e3779b97f4a7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58476d1ce4e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d049bb133111eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Components uniform in [-size, size).
    pub fn vector(&mut self, size: f64) -> Vector {
        std::array::from_fn(|_| self.within(-size, size))
    }

    /// A rotation, by rows.
    pub fn rotation(&mut self) -> Matrix {
        let R = nalgebra::Rotation3::new(self.vector(1.7).into());
        std::array::from_fn(|row| std::array::from_fn(|col| R[(row, col)]))
    }

    /// A catheter-sized rod with all kinds of loads; every third starts with a rigid segment.
    pub fn rod(&mut self) -> Rod {
        let count = 2 + (self.unit() * 4.0) as usize;
        let starts_rigid = self.unit() < 1.0 / 3.0;
        let mut segments = Vec::new();
        for k in 0..count {
            let flexible = (k % 2 == 0) != starts_rigid || self.unit() < 0.2;
            segments.push(self.segment(flexible));
        }
        if !segments.iter().any(|s| matches!(s, RodSegment::Flexible { .. })) {
            segments.push(self.segment(true));
        }
        Rod {
            base_position: self.vector(0.05),
            base_rotation: self.rotation(),
            flux_density: self.vector(2.0),
            tip_force: self.vector(4e-3),
            tip_moment: self.vector(1e-4),
            rigid_force_arm: true,
            segments,
        }
    }

    fn segment(&mut self, flexible: bool) -> RodSegment {
        let load = self.vector(8e-3);
        if flexible {
            let stiffness = std::array::from_fn(|_| self.within(2e-5, 8e-5));
            let rest_curvature = self.vector(5.0);
            RodSegment::Flexible { length: self.within(0.02, 0.05), stiffness, rest_curvature, load }
        } else {
            RodSegment::Rigid { length: self.within(0.005, 0.02), dipole: self.vector(1e-4), load }
        }
    }
}

/// Every slot of a rod.
pub fn all_slots(rod: &Rod) -> Vec<Slot> {
    let mut slots = vec![Slot::Insertion];
    let vectors: [fn(Axis) -> Slot; 5] =
        [Slot::BasePosition, Slot::BaseRotation, Slot::FluxDensity, Slot::TipForce, Slot::TipMoment];
    slots.extend(vectors.iter().flat_map(|vector| Axis::ALL.map(vector)));
    for (j, segment) in rod.segments.iter().enumerate() {
        slots.push(Slot::Length(j));
        slots.extend(Axis::ALL.map(|axis| Slot::Load(j, axis)));
        match segment {
            RodSegment::Flexible { .. } => {
                slots.extend(Axis::ALL.map(|axis| Slot::Stiffness(j, axis)));
                slots.extend(Axis::ALL.map(|axis| Slot::RestCurvature(j, axis)));
            }
            RodSegment::Rigid { .. } => slots.extend(Axis::ALL.map(|axis| Slot::Dipole(j, axis))),
        }
    }
    slots
}

/// The rod moved along a slot. Insertion lengthens the first segment, whose rest curvature is constant.
pub fn moved(rod: &Rod, slot: Slot, by: f64) -> Rod {
    let mut rod = rod.clone();
    match slot {
        Slot::BasePosition(axis) => rod.base_position[axis.index()] += by,
        Slot::BaseRotation(axis) => {
            let turn = nalgebra::Rotation3::new(nalgebra::Vector3::ith(axis.index(), by));
            let R = turn.matrix() * nalgebra::Matrix3::from_fn(|row, col| rod.base_rotation[row][col]);
            rod.base_rotation = std::array::from_fn(|row| std::array::from_fn(|col| R[(row, col)]));
        }
        Slot::FluxDensity(axis) => rod.flux_density[axis.index()] += by,
        Slot::TipForce(axis) => rod.tip_force[axis.index()] += by,
        Slot::TipMoment(axis) => rod.tip_moment[axis.index()] += by,
        Slot::Insertion => return moved(&rod, Slot::Length(0), by),
        Slot::Length(j) | Slot::Stiffness(j, _) | Slot::RestCurvature(j, _) | Slot::Dipole(j, _) | Slot::Load(j, _) => {
            move_segment(&mut rod.segments[j], slot, by)
        }
    }
    rod
}

fn move_segment(segment: &mut RodSegment, slot: Slot, by: f64) {
    use RodSegment::{Flexible, Rigid};
    match (segment, slot) {
        (Flexible { length, .. } | Rigid { length, .. }, Slot::Length(_)) => *length += by,
        (Flexible { load, .. } | Rigid { load, .. }, Slot::Load(_, axis)) => load[axis.index()] += by,
        (Flexible { stiffness, .. }, Slot::Stiffness(_, axis)) => stiffness[axis.index()] += by,
        (Flexible { rest_curvature, .. }, Slot::RestCurvature(_, axis)) => rest_curvature[axis.index()] += by,
        (Rigid { dipole, .. }, Slot::Dipole(_, axis)) => dipole[axis.index()] += by,
        (segment, slot) => panic!("{segment:?} has no {slot:?}"),
    }
}

/// Length, mean stiffness over its square, and field of a rod.
pub fn rod_units(rod: &Rod) -> Units {
    let length = rod.total_length();
    let stiffness: Vec<f64> = rod
        .segments
        .iter()
        .filter_map(|s| match s {
            RodSegment::Flexible { stiffness, .. } => Some((stiffness[0] * stiffness[1]).sqrt()),
            RodSegment::Rigid { .. } => None,
        })
        .collect();
    let stiffness = stiffness.iter().sum::<f64>() / stiffness.len() as f64;
    let field = rod.flux_density.iter().map(|b| b * b).sum::<f64>().sqrt();
    Units { length, force: stiffness / (length * length), field: if field > 0.0 { field } else { 1.0 } }
}
