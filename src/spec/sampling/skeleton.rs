//! Faces of the box of axes: some axes vary, the others are at a limit.

use super::net::SOBOL_BITS;
use crate::spec::words::grouped;

/// Axes that vary where the file does not say how many: positions of a tip have three numbers.
const USUAL_DIMENSION: usize = 3;

/// The faces of a dimension of the unit cube, in a fixed order.
///
/// A face lets `dimension` axes vary and holds each of the others at one of its two ends. Faces are counted by the choice
/// of free axes (in lexicographic order), then by the ends: bit j is set where the j-th fixed axis is at its upper one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Skeleton {
    axis_count: usize,
    dimension: usize,
    face_count: u64,
}

/// A face: which axes vary, and where the others are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Face {
    /// Axes that vary, ascending.
    pub free: Vec<usize>,
    /// The other axes, ascending, and whether each is at its upper end (`to`).
    pub fixed: Vec<(usize, bool)>,
}

/// What `method = "skeleton"` was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkeletonSampling {
    /// Samples that were asked for; each face has the same power of two, so that there are at least as many.
    pub samples: u64,
    /// Axes that vary on each face, where the file says so; else 3, or all where there are fewer.
    pub dimension: Option<usize>,
}

/// Why there is no such skeleton.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SkeletonError {
    /// A number of free axes that the box does not have.
    #[error("{dimension} of {axis_count} axes cannot vary on a face: give a dimension from 1 to {axis_count}")]
    Dimension {
        /// Axes that were to vary.
        dimension: usize,
        /// Axes that there are.
        axis_count: usize,
    },
    /// More faces than can be counted.
    #[error("a box of {axis_count} axes has too many faces of dimension {dimension}: give a larger dimension")]
    TooManyFaces {
        /// Axes that were to vary.
        dimension: usize,
        /// Axes that there are.
        axis_count: usize,
    },
    /// More samples than a sweep may have.
    #[error(
        "{} samples on {} faces are more than {}: give a larger dimension, or fewer samples",
        grouped(*samples),
        grouped(*face_count),
        grouped(*limit)
    )]
    TooManySamples {
        /// Samples that were asked for.
        samples: u64,
        /// Faces, each with the same power of two.
        face_count: u64,
        /// The most that are possible.
        limit: u64,
    },
}

/// Where an axis is on a face.
enum Place {
    /// Its number among the free ones.
    Free(usize),
    /// Whether at its upper end.
    Fixed(bool),
}

impl Skeleton {
    /// The faces of `dimension` of a box of `axis_count` axes.
    ///
    /// # Errors
    ///
    /// A dimension of 0 or above the number of axes, or 2⁶³ faces or more.
    pub fn new(axis_count: usize, dimension: usize) -> Result<Skeleton, SkeletonError> {
        if dimension == 0 || dimension > axis_count {
            return Err(SkeletonError::Dimension { dimension, axis_count });
        }
        let sides = axis_count - dimension;
        let choices = (1..=sides).try_fold(1u128, |product, k| {
            let product = product.checked_mul((dimension + k) as u128)? / k as u128;
            (product < 1 << 63).then_some(product)
        });
        let face_count =
            choices.filter(|_| sides < 63).map(|choices| choices << sides).filter(|count| *count < 1 << 63);
        let face_count = face_count.ok_or(SkeletonError::TooManyFaces { dimension, axis_count })? as u64;
        Ok(Skeleton { axis_count, dimension, face_count })
    }

    /// Axes of the box.
    pub fn axis_count(&self) -> usize {
        self.axis_count
    }

    /// Axes that vary on a face.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of faces: C(axes, dimension) · 2^(axes - dimension).
    pub fn face_count(&self) -> u64 {
        self.face_count
    }

    /// The axes of a face, by its index.
    pub fn face(&self, index: u64) -> Face {
        let mut face = Face { free: Vec::with_capacity(self.dimension), fixed: Vec::new() };
        self.walk(index, |axis, place| match place {
            Place::Free(_) => face.free.push(axis),
            Place::Fixed(is_upper) => face.fixed.push((axis, is_upper)),
        });
        face
    }

    /// Writes the point of the unit cube, one number an axis, whose free axes have the values `point`.
    pub fn values(&self, face: u64, point: &[f64], row: &mut [f64]) {
        self.fill(face, row, |number| point.get(number).copied().unwrap_or(0.5));
    }

    /// The same; `free` tells the value of a free axis by its number among them.
    pub(super) fn fill(&self, face: u64, row: &mut [f64], free: impl Fn(usize) -> f64) {
        self.walk(face, |axis, place| {
            if let Some(value) = row.get_mut(axis) {
                *value = match place {
                    Place::Free(number) => free(number),
                    Place::Fixed(is_upper) => f64::from(u8::from(is_upper)),
                };
            }
        });
    }

