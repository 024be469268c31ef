//! Queries of what does not change: meshes and joints in the axes and the layout of an instance.

use crate::{
    instance::{UnicInstance, with},
    memory::{Growing, Plain, Rows, answer_sized, check_count},
    status::UnicStatus,
};
use std::mem::{offset_of, size_of};

/// Sizes of a mesh in the layout of an instance.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct UnicMeshInfo {
    /// Size of the struct in bytes, set by the caller.
    pub size: u32,
    /// Number of vertices.
    pub vertex_count: u32,
    /// Number of triangles.
    pub face_count: u32,
    /// 1 if the mesh has texture coordinates, otherwise 0.
    pub has_uvs: u32,
}

// SAFETY: four numbers of 4 bytes.
unsafe impl Plain for UnicMeshInfo {}
const _: () = assert!(size_of::<UnicMeshInfo>() == 4 * 4, "padding");

impl Growing for UnicMeshInfo {
    const FIRST_SIZE: usize = offset_of!(Self, has_uvs) + size_of::<u32>();
}

/// Writes the sizes of a UnicMesh. The caller sets `info->size` first.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_mesh_info(
    instance: *const UnicInstance,
    mesh: u32,
    info: *mut UnicMeshInfo,
) -> UnicStatus {
    with(instance, |instance| {
        let mesh = instance.mesh(mesh)?;
        let value = UnicMeshInfo {
            size: 0, // That of the caller stays.
            vertex_count: mesh.vertex_count() as u32,
            face_count: mesh.face_count() as u32,
            has_uvs: u32::from(mesh.has_uvs()),
        };
        // SAFETY: passed on.
        unsafe { answer_sized("info", info, value) }
    })
}

/// Writes three vertex indices for each of `count` triangles.
///
/// They go counter-clockwise seen from outside in right-handed axes, and clockwise in left-handed
/// ones, as Unity and Unreal want them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_mesh_faces(
    instance: *const UnicInstance,
    mesh: u32,
    faces: *mut u32,
    count: usize,
) -> UnicStatus {
    with(instance, |instance| {
        // SAFETY: passed on.
        let rows = unsafe { Rows::<3>::new("faces", faces.cast(), 0, count) }?;
        instance.mesh(mesh)?.write_faces(rows)
    })
}

/// Writes a texture coordinate, u and v (upwards), for each of `count` vertices, `stride` bytes
/// apart (0 for 8).
///
/// With UNIC_VERTEX_LAYOUT_MODEL a vertex at a texture seam has several, and the first one is
/// written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_mesh_uvs(
    instance: *const UnicInstance,
    mesh: u32,
    uvs: *mut f32,
    stride: usize,
    count: usize,
) -> UnicStatus {
    with(instance, |instance| {
        // SAFETY: passed on.
        let rows = unsafe { Rows::<2>::new("uvs", uvs.cast(), stride, count) }?;
        instance.mesh(mesh)?.write_uvs(rows)
    })
}

/// Writes the vertex of the model for each of `count` vertices. The first ones are the model's own;
/// after them come the copies of UNIC_VERTEX_LAYOUT_SPLIT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_mesh_sources(
    instance: *const UnicInstance,
    mesh: u32,
    sources: *mut u32,
    count: usize,
) -> UnicStatus {
    with(instance, |instance| {
        // SAFETY: passed on.
        let rows = unsafe { Rows::<1>::new("sources", sources.cast(), 0, count) }?;
        instance.mesh(mesh)?.write_sources(rows)
    })
}

/// Writes the world positions and rotations of the joints in the rest pose.
///
/// `positions` are three floats and `rotations` quaternions x, y, z, w, for each of `count` joints,
/// without gaps. Either may be null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_rest_joints(
    instance: *const UnicInstance,
    positions: *mut f32,
    rotations: *mut f32,
    count: usize,
) -> UnicStatus {
    with(instance, |instance| {
        let skeleton = &instance.animator.model().character().skeleton;
        check_count("number of joints", skeleton.len(), count)?;
        if !positions.is_null() {
            // SAFETY: passed on.
            let rows = unsafe { Rows::<3>::new("positions", positions.cast(), 0, count) }?;
            for (joint, &position) in skeleton.joints().iter().enumerate() {
                rows.set(joint, instance.axes.point_out(position));
            }
        }
        if !rotations.is_null() {
            // SAFETY: passed on.
            let rows = unsafe { Rows::<4>::new("rotations", rotations.cast(), 0, count) }?;
            for (joint, &rotation) in instance.poses.rest_from_joint().iter().enumerate() {
                rows.set(joint, instance.axes.rotation_out(rotation));
            }
        }
        Ok(())
    })
}
