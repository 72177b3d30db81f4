//! Which terms a kernel computes: passes over the rod are compiled for some sets of them, all else asks.

use crate::model;

/// Which terms are computed.
pub trait Terms: Copy {
    /// Those of a program.
    fn of(terms: ProgramTerms) -> Self;

    fn all(self) -> ProgramTerms;

    #[inline(always)]
    fn force(self) -> bool {
        self.all().force
    }

    #[inline(always)]
    fn load(self) -> bool {
        self.all().load
    }

    #[inline(always)]
    fn anisotropic(self) -> bool {
        self.all().anisotropic
    }

    #[inline(always)]
    fn general(self) -> bool {
        self.all().general
    }
}

/// The terms of a program, asked at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramTerms {
    /// An internal force n.
    pub force: bool,
    /// A force per length w; implies `force`.
    pub load: bool,
    /// Different stiffness about body x and y.
    pub anisotropic: bool,
    /// What few scenes use: stiffness and rest curvature that vary along a segment, shear, magnets, forward columns.
    /// Inside, each segment says which.
    pub general: bool,
}

impl ProgramTerms {
    /// Every term, used or not.
    pub const EVERY: Self = Self { force: true, load: true, anisotropic: true, general: true };

    /// Rarely used terms have no kernel of their own for isotropic bending.
    pub fn new(terms: model::Terms, general: bool) -> Self {
        let model::Terms { force, load, anisotropic, .. } = terms;
        Self { force: force || load, load, anisotropic: anisotropic || general, general }
    }
}

impl Terms for ProgramTerms {
    #[inline(always)]
    fn of(terms: ProgramTerms) -> Self {
        terms
    }

    #[inline(always)]
    fn all(self) -> ProgramTerms {
        self
    }
}

/// Isotropic bending, known to the compiler.
#[derive(Clone, Copy)]
pub struct Isotropic<const FORCE: bool, const LOAD: bool>;

impl<const FORCE: bool, const LOAD: bool> Terms for Isotropic<FORCE, LOAD> {
    #[inline(always)]
    fn of(_: ProgramTerms) -> Self {
        Self
    }

    #[inline(always)]
    fn all(self) -> ProgramTerms {
        ProgramTerms { force: FORCE, load: LOAD, anisotropic: false, general: false }
    }
}

/// Anisotropic bending, with rarely used terms or without; asked for a force where there is no load.
#[derive(Clone, Copy)]
pub struct Anisotropic<const LOAD: bool, const GENERAL: bool> {
    force: bool,
}

impl<const LOAD: bool, const GENERAL: bool> Terms for Anisotropic<LOAD, GENERAL> {
    #[inline(always)]
    fn of(terms: ProgramTerms) -> Self {
        Self { force: terms.force }
    }

    #[inline(always)]
    fn all(self) -> ProgramTerms {
        ProgramTerms { force: LOAD || self.force, load: LOAD, anisotropic: true, general: GENERAL }
    }
}
