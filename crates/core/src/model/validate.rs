//! Whether a scene's numbers describe a rod.

use super::{
    CoilWinding, Cylinder, Density, GradientEntry, LOAD_KEYS, LoadPlace, Magnet, MagnetBody, MagnetMaterial,
    MagnetShape, Node, Profile, Scene, SceneError, Segment, SegmentKind, ShearElasticity, Stiffness, Vector,
};
use std::collections::HashSet;

/// No number of a scene is larger, in SI: turns, area, current and field multiplied stay finite, and derivatives do.
const LARGEST: f64 = 1e60;

/// Checks one number; `requirement` words the condition for the message.
pub(super) fn check(name: String, value: f64, holds: bool, requirement: &'static str) -> Result<(), SceneError> {
    let requirement = match holds {
        false => requirement,
        true if value.abs() > LARGEST => "at most 1e60 in size",
        true => return Ok(()),
    };
    Err(SceneError::OutOfRange { name, value, requirement })
}

/// Checks three numbers along x, y, z.
pub(super) fn check_finite(name: &str, vector: Vector) -> Result<(), SceneError> {
    for (axis, value) in ["x", "y", "z"].iter().zip(vector) {
        check(format!("{name}.{axis}"), value, value.is_finite(), "finite")?;
    }
    Ok(())
}

/// Checks a number that has to be greater than zero.
pub(super) fn check_positive(name: String, value: f64) -> Result<(), SceneError> {
    check(name.clone(), value, value.is_finite() && value > 0.0, "finite and greater than zero")?;
    check(name, value, value >= 1.0 / LARGEST, "at least 1e-60")
}

/// Checks every number of a scene, in the order a user wrote them.
pub(super) fn validate(scene: &Scene) -> Result<(), SceneError> {
    check_finite("base.position", scene.base.position)?;
    check_finite("base.rotation", scene.base.rotation)?;
    check_finite("field.flux_density", scene.flux_density)?;
    check_sources(scene)?;
    check_finite("loads.tip_force", scene.loads.tip_force.unwrap_or_default())?;
    check_finite("loads.tip_moment", scene.loads.tip_moment.unwrap_or_default())?;
    check_finite("loads.gravity", scene.loads.gravity.unwrap_or_default())?;
    check_finite("loads.distributed_force", scene.loads.distributed_force.unwrap_or_default())?;
    if let Some(density) = scene.loads.fluid_density {
        check("loads.fluid_density".into(), density, density.is_finite() && density >= 0.0, "finite and not negative")?;
    }
    if scene.segments.is_empty() {
        return Err(SceneError::NoSegment);
    }
    check_inner_loads(scene)?;
    scene.wall.map_or(Ok(()), |wall| wall.validate(scene))?;
    let mut names = HashSet::new();
    let mut massive = false;
    let mut flexible_count = 0;
    for segment in &scene.segments {
        let name = &segment.name;
        if !names.insert(name.as_str()) {
            return Err(SceneError::DuplicateName(name.clone()));
        }
        let length = segment.length;
        check(format!("{name}.length"), length, length.is_finite() && length >= 0.0, "finite and not negative")?;
        match &segment.kind {
            SegmentKind::Flexible(flexible) => {
                flexible_count += 1;
                check_stiffness(name, &flexible.stiffness, length)?;
                match &flexible.rest_curvature {
                    Profile::Constant(value) => check_finite(&format!("{name}.rest_curvature"), *value)?,
                    Profile::Nodes(nodes) => check_nodes(&format!("{name}.rest_curvature"), nodes, length)?,
                }
                for (axis, shear) in ["x", "y"].iter().zip(flexible.stiffness_shear.into_iter().flatten()) {
                    check_positive(format!("{name}.stiffness_shear.{axis}"), shear)?;
                }
                if let Some(axial) = flexible.stiffness_axial {
                    check_positive(format!("{name}.stiffness_axial"), axial)?;
                }
                check_finite(&format!("{name}.dipole_per_length"), flexible.dipole_per_length.unwrap_or_default())?;
                let is_tube = matches!(flexible.stiffness, Stiffness::Tube { .. });
                check_material(name, flexible.magnet, is_tube)?;
                match flexible.density {
                    None => {}
                    Some(Density::Volume(density)) => {
                        if !is_tube {
                            return Err(SceneError::DensityWithoutTube { segment: name.clone() });
                        }
                        check(
                            format!("{name}.density"),
                            density,
                            density.is_finite() && density >= 0.0,
                            "finite and not negative",
                        )?;
                        massive = true;
                    }
                    Some(Density::Linear(density)) => {
                        check(format!("{name}.linear_density"), density, density.is_finite(), "finite")?;
                        massive = true;
                    }
                }
            }
            SegmentKind::Rigid(rigid) => {
                if let Some(mass) = rigid.mass {
                    check(format!("{name}.mass"), mass, mass.is_finite() && mass >= 0.0, "finite and not negative")?;
                    massive = true;
                }
                check_finite(&format!("{name}.dipole_per_length"), rigid.dipole_per_length.unwrap_or_default())?;
                if let Some(body) = &rigid.body {
                    check_positive(format!("{name}.tube.outer_radius"), body.outer_radius)?;
                    let is_inside = body.inner_radius >= 0.0 && body.inner_radius < body.outer_radius;
                    let words = "not negative and below `tube.outer_radius`";
                    check(format!("{name}.tube.inner_radius"), body.inner_radius, is_inside, words)?;
                    if let Some(density) = body.density {
                        let is_possible = density.is_finite() && density >= 0.0;
                        check(format!("{name}.density"), density, is_possible, "finite and not negative")?;
                        massive = true;
                    }
                }
                check_material(name, rigid.magnet, rigid.body.is_some())?;
                if let Some(coil) = rigid.coil {
                    check_finite(&format!("{name}.coil.current"), coil.current)?;
                    check_finite(&format!("{name}.coil.alignment"), coil.alignment)?;
                    match coil.winding {
                        CoilWinding::Axes { turns, area } => {
                            check_finite(&format!("{name}.coil.turns"), turns)?;
                            check_finite(&format!("{name}.coil.area"), area)?;
                        }
                        CoilWinding::Matrix(rows) => {
                            for row in rows {
                                check_finite(&format!("{name}.coil.turns_area"), row)?;
                            }
                        }
                    }
                }
            }
        }
    }
    let first = scene.segment_length(0);
    check("insertion".into(), scene.total_length(), first >= 0.0, "longer than all segments but the first")?;
    if flexible_count == 0 {
        return Err(SceneError::NoFlexible);
    }
    check_positive("the rod's total length".into(), scene.total_length())?;
    if scene.loads.gravity.is_some() && !massive { Err(SceneError::GravityWithoutMass) } else { Ok(()) }
}

