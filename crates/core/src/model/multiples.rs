//! Sweeps of numbers that stand in a rod's record times a factor, such as currents: their samples take no scene and no rod.

use super::anchors::PlanAnchors;
use super::sample::Sample;
use super::{Anchors, Entry, Parameter, Plan, SegmentParameter};

/// Values of axes that are tried: of both signs, of many digits, and of each axis its own.
const TRIED: [f64; 7] = [1.0, -0.3, 1.0 / 3.0, 1.7e-3, -12.345_678_9, 0.0, -0.0];
/// So many times the value of the axis before.
const NEXT_AXIS: f64 = 1.618_033_988_75;

/// An input of a batch that is a multiple of an axis's value.
struct Multiple {
    column: usize,
    axis: usize,
    factor: f64,
    /// Zero, of the sign that keeps a negative zero or does not.
    zero: f64,
    /// That of the plan's own scene.
    own: f64,
}

impl Multiple {
    fn at(&self, row: &[f64]) -> f64 {
        self.factor * row[self.axis] + self.zero
    }
}

/// How all inputs of a batch follow from the values of its axes.
pub(super) struct Multiples<'a> {
    inputs: Vec<Multiple>,
    /// The grid whose coordinates go along, and the column of the first.
    anchors: Option<(&'a Anchors, usize)>,
}

/// Whether any finite value of a parameter makes a rod, and stands in its record by itself.
fn is_plain(parameter: Parameter) -> bool {
    use Parameter as P;
    use SegmentParameter as S;
    let is_of_world = matches!(parameter, P::FluxDensity(_) | P::TipForce(_) | P::TipMoment(_) | P::BasePosition(_));
    is_of_world || matches!(parameter, P::Segment(_, S::Current(_) | S::RestCurvature(_)))
}

