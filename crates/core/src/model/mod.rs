//! Plain data in SI units, no I/O: what a rod is, which of its numbers vary, what comes back.
//!
//! `Scene` is what a user writes. `Rod` is the mechanics of one sample (stiffness, dipole, load), the same for
//! every backend. `Plan` fixes what all samples of a sweep share. `Batch` goes in, `Solutions` come out.

mod anchors;
mod batch;
mod blocks;
mod coil;
mod column_size;
mod cuboid;
mod cylinder;
mod dependence;
mod end_curvature;
mod field;
mod field_map;
mod field_parameter;
mod growth;
mod inner_load;
mod magnet_sheet;
mod map_fit;
mod message;
mod multiples;
mod parameter;
mod plan;
mod plan_options;
mod plan_parts;
mod profile;
mod recipe;
pub mod record;
mod rest_shape;
pub mod rod;
mod rod_field;
mod rotation;
mod sample;
mod scene;
mod scene_error;
mod segment_chain;
mod segment_parameter;
mod solution;
mod starts;
mod status;
mod stepper;
pub mod tolerances;
mod units;
mod validate;
pub mod vectors;
mod wall;

pub use anchors::{ANCHOR_STRIDE, Anchor, AnchorAxis, Anchors, MOST_ANCHOR_AXES, PlanAnchors};
pub use blocks::{BLOCK, Blocks};
pub use coil::{Coil, CoilWinding};
pub use column_size::{ColumnNoise, SMALL_COLUMN, natural_size};
pub use cuboid::{Cuboid, Derivatives, others as other_axes};
pub use cylinder::{Cylinder, Slopes};
pub use end_curvature::{base_curvature, base_curvature_rate, tip_curvature};
pub use field::{
    CoilArray, CoilLoad, DEFAULT_CLEARANCE, FieldSources, GradientEntry, MU0_OVER_4PI, Magnet, MagnetBody, MagnetShape,
    UnitDipole, gradient_matrix, mri_gradient,
};
pub use field_map::{FieldMap, LEAST_MAP_NODES, MapFit, MapGrid, MapPlace, RodMap};
pub use field_parameter::MagnetParameter;
pub use inner_load::{Frame, InnerLoad, LOAD_KEYS, LoadPlace};
pub use magnet_sheet::{Body, MagnetMaterial, MagnetQuantity};
pub use message::{short_list, short_name, short_number};
pub use parameter::{Axis, Parameter, ParameterError, ParameterNames, StiffnessAxis, closest};
pub use plan::{Batch, Derivative, Entry, FreePart, Plan, PlanError, SegmentPlan, Terms, step_at};
pub use plan_options::{DerivativeScale, PlanOptions, Sensitivity};
pub use profile::{Node, Piece, Profile};
pub use recipe::{RecipeMethod, SampleRecipe};
pub use record::{BASE_RECORD, FLEXIBLE_RECORD, RIGID_RECORD, record_offsets};
pub use rest_shape::REST_POSE;
pub use rod::{FlexibleRod, RigidRod, Rod, RodSegment, Slot};
pub use rod_field::{FIELD_DIPOLE_RECORD, FIELD_MAP_RECORD, FIELD_RECORD, FieldDipole, RodField, SourceForm};
pub use rotation::{rotation_angle, rotation_matrix, rotation_vector};
pub use sample::OneSample;
pub use scene::{
    Base, Density, Flexible, Loads, Rigid, STANDARD_GRAVITY, Scene, Segment, SegmentKind, ShearElasticity, Stiffness,
};
pub use scene_error::SceneError;
pub use segment_parameter::{SegmentParameter, ShearAxis};
pub use solution::{BaseWrench, ContactColumn, MOST_ROWS, NO_EQUILIBRIUM, Quantity, Solutions};
pub use starts::{FAR, MOST_KNOWN, SEARCH_ENTRIES, Start};
pub use status::Status;
pub use stepper::{Stepper, Tableau};
pub use units::Units;
pub use wall::{Gap, RodWall, Side, Surface, TipOnWall, WALL_RECORD, Wall, WallKind, WallParameter, WallShape};

/// Three numbers along x, y, z.
pub type Vector = [f64; 3];
/// A 3 x 3 matrix by rows.
pub type Matrix = [[f64; 3]; 3];