/// A magnetic material, whose dipole needs a cross-section.
fn check_material(name: &str, magnet: Option<MagnetMaterial>, has_area: bool) -> Result<(), SceneError> {
    let Some(magnet) = magnet else { return Ok(()) };
    let path = format!("{name}.{}", magnet.quantity.name());
    let size = magnet.value.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    check(path.clone(), size, has_area, "beside a `tube` or a `diameter`, which tell the volume")?;
    match magnet.is_along {
        true => check(path, magnet.value[2], magnet.value[2].is_finite(), "finite")?,
        false => check_finite(&path, magnet.value)?,
    }
    let Some(share) = magnet.volume_fraction else { return Ok(()) };
    check(format!("{name}.volume_fraction"), share, (0.0..=1.0).contains(&share), "from 0 to 1")
}

/// The sources of a field that varies in space.
fn check_sources(scene: &Scene) -> Result<(), SceneError> {
    let sources = &scene.sources;
    if !sources.varies() {
        return Ok(());
    }
    for (entry, value) in GradientEntry::ALL.iter().zip(sources.gradient.unwrap_or_default()) {
        check(format!("field.gradient.{}", entry.name()), value, value.is_finite(), "finite")?;
    }
    check_finite("field.origin", sources.origin)?;
    let mut names = HashSet::new();
    for magnet in &sources.magnets {
        let name = format!("magnets.{}", magnet.name);
        check_finite(&format!("{name}.position"), magnet.position)?;
        check_finite(&format!("{name}.moment"), magnet.moment)?;
        check_finite(&format!("{name}.rotation"), magnet.rotation)?;
        check(format!("{name}.strength"), magnet.strength, magnet.strength.is_finite(), "finite")?;
        let size = magnet.moment.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        check(format!("{name}.moment"), size, size > 0.0, "other than zero: a magnet without moment does nothing")?;
        check_positive(format!("{name}.clearance"), magnet.clearance)?;
        if let Some(body) = magnet.body {
            check_shape(&name, &body.shape)?;
            check_exact(&name, magnet, &body)?;
        }
        if !names.insert(name) {
            return Err(SceneError::DuplicateSource(magnet.name.clone()));
        }
    }
    for array in &sources.arrays {
        let name = &array.name;
        if !names.insert(name.clone()) || scene.segments.iter().any(|segment| segment.name == *name) {
            return Err(SceneError::DuplicateSource(name.clone()));
        }
        let (coils, currents) = (array.coils.len(), array.current.len());
        if coils != currents || coils == 0 {
            return Err(SceneError::CurrentsOfCoils { name: name.clone(), coils, currents });
        }
        let is_possible = array.clearance.is_finite() && array.clearance >= 0.0;
        check(format!("{name}.clearance"), array.clearance, is_possible, "finite and not negative")?;
        for (k, current) in array.current.iter().enumerate() {
            check(format!("{name}.current.{}", k + 1), *current, current.is_finite(), "finite")?;
        }
        for dipole in array.coils.iter().flatten() {
            check_finite(&format!("{name}.coil.dipoles.position"), dipole.position)?;
            check_finite(&format!("{name}.coil.dipoles.moment_per_ampere"), dipole.moment_per_ampere)?;
        }
    }
    for map in &sources.maps {
        let name = format!("maps.{}", map.name);
        check(format!("{name}.scale"), map.scale, map.scale.is_finite(), "finite")?;
        check_finite(&format!("{name}.position"), map.position)?;
        if !names.insert(name) {
            return Err(SceneError::DuplicateSource(map.name.clone()));
        }
    }
    let is_magnetised = |segment: &&Segment| match &segment.kind {
        SegmentKind::Flexible(flexible) => flexible.is_magnet(),
        SegmentKind::Rigid(_) => false,
    };
    if let Some(segment) = scene.segments.iter().find(is_magnetised).filter(|_| !sources.maps.is_empty()) {
        return Err(SceneError::MagnetisedInMap { segment: segment.name.clone() });
    }
    check_base_clearance(scene)
}