impl<'a> Multiples<'a> {
    /// `None` where inputs follow from the axes in any other way, or not to the last bit.
    pub fn of(plan: &'a Plan, sample: &Sample<&Plan>) -> Option<Multiples<'a>> {
        if !plan.axes.iter().flatten().all(|parameter| is_plain(*parameter)) {
            return None;
        }
        let anchors = match &plan.anchors {
            None => None,
            Some(PlanAnchors { grid, entry }) => match plan.entries.get(*entry) {
                Some(Entry::Varying(column)) => Some((&**grid, *column)),
                _ => return None,
            },
        };
        let mut sample = sample.clone();
        let axes = plan.axes.len();
        let mut inputs_of = |row: &[f64], is_rod: bool| {
            let made = sample.set(row);
            let all = (made == is_rod).then(|| sample.varying().collect::<Vec<(usize, f64)>>())?;
            // The coordinates come last.
            let last = all.len() - anchors.map_or(0, |_| axes);
            Some(all[..last].to_vec())
        };
        let own = inputs_of(&vec![f64::NAN; axes], false)?;
        let alone = |axis: usize| (0..axes).map(|other| f64::from(u8::from(other == axis))).collect::<Vec<f64>>();
        let alone: Vec<Vec<(usize, f64)>> =
            (0..axes).map(|axis| inputs_of(&alone(axis), true)).collect::<Option<_>>()?;
        let of_zeros = [0.0, -0.0].map(|zero| (zero, inputs_of(&vec![zero; axes], true)));
        let mut inputs = Vec::with_capacity(own.len());
        for (at, (column, own)) in own.iter().enumerate() {
            let axis = alone.iter().position(|inputs| inputs[at].1 != 0.0)?;
            let factor = alone[axis][at].1;
            let keeps = |(zero, inputs): &(f64, Option<Vec<(usize, f64)>>)| {
                inputs.as_ref().is_some_and(|inputs| inputs[at].1.to_bits() == (factor * zero).to_bits())
            };
            let zero = if of_zeros.iter().all(keeps) { -0.0 } else { 0.0 };
            inputs.push(Multiple { column: *column, axis, factor, zero, own: *own });
        }
        let is_met = |value: &f64| {
            let row: Vec<f64> = (0..axes).map(|axis| value * NEXT_AXIS.powi(axis as i32)).collect();
            let found = inputs_of(&row, true)?;
            let same = |((_, value), of): (&(usize, f64), &Multiple)| value.to_bits() == of.at(&row).to_bits();
            found.iter().zip(&inputs).all(same).then_some(())
        };
        TRIED.iter().map(is_met).collect::<Option<()>>()?;
        Some(Multiples { inputs, anchors })
    }

    /// Gives each column of a batch a sample's value; false, with those of the plan's own scene, where they make no rod.
    pub fn put(&self, row: &[f64], mut put: impl FnMut(usize, f64)) -> bool {
        let is_rod = self.inputs.iter().all(|of| of.at(row).is_finite());
        for of in &self.inputs {
            put(of.column, if is_rod { of.at(row) } else { of.own });
        }
        if let Some((grid, first)) = self.anchors {
            row.iter().enumerate().for_each(|(axis, value)| put(first + axis, grid.coordinate(axis, *value)));
        }
        is_rod
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{
        Axis, BLOCK, Base, Coil, CoilWinding, Flexible, Loads, PlanOptions, Profile, Rigid, Scene, Segment,
        SegmentKind, Stiffness,
    };

    fn scene() -> Scene {
        let flexible = SegmentKind::Flexible(Flexible {
            stiffness: Stiffness::Direct { bending_x: 1e-5, bending_y: 1e-5, torsion: 0.77e-5 },
            rest_curvature: Profile::Constant([0.0; 3]),
            stiffness_shear: None,
            stiffness_axial: None,
            density: None,
            dipole_per_length: None,
            magnet: None,
        });
        let winding = CoilWinding::Axes { turns: [100.0, 99.0, -53.0], area: [1e-5, 2.3e-5, 3.7e-6] };
        let coil = Coil { winding, current: [0.01; 3], alignment: [0.0; 3] };
        let rigid = SegmentKind::Rigid(Rigid { coil: Some(coil), ..Rigid::default() });
        let segment = |name: &str, length: f64, kind: SegmentKind| Segment { name: name.into(), length, kind };
        Scene {
            name: String::new(),
            base: Base::default(),
            flux_density: [0.0, 0.0, 3.0],
            sources: Default::default(),
            loads: Loads::default(),
            segments: vec![
                segment("a", 0.05, flexible.clone()),
                segment("coil", 0.01, rigid),
                segment("b", 0.03, flexible),
            ],
            inner_loads: Vec::new(),
            wall: None,
            inserted: 0.0,
            rigid_force_arm: true,
        }
    }

    fn current(axis: Axis) -> Parameter {
        Parameter::Segment(1, SegmentParameter::Current(axis))
    }

    fn plan(axes: &[Vec<Parameter>]) -> Plan {
        Plan::new(&scene(), axes, &[current(Axis::X)], PlanOptions::default()).expect("the axes fit the scene")
    }

    #[test]
    fn a_batch_is_that_of_its_rods() {
        let axes = [
            vec![current(Axis::X)],
            vec![current(Axis::Z), Parameter::TipForce(Axis::Y)],
            vec![Parameter::FluxDensity(Axis::X)],
            vec![Parameter::Segment(2, SegmentParameter::RestCurvature(Axis::Y))],
        ];
        let plan = plan(&axes);
        let mut sample = Sample::new(&plan);
        assert!(Multiples::of(&plan, &sample).is_some());
        // Some make no rod; a negative zero is among them.
        let value = |at: usize, axis: usize| match (at, axis) {
            (300, 0) => f64::NAN,
            (301, 1) => f64::INFINITY,
            (302, _) => -0.0,
            _ => (at as f64 - 100.0) * (0.013 + 0.007 * axis as f64),
        };
        let count = BLOCK + 50;
        let batch =
            plan.batch(count, |at, row| row.iter_mut().enumerate().for_each(|(axis, to)| *to = value(at, axis)));
        for at in 0..count {
            let row: Vec<f64> = (0..axes.len()).map(|axis| value(at, axis)).collect();
            assert_eq!(batch.bad[at], !sample.set(&row), "{at}");
            let mut columns = 0;
            for (column, value) in sample.varying() {
                assert_eq!(batch.inputs.get(at, column).to_bits(), value.to_bits(), "sample {at}, column {column}");
                columns += 1;
            }
            assert_eq!(columns, plan.input_count);
        }
    }

    #[test]
    fn other_axes_take_the_whole_way() {
        for parameter in [
            Parameter::Insertion,
            Parameter::BaseRotation(Axis::X),
            Parameter::Segment(0, SegmentParameter::Length),
            Parameter::Segment(1, SegmentParameter::Alignment(Axis::Y)),
            Parameter::Segment(1, SegmentParameter::Turns(Axis::Y)),
        ] {
            let plan = plan(&[vec![current(Axis::Y)], vec![parameter]]);
            assert!(Multiples::of(&plan, &Sample::new(&plan)).is_none(), "{parameter:?}");
        }
    }
}
