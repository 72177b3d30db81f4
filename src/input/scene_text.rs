//! Writes a scene as TOML that reads back identically: SI numbers, shortest digits that round-trip.

use super::map::write_map;
use super::toml::quoted;
use super::wall_file::{side_word, surface_word, tip_word};
use crate::model::{
    Body, CoilWinding, Density, FieldSources, Flexible, Frame, InnerLoad, LoadPlace, MagnetBody, MagnetMaterial,
    MagnetShape, Profile, Rigid, Scene, Segment, SegmentKind, ShearElasticity, Stiffness, TipOnWall, UnitDipole,
    Vector, Wall, WallShape,
};
use std::fmt::Write;

/// The text of a scene file.
pub fn write_scene(scene: &Scene) -> String {
    let mut text = format!("name = {}\n", quoted(&scene.name));
    write_tables(&mut text, scene, "");
    text
}

/// The scene as `[scene]` of a sweep file.
pub(crate) fn write_inline_scene(scene: &Scene) -> String {
    let mut text = format!("[scene]\nname = {}\n", quoted(&scene.name));
    write_tables(&mut text, scene, "scene.");
    text
}

fn write_tables(text: &mut String, scene: &Scene, prefix: &str) {
    let mut scene = scene.clone();
    scene.absorb_insertion();
    scene.cut_nodes();
    // Writing to a String cannot fail.
    let _ = try_write_tables(text, &scene, prefix);
}

fn try_write_tables(text: &mut String, scene: &Scene, prefix: &str) -> std::fmt::Result {
    writeln!(text, "\n[{prefix}base]")?;
    writeln!(text, "position = {:?}\nrotation = {:?}", scene.base.position, scene.base.rotation)?;
    writeln!(text, "\n[{prefix}field]\nflux_density = {:?}", scene.flux_density)?;
    write_sources(text, &scene.sources, prefix)?;
    writeln!(text, "\n[{prefix}loads]")?;
    let loads = &scene.loads;
    let vectors = [
        ("tip_force", loads.tip_force),
        ("tip_moment", loads.tip_moment),
        ("gravity", loads.gravity),
        ("distributed_force", loads.distributed_force),
    ];
    for (name, vector) in vectors {
        if let Some(vector) = vector {
            writeln!(text, "{name} = {vector:?}")?;
        }
    }
    if let Some(density) = loads.fluid_density {
        writeln!(text, "fluid_density = {density:?}")?;
    }
    let is_at_tip = |load: &&InnerLoad| load.place == LoadPlace::Tip;
    for InnerLoad { name, force, moment, frame, .. } in scene.inner_loads.iter().filter(is_at_tip) {
        let value = moment.unwrap_or(*force);
        writeln!(text, "{name} = {{ value = {value:?}, frame = \"{}\" }}", frame.name())?;
    }
    for load in scene.inner_loads.iter().filter(|load| !is_at_tip(load)) {
        let InnerLoad { name, segment, place, force, moment, frame } = load;
        let segment = quoted(&scene.segments[*segment].name);
        writeln!(text, "\n[[{prefix}load]]\nname = {}\nsegment = {segment}", quoted(name))?;
        match place {
            LoadPlace::At(at) => writeln!(text, "at = {at:?}\nforce = {force:?}")?,
            LoadPlace::Along => writeln!(text, "force_per_length = {force:?}")?,
            LoadPlace::Middle | LoadPlace::Tip => writeln!(text, "force = {force:?}")?,
        }
        if let Some(moment) = moment {
            writeln!(text, "moment = {moment:?}")?;
        }
        if *frame != Frame::World {
            writeln!(text, "frame = \"{}\"", frame.name())?;
        }
    }
    if let Some(wall) = &scene.wall {
        writeln!(text, "\n[{prefix}wall]")?;
        write_wall(text, wall)?;
    }
    for segment in &scene.segments {
        writeln!(text, "\n[[{prefix}segment]]")?;
        write_segment(text, segment)?;
    }
    writeln!(text, "\n[{prefix}model]\nrigid_force_arm = {}", scene.rigid_force_arm)?;
    if scene.sources.varies() {
        writeln!(text, "coil_load = \"{}\"", scene.sources.coil_load.name())?;
    }
    Ok(())
}