fn check_shape(name: &str, shape: &MagnetShape) -> Result<(), SceneError> {
    match *shape {
        MagnetShape::Cylinder { length, diameter, bore, .. } => {
            check_positive(format!("{name}.length"), length)?;
            check_positive(format!("{name}.diameter"), diameter)?;
            let words = "at least zero and less than `diameter`; the number is in metres";
            check(format!("{name}.inner_diameter"), bore, (0.0..diameter).contains(&bore), words)
        }
        MagnetShape::Cuboid(size) => size.into_iter().try_for_each(|edge| check_positive(format!("{name}.size"), edge)),
    }
}

/// An exact cylinder is magnetised along its axis, and its field is known as near to it as its rules reach.
fn check_exact(name: &str, magnet: &Magnet, body: &MagnetBody) -> Result<(), SceneError> {
    let MagnetBody { shape: MagnetShape::Cylinder { axis, diameter, .. }, is_exact: true } = *body else {
        return Ok(());
    };
    let along: f64 = (0..3).map(|k| magnet.moment[k] * axis[k]).sum();
    let size = magnet.moment.iter().map(|x| x * x).sum::<f64>().sqrt();
    let words = "along `axis` where field = \"exact\"; the number is its share along it. Leave out `field` for dipoles";
    check(format!("{name}.moment"), along / size, along.abs() > (1.0 - 1e-12) * size, words)?;
    let least = Cylinder::LEAST_CLEARANCE * 0.5 * diameter;
    let words = "at least a fiftieth of the radius where field = \"exact\"; the number is in metres";
    check(format!("{name}.clearance"), magnet.clearance, magnet.clearance >= least, words)
}

