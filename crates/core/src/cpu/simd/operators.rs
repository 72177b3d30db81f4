//! Operators and indices of vectors and matrices, which WGSL has built in.

use super::lane::Lane;
use crate::cpu::algebra::{Mat3, Vec3, axpy};
use std::ops::{Add, Index, IndexMut, Mul, Neg, Sub};

impl<L> Index<usize> for Vec3<L> {
    type Output = L;
    #[inline(always)]
    fn index(&self, axis: usize) -> &L {
        match axis {
            0 => &self.x,
            1 => &self.y,
            _ => &self.z,
        }
    }
}

impl<L> IndexMut<usize> for Vec3<L> {
    #[inline(always)]
    fn index_mut(&mut self, axis: usize) -> &mut L {
        match axis {
            0 => &mut self.x,
            1 => &mut self.y,
            _ => &mut self.z,
        }
    }
}

impl<L> Index<usize> for Mat3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn index(&self, k: usize) -> &Vec3<L> {
        match k {
            0 => &self.x,
            1 => &self.y,
            _ => &self.z,
        }
    }
}

impl<L> IndexMut<usize> for Mat3<L> {
    #[inline(always)]
    fn index_mut(&mut self, k: usize) -> &mut Vec3<L> {
        match k {
            0 => &mut self.x,
            1 => &mut self.y,
            _ => &mut self.z,
        }
    }
}

impl<L: Lane> Add for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }
}

impl<L: Lane> Sub for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self { x: self.x - b.x, y: self.y - b.y, z: self.z - b.z }
    }
}

impl<L: Lane> Neg for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}

impl<L: Lane> Mul<L> for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: L) -> Self {
        Self { x: self.x * s, y: self.y * s, z: self.z * s }
    }
}

/// Component by component.
impl<L: Lane> Mul for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self { x: self.x * b.x, y: self.y * b.y, z: self.z * b.z }
    }
}

impl<L: Lane> Mul<L> for Mat3<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: L) -> Self {
        Self { x: self.x * s, y: self.y * s, z: self.z * s }
    }
}

impl<L: Lane> Mul<Vec3<L>> for Mat3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn mul(self, v: Vec3<L>) -> Vec3<L> {
        axpy(v.z, self.z, axpy(v.y, self.y, self.x * v.x))
    }
}

impl<L: Lane> Mul for Mat3<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self { x: self * b.x, y: self * b.y, z: self * b.z }
    }
}

impl<L: Lane> Add for Mat3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }
}

impl<L: Lane> Sub for Mat3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self { x: self.x - b.x, y: self.y - b.y, z: self.z - b.z }
    }
}

impl<L: Lane> Neg for Mat3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}
