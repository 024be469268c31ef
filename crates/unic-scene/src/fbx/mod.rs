//! FBX files, by ufbx.

mod animation;
mod mesh;

use crate::{
    fault::Fault,
    request::{Content, Request},
    scene::{Local, Node, Scene, Skin},
    unit_words::{note_conversions, unit_name},
};
use glam::{DMat4, DQuat, DVec3, Mat4};
use std::path::Path;

/// Memory of the library for its own use and for the result, each: bytes for each byte of the file, and
/// beside that.
const MEMORY_PER_BYTE: usize = 24;
const MEMORY: usize = 12 << 20;
/// Deepest tree of nodes.
const DEEPEST: u32 = 4096;

/// Reads a file.
pub(crate) fn read(path: &Path, request: &Request) -> Result<Scene, Fault> {
    let bytes = std::fs::read(path).map_err(|e| Fault::new("a file that can be opened", e.to_string()))?;
    let file = load(&bytes, request.content)?;
    let joints: Vec<bool> = file.nodes.iter().map(|node| node.bone.is_some()).collect();
    let mut scene = Scene {
        generator: generator(&file),
        nodes: file.nodes.iter().map(|node| node_of(node)).collect(),
        ..Scene::default()
    };
    describe_units(&file.settings, &mut scene);
    let places = add_skins(&file, &mut scene)?;
    mesh::read(&file, request.content, &places, &mut scene)?;
    animation::read(&file, &joints, request.content, bytes.len(), &mut scene)?;
    Ok(scene)
}

/// Parses the bytes, with units and axes converted at the root.
fn load(bytes: &[u8], content: Content) -> Result<ufbx::SceneRoot, Fault> {
    let limit = bytes.len().saturating_mul(MEMORY_PER_BYTE).saturating_add(MEMORY);
    let allocator = || ufbx::AllocatorOpts {
        memory_limit: limit,
        ..Default::default()
    };
    let options = ufbx::LoadOpts {
        temp_allocator: allocator(),
        result_allocator: allocator(),
        // The library reads other formats too, which have readers of their own here.
        file_format: ufbx::FileFormat::Fbx,
        ignore_embedded: true,
        ignore_animation: false,
        ignore_geometry: matches!(content, Content::Motion),
        index_error_handling: ufbx::IndexErrorHandling::AbortLoading,
        node_depth_limit: DEEPEST,
        // Nodes then pass their whole transforms to their children, and meshes have none of their own.
        geometry_transform_handling: ufbx::GeometryTransformHandling::ModifyGeometry,
        inherit_mode_handling: ufbx::InheritModeHandling::Compensate,
        space_conversion: ufbx::SpaceConversion::TransformRoot,
        target_axes: Y_UP,
        target_unit_meters: 1.0,
        ..Default::default()
    };
    ufbx::load_memory(bytes, options).map_err(|error| {
        let reason = match error.info() {
            "" => error.description.to_string(),
            info => format!("{} ({info})", &*error.description),
        };
        Fault::new("an FBX file", format!("a damaged one ({reason})"))
    })
}

const Y_UP: ufbx::CoordinateAxes = ufbx::CoordinateAxes {
    right: ufbx::CoordinateAxis::PositiveX,
    up: ufbx::CoordinateAxis::PositiveY,
    front: ufbx::CoordinateAxis::PositiveZ,
};

fn generator(file: &ufbx::Scene) -> Option<String> {
    let application = &file.metadata.latest_application;
    let named = [&*application.name, &*application.version].join(" ");
    let creator = file.metadata.creator.to_string();
    let text = match named.trim() {
        "" => creator,
        named => named.to_owned(),
    };
    (!text.is_empty()).then_some(text)
}

/// Describes unit and axis of the file, and notes what the library converts.
fn describe_units(settings: &ufbx::SceneSettings, scene: &mut Scene) {
    let up = match settings.axes.up {
        ufbx::CoordinateAxis::PositiveX => "X",
        ufbx::CoordinateAxis::NegativeX => "-X",
        ufbx::CoordinateAxis::NegativeY => "-Y",
        ufbx::CoordinateAxis::PositiveZ => "Z",
        ufbx::CoordinateAxis::NegativeZ => "-Z",
        ufbx::CoordinateAxis::PositiveY | ufbx::CoordinateAxis::Unknown => "Y",
    };
    let unit = settings.unit_meters;
    scene.units = format!("{}, {up} up", unit_name(unit));
    note_conversions(unit, up, &mut scene.notes);
}

fn node_of(node: &ufbx::Node) -> Node {
    Node {
        name: name_of(&node.element, "node"),
        parent: node
            .parent
            .as_ref()
            .map(|parent| parent.element.typed_id as usize),
        local: local_of(&node.local_transform),
    }
}

/// Name of an element; `node_3` where the file has none.
fn name_of(element: &ufbx::Element, kind: &str) -> String {
    match &*element.name {
        "" => format!("{kind}_{}", element.typed_id),
        name => name.to_owned(),
    }
}

fn local_of(transform: &ufbx::Transform) -> Local {
    let (t, r, s) = (&transform.translation, &transform.rotation, &transform.scale);
    let rotation = DQuat::from_xyzw(r.x, r.y, r.z, r.w);
    Local {
        translation: DVec3::new(t.x, t.y, t.z).as_vec3(),
        rotation: match rotation.length_squared() > f64::from(f32::MIN_POSITIVE) {
            true => rotation.normalize().as_quat(),
            false => glam::Quat::IDENTITY,
        },
        scale: DVec3::new(s.x, s.y, s.z).as_vec3(),
    }
}

fn matrix_of(m: &ufbx::Matrix) -> DMat4 {
    DMat4::from_cols(
        DVec3::new(m.m00, m.m10, m.m20).extend(0.0),
        DVec3::new(m.m01, m.m11, m.m21).extend(0.0),
        DVec3::new(m.m02, m.m12, m.m22).extend(0.0),
        DVec3::new(m.m03, m.m13, m.m23).extend(1.0),
    )
}

/// Adds the skins that have joints. Returns the place of each skin of the file among them.
fn add_skins(file: &ufbx::Scene, scene: &mut Scene) -> Result<Vec<Option<usize>>, Fault> {
    let mut places = Vec::new();
    for skin in file.skin_deformers.iter() {
        let has_joints = !skin.clusters.is_empty();
        places.push(has_joints.then_some(scene.skins.len()));
        if has_joints {
            scene.skins.push(skin_of(skin)?);
        }
    }
    Ok(places)
}

fn skin_of(skin: &ufbx::SkinDeformer) -> Result<Skin, Fault> {
    let mut read = Skin {
        joints: Vec::new(),
        inverse_binds: Vec::new(),
        world_from_mesh: None,
    };
    for cluster in skin.clusters.iter() {
        let Some(bone) = &cluster.bone_node else {
            return Err(Fault::new(
                "a node for each joint of a skin",
                "a joint without one",
            ));
        };
        let joint_from_mesh = matrix_of(&cluster.geometry_to_bone);
        read.joints.push(bone.element.typed_id as usize);
        read.inverse_binds.push(joint_from_mesh.as_mat4());
        if read.world_from_mesh.is_none() {
            let world_from_mesh = matrix_of(&cluster.bind_to_world) * joint_from_mesh;
            read.world_from_mesh = Some(world_from_mesh.as_mat4()).filter(Mat4::is_finite);
        }
    }
    Ok(read)
}