/// Each force has a name of its own and a place on a segment of its kind.
fn check_inner_loads(scene: &Scene) -> Result<(), SceneError> {
    let mut names: HashSet<&str> = LOAD_KEYS.into();
    for force in &scene.inner_loads {
        let keys = match force.place {
            LoadPlace::Tip => ["", ""],
            LoadPlace::Along => [".force_per_length", ".moment"],
            LoadPlace::At(_) | LoadPlace::Middle => [".force", ".moment"],
        };
        if force.place != LoadPlace::Tip && !names.insert(&force.name) {
            return Err(SceneError::DuplicateForce(force.name.clone()));
        }
        for (key, vector) in keys.into_iter().zip([force.force, force.moment.unwrap_or_default()]) {
            check_finite(&format!("loads.{}{key}", force.name), vector)?;
        }
        let misplaced = || SceneError::MisplacedForce { name: force.name.clone() };
        let segment = scene.segments.get(force.segment).ok_or_else(misplaced)?;
        match (force.place, &segment.kind) {
            (LoadPlace::At(at), SegmentKind::Flexible(_)) => {
                check_place(format!("loads.{}.at", force.name), at, segment.length)?;
            }
            (LoadPlace::Middle, SegmentKind::Rigid(_)) | (LoadPlace::Tip, _) => {}
            (LoadPlace::Along, _) if force.is_dead_force() => {}
            (LoadPlace::At(_), SegmentKind::Rigid(_))
            | (LoadPlace::Middle, SegmentKind::Flexible(_))
            | (LoadPlace::Along, _) => {
                return Err(misplaced());
            }
        }
    }
    Ok(())
}

/// The clamped end at least is where no magnet may be.
fn check_base_clearance(scene: &Scene) -> Result<(), SceneError> {
    for magnet in &scene.sources.magnets {
        for dipole in magnet.dipoles() {
            let distance = dipole.distance(scene.base.position);
            check(
                format!("magnets.{}.position", magnet.name),
                distance,
                distance > magnet.clearance,
                "a place farther from the base than the magnet's clearance; the number is its distance in metres",
            )?;
        }
    }
    Ok(())
}

/// A place on a segment, or before it where its material is withdrawn. An end computed from millimetres may miss the length
/// by rounding.
fn check_place(name: String, at: f64, length: f64) -> Result<(), SceneError> {
    let is_on = at.is_finite() && at <= length * (1.0 + 1e-12);
    check(name, at, is_on, "at most the segment's length")
}

/// Nodes in order, none beyond the segment; some may lie before it, withdrawn.
fn check_nodes(name: &str, nodes: &[Node], length: f64) -> Result<(), SceneError> {
    let mut before = f64::NEG_INFINITY;
    for (k, node) in nodes.iter().enumerate() {
        let place = format!("{name}[{k}].at");
        check_place(place.clone(), node.at, length)?;
        check(place, node.at, node.at > before, "greater than the `at` of the node before")?;
        check_finite(&format!("{name}[{k}].value"), node.value)?;
        before = node.at;
    }
    Ok(())
}

fn check_stiffness(name: &str, stiffness: &Stiffness, length: f64) -> Result<(), SceneError> {
    match *stiffness {
        Stiffness::Nodes(ref nodes) => {
            let name = format!("{name}.stiffness");
            check_nodes(&name, nodes, length)?;
            for (k, node) in nodes.iter().enumerate() {
                for (component, value) in ["bending_x", "bending_y", "torsion"].iter().zip(node.value) {
                    check_positive(format!("{name}[{k}].{component}"), value)?;
                }
            }
            Ok(())
        }
        Stiffness::Direct { bending_x, bending_y, torsion } => {
            check_positive(format!("{name}.stiffness.bending_x"), bending_x)?;
            check_positive(format!("{name}.stiffness.bending_y"), bending_y)?;
            check_positive(format!("{name}.stiffness.torsion"), torsion)
        }
        Stiffness::Tube { inner_radius, outer_radius, youngs_modulus, shear } => {
            check_positive(format!("{name}.tube.outer_radius"), outer_radius)?;
            check(
                format!("{name}.tube.inner_radius"),
                inner_radius,
                inner_radius >= 0.0 && inner_radius < outer_radius,
                "not negative and below `tube.outer_radius`",
            )?;
            check_positive(format!("{name}.youngs_modulus"), youngs_modulus)?;
            match shear {
                ShearElasticity::Modulus(modulus) => check_positive(format!("{name}.shear_modulus"), modulus),
                ShearElasticity::PoissonRatio(ratio) => check(
                    format!("{name}.poisson_ratio"),
                    ratio,
                    ratio.is_finite() && ratio > -1.0,
                    "finite and greater than -1",
                ),
            }
        }
    }
}
