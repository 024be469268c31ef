//! Faces, copies of vertices, texture coordinates and joints.

use super::*;

/// Faces of a mesh, as an instance gives them.
fn faces(instance: &InstanceHandle, mesh: UnicMesh) -> (UnicMeshInfo, Vec<[u32; 3]>) {
    let mut info = UnicMeshInfo {
        size: size_of::<UnicMeshInfo>() as u32,
        vertex_count: 0,
        face_count: 0,
        has_uvs: 0,
    };
    // SAFETY: structs and buffers of their sizes.
    unsafe {
        ok(unic_instance_mesh_info(instance.0, mesh as u32, &mut info));
        let mut faces = vec![[0; 3]; info.face_count as usize];
        let first = faces.as_mut_ptr().cast();
        ok(unic_instance_mesh_faces(
            instance.0,
            mesh as u32,
            first,
            faces.len(),
        ));
        (info, faces)
    }
}

/// The normals of faces, in the formula of each base, point as the normals of vertices do.
#[test]
fn faces_wind_as_the_axes_ask() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let pose = &motion(&model, 1)[0];
    for engine in &ENGINES {
        let instance = instance(engine, &handle);
        let theirs = converted(engine, pose);
        instance.play(Call::Reset, &c_input(&c_pose(&theirs)), model.vertex_count());
        let (info, faces) = faces(&instance, UnicMesh::Body);
        let mut out = [(); 2].map(|()| vec![[0.0; 3]; info.vertex_count as usize]);
        // SAFETY: buffers of their sizes.
        ok(unsafe { unic_instance_body(instance.0, &buffers(&mut out)) });
        let [positions, normals] = out.map(|rows| rows.into_iter().map(Vec3::from_array).collect::<Vec<_>>());
        let agrees = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| positions[v as usize]);
            (b - a).cross(c - a).dot(normals[face[0] as usize]) > 0.0
        };
        let share = faces.iter().filter(|face| agrees(face)).count() as f32 / faces.len() as f32;
        assert!(share > 0.95, "{:?}: {share}", engine.axes);
    }
}

#[test]
fn split_vertices_lie_on_their_sources_and_have_one_texture_coordinate() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let pose = &motion(&model, 1)[0];
    let plain = InstanceHandle::new(&handle, |_| ());
    let split = InstanceHandle::new(&handle, |o| o.vertex_layout = UnicVertexLayout::Split as u32);
    let (info, split_faces) = faces(&split, UnicMesh::Garment);
    let count = info.vertex_count as usize;
    let (mut sources, mut uvs) = (vec![0u32; count], vec![[0f32; 2]; count]);
    // SAFETY: buffers of their sizes.
    unsafe {
        ok(unic_instance_mesh_sources(
            split.0,
            0,
            sources.as_mut_ptr(),
            count,
        ));
        let status = unic_instance_mesh_uvs(split.0, 0, uvs.as_mut_ptr().cast(), 0, count);
        match (info.has_uvs, &model.garment().rest.uvs) {
            (1, Some(of_corners)) => {
                ok(status);
                for (face, corners) in split_faces.iter().zip(&of_corners.faces) {
                    for (&vertex, &corner) in face.iter().zip(corners) {
                        assert_eq!(
                            uvs[vertex as usize],
                            of_corners.coordinates[corner as usize].to_array()
                        );
                    }
                }
            }
            (0, None) => refused(status, UnicStatus::InvalidValue, "texture coordinates"),
            other => panic!("{other:?}"),
        }
    }
    let pose = c_pose(pose);
    let expected = plain.play(Call::Reset, &c_input(&pose), model.vertex_count());
    let found = split.play(Call::Reset, &c_input(&pose), count);
    for (found, expected) in found.iter().zip(&expected) {
        assert!(
            found
                .iter()
                .zip(&sources)
                .all(|(row, &source)| *row == expected[source as usize])
        );
    }
    let of_sources = split_faces.iter().map(|face| face.map(|v| sources[v as usize]));
    assert!(of_sources.eq(model.garment().rest.faces.iter().copied()));
}

#[test]
fn joints_are_those_of_the_model() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let skeleton = &model.character().skeleton;
    let mut info = UnicModelInfo {
        size: size_of::<UnicModelInfo>() as u32,
        joint_count: 0,
        root_joint: 9,
        vertex_count: 0,
        face_count: 0,
        body_vertex_count: 0,
        body_face_count: 0,
        fps: 0.0,
    };
    // SAFETY: structs and buffers of their sizes.
    unsafe {
        ok(unic_model_info(handle.0, &mut info));
        assert_eq!(info.joint_count as usize, skeleton.len());
        assert_eq!(info.root_joint as usize, skeleton.root());
        assert_eq!(info.vertex_count as usize, model.vertex_count());
        assert_eq!(info.body_face_count as usize, model.character().body.faces.len());
        assert_eq!(info.fps, model.config().fps);
        let mut parents = vec![0; skeleton.len()];
        ok(unic_model_joint_parents(
            handle.0,
            parents.as_mut_ptr(),
            parents.len(),
        ));
        for (joint, name) in skeleton.names().iter().enumerate() {
            let mut found = std::ptr::null();
            ok(unic_model_joint_name(handle.0, joint as u32, &mut found));
            assert_eq!(std::ffi::CStr::from_ptr(found).to_str().unwrap(), name);
            assert_eq!(parents[joint], skeleton.parents()[joint].map_or(-1, |p| p as i32));
        }
        let status = unic_model_joint_name(handle.0, 24, &mut std::ptr::null());
        refused(status, UnicStatus::InvalidValue, "joint");
        for engine in &ENGINES {
            let instance = instance(engine, &handle);
            let (mut positions, mut rotations) = (vec![[0f32; 3]; 24], vec![[0f32; 4]; 24]);
            let first = positions.as_mut_ptr().cast();
            ok(unic_instance_rest_joints(
                instance.0,
                first,
                rotations.as_mut_ptr().cast(),
                24,
            ));
            let points = skeleton.joints().iter().map(|p| (engine.point)(*p));
            assert!(largest(&positions, points) < 1e-5 * engine.scale);
            // Rest rotations in the world are the rest pose.
            let pose = UnicPose {
                root: positions[skeleton.root()],
                root_kind: UnicRoot::Position as u32,
                rotation_kind: UnicRotations::World as u32,
                joint_count: 24,
                rotations: rotations.as_ptr().cast(),
                rotation_stride: 0,
            };
            ok(unic_instance_step(instance.0, &c_input(&pose), std::ptr::null()));
            let mut body = [vec![[0.0; 3]; model.character().body.vertices.len()], vec![]];
            let mut to = buffers(&mut body);
            to.normals = null_mut();
            ok(unic_instance_body(instance.0, &to));
            let rest = model.character().body.vertices.iter().map(|p| (engine.point)(*p));
            assert!(largest(&body[0], rest) < 1e-4 * engine.scale, "{:?}", engine.axes);
        }
    }
}
