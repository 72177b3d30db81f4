//! Potential energy in a field that varies.

use super::contact::Contact;
use super::flexible::Flexible;
use super::state::{BaseLoad, Varying};
use super::{base_load, equilibrium_at, rigid};
use crate::model::{BaseWrench, Rod};
use crate::reference::answer::{Equilibrium, TOLERANCE};
use crate::reference::chain::{self, nu};
use crate::reference::energy::{GAUSS, INTERVALS};
use crate::reference::extrapolation::{Extrapolation, RunAway};
use nalgebra::Vector3;

/// What is asked for: an equilibrium, or the one with this load at the base.
pub(in crate::reference) enum Of<'a> {
    Equilibrium(&'a Equilibrium),
    Base(BaseWrench),
}

/// Energy (J), the first `None` where the field is uniform, the second where the rod cannot be integrated.
pub(in crate::reference) fn energy(rod: &Rod, of: &Of<'_>) -> Option<Option<f64>> {
    let units = chain::units(rod);
    let full = Varying::new(rod, &units)?;
    let (loaded, base) = match of {
        Of::Equilibrium(found) => (full.loaded(found.load_fraction.min(1.0)), Some(base_load(&full, &units, found))),
        Of::Base(base) => (full.clone(), equilibrium_at(rod, &full, &units, *base).map(|found| found.base)),
    };
    let tissue = Contact::of(rod, &units).map_or(0.0, |contact| contact.compliance());
    let energy = base.and_then(|base| of_rod(&loaded, &base, tissue).ok());
    Some(energy.map(|energy| energy * units.moment()))
}

/// With that of a tissue at the tip, by its compliance.
fn of_rod(rod: &Varying, base: &BaseLoad, tissue: f64) -> Result<f64, RunAway> {
    let chain = &rod.chain;
    let mut integrator = Extrapolation::new(TOLERANCE);
    let mut state = rod.base_state(base, &[]);
    let mut energy = 0.0;
    for (j, segment) in chain.numbers.segments.iter().enumerate() {
        if !chain.is_flexible[j] {
            let t: Vector3<f64> = state.R.column(2).into();
            let mu = state.R * segment.mu;
            let work = |(xi, share): &(f64, f64)| share * mu.dot(&rod.field.B(state.p + *xi * segment.length * t));
            energy -= rod.field.places(state.p, segment.length * t).iter().map(work).sum::<f64>();
            energy -= segment.load.dot(&(state.p + 0.5 * segment.length * t));
            rigid::cross(rod, j, &[], &mut state);
            continue;
        }
        let flexible = Flexible::new(rod, j, &[]);
        let h = segment.length / INTERVALS as f64;
        let mut s = 0.0;
        for interval in 0..INTERVALS {
            for (place, weight) in GAUSS {
                let target = (interval as f64 + place) * h;
                flexible.advance(&mut integrator, s, target, &mut state)?;
                s = target;
                let n_body = state.R.tr_mul(&state.n);
                let strain = nu(segment.C_se, n_body) - Vector3::z();
                let bent = state.m_body.dot(&state.m_body.component_div(&flexible.K(s)));
                let work = segment.load.dot(&state.p) + (state.R * segment.mu).dot(&rod.field.B(state.p));
                energy += weight * h * (0.5 * (bent + n_body.dot(&strain)) - work);
            }
        }
        flexible.advance(&mut integrator, s, segment.length, &mut state)?;
    }
    let f = state.n - chain.numbers.f_tip;
    Ok(energy - chain.numbers.f_tip.dot(&state.p) + 0.5 * tissue * f.norm_squared()) // W2
}
