//! The files of `sweeps/` that programs bring along, so that they need no checkout: names and texts.

/// Name without folder, and text.
pub type ShippedFile = (&'static str, &'static str);

macro_rules! shipped {
    ($folder:literal, $name:literal) => {
        ($name, include_str!(concat!("../sweeps/", $folder, $name)))
    };
}

/// A textbook cantilever: a steel wire with a weight at its end, no coil.
pub const CANTILEVER: ShippedFile = shipped!("scenes/", "cantilever.toml");
/// The catheter P35 with one coil set; its moduli are approximate.
pub const P35: ShippedFile = shipped!("scenes/", "p35.toml");
/// The catheter P6 with one coil set, whose moduli and windings are known.
pub const P6: ShippedFile = shipped!("scenes/", "p6.toml");
/// A magnet at the tip, steered by a magnet on an arm.
pub const ARM_MAGNET: ShippedFile = shipped!("scenes/", "arm_magnet.toml");
/// Two coil sets in an array of eight electromagnets.
pub const COIL_ARRAY: ShippedFile = shipped!("scenes/", "coil_array.toml");
/// A coil at the tip alone.
pub const TIP_COIL: ShippedFile = shipped!("scenes/", "tip_coil.toml");
/// Two coil sets on one catheter.
pub const TWO_COIL: ShippedFile = shipped!("scenes/", "two_coil.toml");

/// Every scene, by name.
pub const SCENES: [ShippedFile; 7] = [ARM_MAGNET, CANTILEVER, COIL_ARRAY, P35, P6, TIP_COIL, TWO_COIL];

/// The sweep of P6's workspace; its scene is `scenes/p6.toml`.
pub const WORKSPACE: ShippedFile = shipped!("", "workspace.toml");

/// The sweeps that are benchmarked, first the one that targets are stated for. Their scenes are in `../scenes`.
pub const BENCH: [ShippedFile; 12] = [
    shipped!("bench/", "benchmark.toml"),
    shipped!("bench/", "easy.toml"),
    shipped!("bench/", "p6.toml"),
    shipped!("bench/", "p35.toml"),
    shipped!("bench/", "weight.toml"),
    shipped!("bench/", "two_coils.toml"),
    shipped!("bench/", "heavy.toml"),
    shipped!("bench/", "folds.toml"),
    shipped!("bench/", "limp.toml"),
    shipped!("bench/", "taut.toml"),
    shipped!("bench/", "magnet.toml"),
    shipped!("bench/", "uniform.toml"),
];

/// The trajectories of the paper's experiment, in its order.
pub const TRAJECTORIES: [ShippedFile; 4] = [
    shipped!("trajectories/", "circle.toml"),
    shipped!("trajectories/", "lemniscate.toml"),
    shipped!("trajectories/", "rectangle.toml"),
    shipped!("trajectories/", "butterfly.toml"),
];

/// The sweeps of the guide. Their scenes are in `scenes/`, the table of `lap.toml` is [`LAP_TABLE`].
pub const SWEEPS: [ShippedFile; 14] = [
    WORKSPACE,
    shipped!("", "volume.toml"),
    shipped!("", "insertion.toml"),
    shipped!("", "stiffness.toml"),
    shipped!("", "p6_errors.toml"),
    shipped!("", "p6_calibration.toml"),
    shipped!("", "two_coil.toml"),
    shipped!("", "arm_magnet.toml"),
    shipped!("", "coil_array.toml"),
    shipped!("", "branches.toml"),
    shipped!("", "lap.toml"),
    shipped!("", "atrial_wall.toml"),
    shipped!("", "ten_million.toml"),
    shipped!("", "billion.toml"),
];

/// The currents of the sweep `lap.toml`.
pub const LAP_TABLE: ShippedFile = shipped!("", "lap.csv");