fn write_sources(text: &mut String, sources: &FieldSources, prefix: &str) -> std::fmt::Result {
    if let Some([xx, xy, xz, yy, yz]) = sources.gradient {
        writeln!(text, "gradient = {{ xx = {xx:?}, xy = {xy:?}, xz = {xz:?}, yy = {yy:?}, yz = {yz:?} }}")?;
        writeln!(text, "origin = {:?}", sources.origin)?;
    }
    for magnet in &sources.magnets {
        writeln!(text, "\n[[{prefix}magnet]]\nname = {}\nposition = {:?}", quoted(&magnet.name), magnet.position)?;
        writeln!(text, "moment = {:?}\nrotation = {:?}", magnet.moment, magnet.rotation)?;
        writeln!(text, "strength = {:?}\nclearance = {:?}", magnet.strength, magnet.clearance)?;
        let Some(MagnetBody { shape, is_exact }) = magnet.body else { continue };
        if is_exact {
            writeln!(text, "field = \"exact\"")?;
        }
        match shape {
            MagnetShape::Cylinder { axis, length, diameter, bore } => {
                writeln!(text, "axis = {axis:?}\nlength = {length:?}\ndiameter = {diameter:?}")?;
                if bore != 0.0 {
                    writeln!(text, "inner_diameter = {bore:?}")?;
                }
            }
            MagnetShape::Cuboid(size) => writeln!(text, "size = {size:?}")?,
        }
    }
    for array in &sources.arrays {
        writeln!(text, "\n[[{prefix}coil_array]]\nname = {}\ncurrent = {:?}", quoted(&array.name), array.current)?;
        writeln!(text, "clearance = {:?}", array.clearance)?;
        for coil in &array.coils {
            writeln!(text, "[[{prefix}coil_array.coil]]\ndipoles = [")?;
            for UnitDipole { position, moment_per_ampere } in coil {
                writeln!(text, "  {{ position = {position:?}, moment_per_ampere = {moment_per_ampere:?} }},")?;
            }
            writeln!(text, "]")?;
        }
    }
    sources.maps.iter().try_for_each(|map| write_map(text, map, prefix))
}

fn write_wall(text: &mut String, wall: &Wall) -> std::fmt::Result {
    let Wall { shape, position, rotation, tip_radius, stiffness, friction, tip } = wall;
    writeln!(text, "kind = \"{}\"\nposition = {position:?}", surface_word(wall.rod_wall().kind.surface))?;
    match shape {
        WallShape::Plane { normal } => writeln!(text, "normal = {normal:?}")?,
        WallShape::Sphere { radius, side } => writeln!(text, "radius = {radius:?}\nside = \"{}\"", side_word(*side))?,
        WallShape::Cylinder { axis, radius, side } => {
            writeln!(text, "axis = {axis:?}\nradius = {radius:?}\nside = \"{}\"", side_word(*side))?;
        }
    }
    writeln!(text, "rotation = {rotation:?}\ntip_radius = {tip_radius:?}")?;
    stiffness.iter().try_for_each(|stiffness| writeln!(text, "stiffness = {stiffness:?}"))?;
    friction.iter().try_for_each(|friction| writeln!(text, "friction = {friction:?}"))?;
    match tip {
        TipOnWall::Slides => writeln!(text, "tip = \"{}\"", tip_word(false)),
        TipOnWall::Sticks(anchor) => writeln!(text, "tip = \"{}\"\nanchor = {anchor:?}", tip_word(true)),
    }
}

fn write_segment(text: &mut String, segment: &Segment) -> std::fmt::Result {
    let kind = match segment.kind {
        SegmentKind::Flexible(_) => "flexible",
        SegmentKind::Rigid(_) => "rigid",
    };
    writeln!(text, "name = {}\nkind = \"{kind}\"\nlength = {:?}", quoted(&segment.name), segment.length)?;
    match &segment.kind {
        SegmentKind::Flexible(flexible) => write_flexible(text, flexible),
        SegmentKind::Rigid(rigid) => write_rigid(text, rigid),
    }
}