    /// Tells of each axis where it is on a face.
    fn walk(&self, index: u64, mut tell: impl FnMut(usize, Place)) {
        let side_bits = self.axis_count - self.dimension;
        let (mut rank, mut sides) = (u128::from(index >> side_bits), index);
        // Choices of the free axes that are left, out of the axes that are left.
        let mut choices = u128::from(self.face_count >> side_bits);
        let (mut free, mut left) = (0, self.dimension as u128);
        for axis in 0..self.axis_count {
            let axes_left = (self.axis_count - axis) as u128;
            let with_this = choices * left / axes_left;
            if rank < with_this {
                tell(axis, Place::Free(free));
                (free, left, choices) = (free + 1, left - 1, with_this);
            } else {
                tell(axis, Place::Fixed(sides & 1 == 1));
                (rank, sides, choices) = (rank - with_this, sides >> 1, choices - with_this);
            }
        }
    }

    /// Least k for which 2^k samples on each face are at least so many together.
    pub(super) fn bits_for(&self, samples: u64) -> u32 {
        let each = samples.div_ceil(self.face_count).max(1);
        each.checked_next_power_of_two().map_or(u64::BITS, u64::trailing_zeros)
    }
}

impl SkeletonSampling {
    /// The faces of a box of so many axes.
    ///
    /// # Errors
    ///
    /// As [`Skeleton::new`].
    pub fn skeleton(&self, axis_count: usize) -> Result<Skeleton, SkeletonError> {
        Skeleton::new(axis_count, self.dimension.unwrap_or_else(|| axis_count.min(USUAL_DIMENSION)))
    }

    /// Samples that are drawn, all faces together.
    pub(crate) fn sample_count(&self, axis_count: usize, limit: u64) -> Result<u64, SkeletonError> {
        let skeleton = self.skeleton(axis_count)?;
        let (samples, face_count) = (self.samples, skeleton.face_count());
        let bits = skeleton.bits_for(samples);
        let count = u128::from(face_count) << bits;
        let fits = bits as usize <= SOBOL_BITS && count <= u128::from(limit);
        if fits { Ok(count as u64) } else { Err(SkeletonError::TooManySamples { samples, face_count, limit }) }
    }

    /// Remarks on the faces.
    pub(crate) fn note(&self, axis_count: usize, sample_count: u64) -> Option<String> {
        let faces = self.skeleton(axis_count).ok()?;
        let each = grouped(sample_count / faces.face_count());
        let vary = format!("{} of {axis_count} axes vary on each", faces.dimension());
        let unasked = if self.dimension.is_some() { "" } else { "; `dimension` sets how many" };
        let faces = match faces.face_count() {
            1 => "1 face".into(),
            count => format!("{} faces", grouped(count)),
        };
        let (asked, count) = (grouped(self.samples), grouped(sample_count));
        Some(match self.samples == sample_count {
            true => format!("{count} samples: {faces} with {each} each; {vary}{unasked}"),
            false => format!("{asked} samples rounded up to {count}: {faces} with {each} each; {vary}{unasked}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_face_is_there_once() {
        for axis_count in 1..=6 {
            for dimension in 1..=axis_count {
                let skeleton = Skeleton::new(axis_count, dimension).unwrap();
                let mut seen = BTreeSet::new();
                for index in 0..skeleton.face_count() {
                    let Face { free, fixed } = skeleton.face(index);
                    assert_eq!((free.len(), fixed.len()), (dimension, axis_count - dimension));
                    let axes: BTreeSet<usize> =
                        free.iter().chain(fixed.iter().map(|(axis, _)| axis)).copied().collect();
                    assert_eq!(axes.len(), axis_count);
                    let mut row = vec![f64::NAN; axis_count];
                    skeleton.values(index, &vec![0.25; dimension], &mut row);
                    assert!(free.iter().all(|axis| row[*axis] == 0.25));
                    assert!(fixed.iter().all(|(axis, is_upper)| row[*axis] == if *is_upper { 1.0 } else { 0.0 }));
                    seen.insert((free, fixed));
                }
                assert_eq!(seen.len() as u64, skeleton.face_count(), "{axis_count}, {dimension}");
            }
        }
        assert_eq!(Skeleton::new(6, 3).map(|skeleton| skeleton.face_count()), Ok(20 * 8));
        assert_eq!(Skeleton::new(4, 4).map(|skeleton| skeleton.face_count()), Ok(1));
        assert_eq!(Skeleton::new(3, 2).unwrap().face(3), Face { free: vec![0, 2], fixed: vec![(1, true)] });
    }

    #[test]
    fn a_skeleton_has_from_one_to_all_axes() {
        for dimension in [0, 4] {
            assert_eq!(Skeleton::new(3, dimension), Err(SkeletonError::Dimension { dimension, axis_count: 3 }));
        }
        for (axis_count, dimension) in [(64, 1), (70, 3), (1000, 500), (1000, 2)] {
            assert!(matches!(Skeleton::new(axis_count, dimension), Err(SkeletonError::TooManyFaces { .. })));
        }
        let wide = Skeleton::new(1000, 999).unwrap();
        assert_eq!(wide.face_count(), 2000);
        assert_eq!(wide.face(1999), Face { free: (1..1000).collect(), fixed: vec![(0, true)] });
    }
}
