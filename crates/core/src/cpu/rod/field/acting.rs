//! What the field does to a rigid segment's dipole, summed over the points where it acts. F3, F4, F6
//!
//! Columns are linear in how the segment moves: with these sums none of them looks at a point.

use super::crossing::Crossing;
use crate::cpu::algebra::{Mat3, Vec3, axpy};
use crate::cpu::simd::lane::Lane;

/// Sums over the points times their shares of the dipole; where there are several, times powers of their place xi as well.
#[derive(Clone, Debug)]
pub struct Acting<L> {
    pub B: Vec3<L>,
    pub G: [Mat3<L>; 2],
    /// Second derivatives of mu . B.
    pub T3: [Mat3<L>; 3],
    /// Of each dipole of the field, for columns by parameters.
    pub dipoles: Vec<OfDipole<L>>,
}

/// What a dipole of the field does.
#[derive(Clone, Copy, Debug)]
pub struct OfDipole<L> {
    pub G: Mat3<L>,
    pub T3: [Mat3<L>; 2],
    /// B by its moment, and force.
    pub unit: Mat3<L>,
    pub pull: [Mat3<L>; 2],
    /// B by a rotation of a cuboid's edges, and force.
    pub turn_B: Mat3<L>,
    pub turn_F: [Mat3<L>; 2],
}

impl<L: Lane> Acting<L> {
    pub fn new(zero: L) -> Self {
        let o = Mat3::zero(zero);
        Self { B: o.x, G: [o; 2], T3: [o; 3], dipoles: Vec::new() }
    }

    /// Looks at the field for the columns of a crossing, with those of parameters or without.
    #[inline(always)]
    pub fn load(&mut self, crossing: &Crossing<'_, L>, with_parameters: bool) {
        let Crossing { space, segment, points, before, .. } = crossing;
        if !segment.has_dipole {
            return;
        }
        let (mu, arm, mean) = (crossing.dipole(), before.t * segment.length, crossing.mean());
        let o = Mat3::zero(mean);
        self.B = space.B0 + space.G * (axpy(mean, arm, before.p) - space.origin);
        (self.G, self.T3) = ([space.G, space.G * mean], [o; 3]);
        self.dipoles.clear();
        for dipole in &space.dipoles {
            let mut of_dipole = OfDipole { G: o, T3: [o; 2], unit: o, pull: [o; 2], turn_B: o, turn_F: [o; 2] };
            let (mut G1, mut T32) = (o, o);
            for (xi, share) in *points {
                let (xi, share) = (mean.constant(*xi), mean.constant(*share));
                let r = axpy(xi, arm, before.p) - dipole.X;
                let at_point = dipole.all(r, mu);
                let (G, T3) = (at_point.G * share, at_point.T3 * share);
                let T3_xi = T3 * xi;
                self.B = axpy(share, at_point.B, self.B);
                (of_dipole.G, G1) = (of_dipole.G + G, G1 + G * xi);
                of_dipole.T3 = [of_dipole.T3[0] + T3, of_dipole.T3[1] + T3_xi];
                T32 = T32 + T3_xi * xi;
                if with_parameters {
                    let (unit, pull) = dipole.by_moment(r, mu);
                    let pull = pull * share;
                    of_dipole.unit = of_dipole.unit + unit * share;
                    of_dipole.pull = [of_dipole.pull[0] + pull, of_dipole.pull[1] + pull * xi];
                    if dipole.form.is_cuboid() {
                        let (turn_B, turn_F) = dipole.by_turn(r, mu);
                        let turn_F = turn_F * share;
                        of_dipole.turn_B = of_dipole.turn_B + turn_B * share;
                        of_dipole.turn_F = [of_dipole.turn_F[0] + turn_F, of_dipole.turn_F[1] + turn_F * xi];
                    }
                }
            }
            self.G = [self.G[0] + of_dipole.G, self.G[1] + G1];
            self.T3 = [self.T3[0] + of_dipole.T3[0], self.T3[1] + of_dipole.T3[1], self.T3[2] + T32];
            if with_parameters {
                self.dipoles.push(of_dipole);
            }
        }
        for map in &space.maps {
            for (xi, share) in map.places(before.p, arm, points) {
                let share = share * map.scale;
                let local = map.local(axpy(xi, arm, before.p), 3);
                let (G, T3) = (local.G * share, local.T3(mu) * share);
                self.B = axpy(share, local.B, self.B);
                self.G = [self.G[0] + G, self.G[1] + G * xi];
                self.T3 = [self.T3[0] + T3, self.T3[1] + T3 * xi, self.T3[2] + T3 * (xi * xi)];
            }
        }
    }
}