fn write_flexible(text: &mut String, flexible: &Flexible) -> std::fmt::Result {
    match &flexible.stiffness {
        Stiffness::Direct { bending_x, bending_y, torsion } => {
            writeln!(text, "stiffness = {}", principal(&[*bending_x, *bending_y, *torsion], ""))?;
        }
        Stiffness::Nodes(nodes) => {
            writeln!(text, "stiffness = [")?;
            for node in nodes {
                writeln!(text, "  {},", principal(&node.value, &format!("at = {:?}, ", node.at)))?;
            }
            writeln!(text, "]")?;
        }
        Stiffness::Tube { inner_radius, outer_radius, youngs_modulus, shear } => {
            writeln!(text, "tube = {{ inner_radius = {inner_radius:?}, outer_radius = {outer_radius:?} }}")?;
            writeln!(text, "youngs_modulus = {youngs_modulus:?}")?;
            match shear {
                ShearElasticity::Modulus(modulus) => writeln!(text, "shear_modulus = {modulus:?}")?,
                ShearElasticity::PoissonRatio(ratio) => writeln!(text, "poisson_ratio = {ratio:?}")?,
            }
        }
    }
    if let Some(shear) = flexible.stiffness_shear {
        writeln!(text, "stiffness_shear = {shear:?}")?;
    }
    if let Some(axial) = flexible.stiffness_axial {
        writeln!(text, "stiffness_axial = {axial:?}")?;
    }
    match flexible.density {
        None => {}
        Some(Density::Volume(density)) => writeln!(text, "density = {density:?}")?,
        Some(Density::Linear(density)) => writeln!(text, "linear_density = {density:?}")?,
    }
    write_magnet(text, flexible.dipole_per_length, &flexible.magnet)?;
    match &flexible.rest_curvature {
        Profile::Constant(value) => writeln!(text, "rest_curvature = {value:?}"),
        Profile::Nodes(nodes) => {
            writeln!(text, "rest_curvature = [")?;
            for node in nodes {
                writeln!(text, "  {{ at = {:?}, value = {:?} }},", node.at, node.value)?;
            }
            writeln!(text, "]")
        }
    }
}

fn principal([x, y, z]: &Vector, before: &str) -> String {
    format!("{{ {before}bending_x = {x:?}, bending_y = {y:?}, torsion = {z:?} }}")
}

fn write_magnet(
    text: &mut String,
    dipole_per_length: Option<Vector>,
    magnet: &Option<MagnetMaterial>,
) -> std::fmt::Result {
    if let Some(MagnetMaterial { quantity, value, is_along, volume_fraction }) = magnet {
        match is_along {
            true => writeln!(text, "{} = {:?}", quantity.name(), value[2])?,
            false => writeln!(text, "{} = {value:?}", quantity.name())?,
        }
        volume_fraction.iter().try_for_each(|share| writeln!(text, "volume_fraction = {share:?}"))?;
    }
    match dipole_per_length {
        Some(dipole) => writeln!(text, "dipole_per_length = {dipole:?}"),
        None => Ok(()),
    }
}

fn write_rigid(text: &mut String, rigid: &Rigid) -> std::fmt::Result {
    if let Some(mass) = rigid.mass {
        writeln!(text, "mass = {mass:?}")?;
    }
    if let Some(Body { inner_radius, outer_radius, density }) = &rigid.body {
        writeln!(text, "tube = {{ inner_radius = {inner_radius:?}, outer_radius = {outer_radius:?} }}")?;
        density.iter().try_for_each(|density| writeln!(text, "density = {density:?}"))?;
    }
    write_magnet(text, rigid.dipole_per_length, &rigid.magnet)?;
    let Some(coil) = rigid.coil else { return Ok(()) };
    let winding = match coil.winding {
        CoilWinding::Axes { turns, area } => format!("turns = {turns:?}, area = {area:?}"),
        CoilWinding::Matrix(rows) => format!("turns_area = {rows:?}"),
    };
    writeln!(text, "coil = {{ {winding}, current = {:?}, alignment = {:?} }}", coil.current, coil.alignment)
}
