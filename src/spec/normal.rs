//! The standard normal distribution: density, distribution function, quantile.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Least and largest share that a quantile is taken of: samples may fall on an end of (0, 1).
const LEAST: f64 = 0.25 * f64::EPSILON;
const MOST: f64 = 1.0 - 0.5 * f64::EPSILON;
/// From here on the tail comes from a continued fraction, for a difference from 1 would lose digits.
const TAIL: f64 = 2.5;

/// Wichura's AS 241 (PPND16): numerators and denominators near the middle, in the tail, far in the tail.
const MIDDLE: [[f64; 8]; 2] = [
    [
        3.387_132_872_796_366_608,
        133.141_667_891_784_377_45,
        1_971.590_950_306_551_442_7,
        13_731.693_765_509_461_125,
        45_921.953_931_549_871_457,
        67_265.770_927_008_700_853,
        33_430.575_583_588_128_105,
        2_509.080_928_730_122_672_7,
    ],
    [
        1.0,
        42.313_330_701_600_911_252,
        687.187_007_492_057_908_3,
        5_394.196_021_424_751_107_7,
        21_213.794_301_586_595_867,
        39_307.895_800_092_710_61,
        28_729.085_735_721_942_674,
        5_226.495_278_852_854_561,
    ],
];
const NEAR_TAIL: [[f64; 8]; 2] = [
    [
        1.423_437_110_749_683_577_34,
        4.630_337_846_156_545_295_9,
        5.769_497_221_460_691_405_5,
        3.647_848_324_763_204_605_04,
        1.270_458_252_452_368_382_58,
        0.241_780_725_177_450_611_77,
        0.022_723_844_989_269_184_583_3,
        7.745_450_142_783_414_076_4e-4,
    ],
    [
        1.0,
        2.053_191_626_637_758_821_87,
        1.676_384_830_183_803_849_4,
        0.689_767_334_985_100_004_55,
        0.148_103_976_427_480_074_59,
        0.015_198_666_563_616_457_196_6,
        5.475_938_084_995_344_946e-4,
        1.050_750_071_644_416_843_24e-9,
    ],
];
const FAR_TAIL: [[f64; 8]; 2] = [
    [
        6.657_904_643_501_103_777_2,
        5.463_784_911_164_114_369_9,
        1.784_826_539_917_291_335_8,
        0.296_560_571_828_504_891_23,
        0.026_532_189_526_576_123_093,
        1.242_660_947_388_078_438_6e-3,
        2.711_555_568_743_487_578_15e-5,
        2.010_334_399_292_288_132_65e-7,
    ],
    [
        1.0,
        0.599_832_206_555_887_937_69,
        0.136_929_880_922_735_805_31,
        0.014_875_361_290_850_614_852_5,
        7.868_691_311_456_132_591e-4,
        1.846_318_317_510_054_681_8e-5,
        1.421_511_758_316_445_888_7e-7,
        2.044_263_103_389_939_785_64e-15,
    ],
];

/// Value below which a share of all values lies, to 1e-15 of itself; ends of (0, 1) count as the nearest share inside.
pub(super) fn quantile(share: f64) -> f64 {
    let share = share.clamp(LEAST, MOST);
    let off = share - 0.5;
    if off.abs() <= 0.425 {
        return off * ratio(&MIDDLE, 0.180625 - off * off);
    }
    let tail = if off < 0.0 { share } else { 1.0 - share };
    let depth = (-tail.ln()).sqrt();
    let size = if depth <= 5.0 { ratio(&NEAR_TAIL, depth - 1.6) } else { ratio(&FAR_TAIL, depth - 5.0) };
    size.copysign(off)
}

/// Share of all values below `x`.
pub(super) fn share_below(x: f64) -> f64 {
    if x > TAIL {
        1.0 - tail(x)
    } else if x < -TAIL {
        tail(-x)
    } else {
        0.5 + density(x) * series(x)
    }
}

pub(super) fn density(x: f64) -> f64 {
    (-0.5 * x * x).exp() * FRAC_1_SQRT_2 / PI.sqrt()
}

fn ratio(coefficients: &[[f64; 8]; 2], x: f64) -> f64 {
    let [above, below] = coefficients.map(|row| row.iter().rev().fold(0.0, |sum, c| sum * x + c));
    above / below
}

/// (share below x - 1/2) / density: x + x³/3 + x⁵/(3·5) + ...
fn series(x: f64) -> f64 {
    let (mut term, mut sum, mut odd) = (x, x, 1.0);
    while term.abs() > 1e-18 * sum.abs() {
        odd += 2.0;
        term *= x * x / odd;
        sum += term;
    }
    sum
}

/// Share of all values above a positive x: density / (x + 1/(x + 2/(x + 3/(x + ...)))).
fn tail(x: f64) -> f64 {
    const DEPTH: u32 = 200;
    density(x) / (1..=DEPTH).rev().fold(x, |fraction, k| x + f64::from(k) / fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_published_ones() {
        // Wichura's own check values, and those of tables.
        let known = [
            (0.25, -0.674_489_750_196_081_7),
            (0.001, -3.090_232_306_167_813_5),
            (0.975, 1.959_963_984_540_054),
            (0.5, 0.0),
            (1e-10, -6.361_340_902_404_056),
        ];
        for (share, value) in known {
            let found = quantile(share);
            assert!((found - value).abs() <= 1e-15 * f64::max(value.abs(), 1.0), "{share}: {found}");
        }
        assert!(quantile(0.0).is_finite() && quantile(1.0).is_finite());
        assert!(quantile(0.0) < -8.2 && quantile(1.0) > 8.1);
    }

    #[test]
    fn shares_are_those_of_tables() {
        let known = [
            (0.0, 0.5),
            (1.0, 0.841_344_746_068_542_9),
            (-1.0, 0.158_655_253_931_457_05),
            (2.0, 0.977_249_868_051_820_8),
            (-3.0, 1.349_898_031_630_094_6e-3),
            (-6.0, 9.865_876_450_376_982e-10),
        ];
        for (x, share) in known {
            let found = share_below(x);
            assert!(
                (found - share).abs() <= 4e-16 * f64::max(1.0, share) && (found / share - 1.0).abs() < 1e-13,
                "{x}"
            );
        }
        assert!((density(0.0) - 0.398_942_280_401_432_7).abs() < 1e-16);
    }

    #[test]
    fn a_quantile_of_a_share_is_where_it_was() {
        for step in 1..4000 {
            let share = f64::from(step) / 4000.0;
            for share in [share, share * share * share * share, 1e-9 * share] {
                let back = share_below(quantile(share));
                assert!((back - share).abs() < 4e-15 * share.max(1e-3) + 1e-13 * share, "{share}: {back}");
            }
        }
    }
}
