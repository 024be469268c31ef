//! Contract: a garment in Bevy is where the animator of `unic-core` puts it for the same motion,
//! whatever the axes of the rig's joints and the size of the character are. No window, no graphics.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bevy::{
    mesh::{MeshPlugin, VertexAttributeValues, skinning::SkinnedMeshInverseBindposes},
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_unic::{Display, GarmentFault, GarmentState, UnicGarment, UnicModel, UnicPlugin, spawn_character};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use unic_core::{Animator, Model, Pose, Start, StepInput, collider::Collider};
use unic_glam as core;

const GARMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../apps/unic-cli/garments");

/// Distance from the animator of all but a hundredth of the vertices, and of all, metres. Transforms pass
/// through matrices of f32, and intersection handling chooses between faces, so that rounding may move
/// single vertices.
const NEAR_M: [f32; 2] = [1e-5, 1e-3];

/// The same beside a collider, which is one more choice.
const NEAR_COLLIDER_M: [f32; 2] = [1e-4, 1e-2];

/// A program without a window that has loaded the T-shirt.
struct Stage {
    app: App,
    handle: Handle<UnicModel>,
    model: Arc<Model>,
}

impl Stage {
    fn new(frames_a_tick: u32) -> Self {
        let mut app = App::new();
        let assets = AssetPlugin {
            file_path: GARMENTS.into(),
            ..default()
        };
        app.add_plugins((MinimalPlugins, assets, TransformPlugin, MeshPlugin, UnicPlugin));
        let handle: Handle<UnicModel> = app.world().resource::<AssetServer>().load("tshirt.unic");
        let start = Instant::now();
        let model = loop {
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "the model is not loaded"
            );
            app.update();
            if let Some(UnicModel(model)) = app.world().resource::<Assets<UnicModel>>().get(&handle) {
                break Arc::clone(model);
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let frame = Duration::from_secs_f64(1.0 / f64::from(model.config().fps) / f64::from(frames_a_tick));
        app.insert_resource(TimeUpdateStrategy::ManualDuration(frame));
        Self { app, handle, model }
    }

    /// Spawns the character of the model.
    fn character(&mut self) -> (Entity, Vec<Entity>) {
        let model = Arc::clone(&self.model);
        let world = self.app.world_mut();
        let mut meshes = world.remove_resource::<Assets<Mesh>>().unwrap();
        let mut bind_poses = world
            .remove_resource::<Assets<SkinnedMeshInverseBindposes>>()
            .unwrap();
        let spawned = spawn_character(&mut world.commands(), &mut meshes, &mut bind_poses, &model);
        world.flush();
        world.insert_resource(meshes);
        world.insert_resource(bind_poses);
        spawned
    }

    fn garment(&mut self, character: Entity, display: Display) -> Entity {
        let garment = UnicGarment {
            display,
            ..UnicGarment::new(self.handle.clone(), character)
        };
        self.app.world_mut().spawn(garment).id()
    }

    fn state(&mut self, garment: Entity) -> Mut<'_, GarmentState> {
        self.app.world_mut().get_mut::<GarmentState>(garment).unwrap()
    }

    /// Poses the joints as a pose of the model, whose joints have the axes of the world.
    fn pose(&mut self, joints: &[Entity], pose: &Pose) {
        let skeleton = &self.model.character().skeleton;
        for (joint, entity) in joints.iter().enumerate() {
            let own = skeleton.joints()[joint];
            let place = match skeleton.parents()[joint] {
                // Rest positions are those of the bind pose, which is no pose of zeros.
                Some(parent) => self.offset(joint, parent),
                None => own + pose.trans,
            };
            let mut transform = self.app.world_mut().get_mut::<Transform>(*entity).unwrap();
            transform.translation = Vec3::from_array(place.to_array());
            transform.rotation = Quat::from_array(pose.local[joint].to_array());
        }
    }

    /// Place of a joint in the space of its parent.
    fn offset(&self, joint: usize, parent: usize) -> core::Vec3 {
        let skeleton = &self.model.character().skeleton;
        let mut bind = Vec::new();
        skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind);
        bind[parent].rotation.inverse() * (bind[joint].translation - bind[parent].translation)
    }

    /// Vertices of the model in the garment's mesh, in the world.
    fn vertices(&self, garment: Entity) -> Vec<core::Vec3> {
        let world = self.app.world();
        let mesh = world.get::<Mesh3d>(garment).unwrap();
        let meshes = world.resource::<Assets<Mesh>>();
        let attribute = meshes.get(&mesh.0).unwrap().attribute(Mesh::ATTRIBUTE_POSITION);
        let Some(VertexAttributeValues::Float32x3(values)) = attribute else {
            panic!("positions of three floats");
        };
        let global = world.get::<GlobalTransform>(garment).unwrap();
        let place = |value: &[f32; 3]| global.transform_point(Vec3::from_array(*value)).to_array();
        let vertices = values[..self.model.vertex_count()].iter().map(place);
        vertices.map(core::Vec3::from_array).collect()
    }
}

/// Walking on the spot at a number of ticks.
fn pose_at(model: &Model, ticks: f32) -> Pose {
    let skeleton = &model.character().skeleton;
    let mut pose = skeleton.bind_pose();
    let seconds = ticks / model.config().fps;
    pose.trans = core::Vec3::new(
        0.2 * (2.0 * seconds).sin(),
        0.01 * (8.0 * seconds).sin(),
        0.5 * seconds,
    );
    let turn = core::Quat::from_rotation_y(0.8 * (1.5 * seconds).sin());
    let root = skeleton.root();
    pose.local[root] = turn * pose.local[root];
    for (name, swing) in [
        ("L_shoulder", 0.3),
        ("R_shoulder", -0.3),
        ("L_hip", -0.4),
        ("R_hip", 0.4),
    ] {
        let joint = skeleton.joint(name).unwrap();
        let turn = core::Quat::from_rotation_x(swing * (5.0 * seconds).sin());
        pose.local[joint] = turn * pose.local[joint];
    }
    pose
}

fn input(pose: &Pose) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind: core::Vec3::ZERO,
    }
}

#[track_caller]
fn assert_near(found: &[core::Vec3], expected: &[core::Vec3], [near, farthest]: [f32; 2], what: &str) {
    assert_eq!(found.len(), expected.len());
    let mut far: Vec<f32> = found.iter().zip(expected).map(|(a, b)| a.distance(*b)).collect();
    far.sort_by(f32::total_cmp);
    let (most, largest) = (far[far.len() * 99 / 100], far[far.len() - 1]);
    assert!(
        most < near && largest < farthest,
        "{what}: most are within {most} m, the largest distance is {largest} m"
    );
}

fn largest_distance(a: &[core::Vec3], b: &[core::Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

#[test]
fn a_garment_follows_a_skeleton_for_100_frames() {
    let mut stage = Stage::new(1);
    let (character, joints) = stage.character();
    let garment = stage.garment(character, Display::Ticks);
    let mut animator = Animator::new(Arc::clone(&stage.model));
    for tick in 0..100 {
        let pose = pose_at(&stage.model, tick as f32);
        stage.pose(&joints, &pose);
        stage.app.update();
        match tick {
            0 => drop(animator.reset(&input(&pose), Start::MeanShape).unwrap()),
            _ => drop(animator.step(&input(&pose)).unwrap()),
        }
        assert_near(
            &stage.vertices(garment),
            animator.garment().positions,
            NEAR_M,
            &format!("tick {tick}"),
        );
    }
}

#[test]
fn joints_of_other_axes_and_a_larger_character_in_a_moved_scene_make_no_difference() {
    let mut stage = Stage::new(1);
    let (character, joints) = stage.character();
    // As tools export bones: along their own y axis. Each joint is turned in its own space, and its
    // children and its bind pose with it.
    let turn = Quat::from_euler(EulerRot::XYZ, 0.7, -1.1, 2.0);
    let size = 1.5;
    let garment = stage.garment(character, Display::Ticks);
    let skin = stage
        .app
        .world()
        .get::<bevy::mesh::skinning::SkinnedMesh>(character)
        .unwrap()
        .clone();
    let mut bind_poses = stage
        .app
        .world_mut()
        .resource_mut::<Assets<SkinnedMeshInverseBindposes>>();
    let inverse: Vec<Mat4> = (bind_poses.get(&skin.inverse_bindposes).unwrap().iter())
        .map(|inverse| Mat4::from_quat(turn).inverse() * *inverse)
        .collect();
    drop(bind_poses.insert(skin.inverse_bindposes.id(), inverse.into()));
    stage
        .app
        .world_mut()
        .entity_mut(character)
        .insert(Transform::from_scale(Vec3::splat(size)));
    // A ball in the belly, which has the size of the character.
    let place = core::Vec3::new(0.0, 1.15, 0.12);
    let mut worn = stage.app.world_mut().get_mut::<UnicGarment>(garment).unwrap();
    worn.colliders = vec![Collider::sphere(0.12 * size, place * size)];
    let mut animator = Animator::new(Arc::clone(&stage.model));
    animator.set_colliders([Collider::sphere(0.12, place)]);
    let mut pushed = false;
    let mut bare = Animator::new(Arc::clone(&stage.model));
    for tick in 0..20 {
        let pose = pose_at(&stage.model, tick as f32);
        stage.pose(&joints, &pose);
        for (joint, entity) in joints.iter().enumerate() {
            let is_root = stage.model.character().skeleton.parents()[joint].is_none();
            let mut transform = stage.app.world_mut().get_mut::<Transform>(*entity).unwrap();
            let before = if is_root { Quat::IDENTITY } else { turn.inverse() };
            transform.translation = before * transform.translation;
            transform.rotation = before * transform.rotation * turn;
        }
        stage.app.update();
        match tick {
            0 => drop(animator.reset(&input(&pose), Start::MeanShape).unwrap()),
            _ => drop(animator.step(&input(&pose)).unwrap()),
        }
        match tick {
            0 => drop(bare.reset(&input(&pose), Start::MeanShape).unwrap()),
            _ => drop(bare.step(&input(&pose)).unwrap()),
        }
        pushed |= largest_distance(animator.garment().positions, bare.garment().positions) > 0.01;
        let expected: Vec<_> = animator.garment().positions.iter().map(|p| *p * size).collect();
        assert_near(
            &stage.vertices(garment),
            &expected,
            NEAR_COLLIDER_M,
            &format!("tick {tick}"),
        );
    }
    assert!(pushed, "the ball is in the cloth");
}

#[test]
fn a_faster_display_shows_cloth_on_its_own_poses() {
    let mut stage = Stage::new(4);
    let (character, joints) = stage.character();
    let garment = stage.garment(character, Display::Interpolated);
    let mut before: Option<Vec<core::Vec3>> = None;
    let mut largest = 0.0f32;
    for frame in 0..80 {
        let pose = pose_at(&stage.model, frame as f32 / 4.0);
        stage.pose(&joints, &pose);
        stage.app.update();
        let now = stage.vertices(garment);
        if let Some(before) = &before
            && frame > 8
        {
            let moved = largest_distance(&now, before);
            assert!(moved > 1e-5, "frame {frame} shows what the one before has shown");
            largest = largest.max(moved);
        }
        before = Some(now);
    }
    // The walk is slower than 3 m/s at 120 frames a second.
    assert!(largest < 0.025, "{largest} m within a frame");
}

#[test]
fn a_teleport_keeps_the_shape_and_a_pause_does_not() {
    let mut stage = Stage::new(1);
    let (character, joints) = stage.character();
    let garment = stage.garment(character, Display::Ticks);
    for tick in 0..10 {
        let pose = pose_at(&stage.model, tick as f32);
        stage.pose(&joints, &pose);
        stage.app.update();
    }
    let jump = core::Vec3::new(5.0, 0.0, 0.0);
    let mut pose = pose_at(&stage.model, 9.0);
    pose.trans += jump;
    let expected: Vec<_> = stage.vertices(garment).iter().map(|p| *p + jump).collect();
    stage.pose(&joints, &pose);
    stage.app.update();
    assert_near(&stage.vertices(garment), &expected, NEAR_M, "after a teleport");

    let shown = stage.vertices(garment);
    stage
        .app
        .world_mut()
        .get_mut::<UnicGarment>(garment)
        .unwrap()
        .is_paused = true;
    pose.trans.x += 0.5;
    stage.pose(&joints, &pose);
    stage.app.update();
    assert_eq!(stage.vertices(garment), shown, "a paused garment stays");
    stage
        .app
        .world_mut()
        .get_mut::<UnicGarment>(garment)
        .unwrap()
        .is_paused = false;
    stage.app.update();
    let mut fresh = Animator::new(Arc::clone(&stage.model));
    fresh.reset(&input(&pose), Start::MeanShape).unwrap();
    assert_near(
        &stage.vertices(garment),
        fresh.garment().positions,
        NEAR_M,
        "after a pause",
    );
    assert!(stage.app.world().get::<GarmentState>(garment).is_some());
}

#[test]
fn a_runner_with_a_hitch_does_not_teleport() {
    let mut stage = Stage::new(1);
    let (character, joints) = stage.character();
    let limited = stage.garment(character, Display::Ticks);
    let unlimited = stage.garment(character, Display::Ticks);
    let mut worn = stage.app.world_mut().get_mut::<UnicGarment>(unlimited).unwrap();
    worn.teleport_speed = 0.0;
    for tick in 0..6 {
        stage.pose(&joints, &pose_at(&stage.model, tick as f32));
        stage.app.update();
    }
    // 5 m/s for a quarter of a second.
    let hitch = TimeUpdateStrategy::ManualDuration(Duration::from_millis(250));
    stage.app.insert_resource(hitch);
    let mut pose = pose_at(&stage.model, 6.0);
    pose.trans.z += 1.25;
    stage.pose(&joints, &pose);
    stage.app.update();
    assert_eq!(stage.vertices(limited), stage.vertices(unlimited));
}

#[test]
fn a_restored_state_goes_on_whatever_the_garment_did_before() {
    let mut stage = Stage::new(1);
    let (character, joints) = stage.character();
    let original = stage.garment(character, Display::Interpolated);
    let paused = stage.garment(character, Display::Interpolated);
    let mut worn = stage.app.world_mut().get_mut::<UnicGarment>(paused).unwrap();
    worn.is_paused = true;
    for tick in 0..6 {
        stage.pose(&joints, &pose_at(&stage.model, tick as f32));
        stage.app.update();
    }
    let saved = stage.state(original).save().unwrap();
    assert!(stage.state(paused).save().is_none(), "it has not begun");
    // Both continue there: the one from five metres away, the other from nowhere.
    let mut far = pose_at(&stage.model, 6.0);
    far.trans.x += 5.0;
    stage.pose(&joints, &far);
    stage.app.update();
    for garment in [original, paused] {
        stage.state(garment).restore(saved.clone()).unwrap();
    }
    let mut expected = Animator::new(Arc::clone(&stage.model));
    expected.restore(saved).unwrap();
    let pose = pose_at(&stage.model, 6.0);
    expected.step(&input(&pose)).unwrap();
    for (garment, what) in [(original, "from far away"), (paused, "after a pause")] {
        if garment == paused {
            let mut worn = stage.app.world_mut().get_mut::<UnicGarment>(paused).unwrap();
            worn.is_paused = false;
        }
        stage.pose(&joints, &pose);
        stage.app.update();
        assert_eq!(
            stage.state(garment).animator().state().ticks,
            expected.state().ticks
        );
        let found = stage.state(garment).animator().garment().positions.to_vec();
        assert_near(&found, expected.garment().positions, NEAR_M, what);
    }
}

#[test]
fn a_rig_that_does_not_fit_is_named_once() {
    let mut stage = Stage::new(1);
    let (character, joints) = stage.character();
    let elbow = stage.model.character().skeleton.joint("L_elbow").unwrap();
    stage
        .app
        .world_mut()
        .entity_mut(joints[elbow])
        .insert(Name::new("lower arm"));
    let garment = stage.garment(character, Display::Ticks);
    stage.app.update();
    let Some(GarmentFault::Rig(error)) = stage.app.world().get::<GarmentFault>(garment) else {
        panic!("a rig without an elbow");
    };
    let text = error.to_string();
    assert!(text.contains("expected the joints L_elbow, found none"), "{text}");
    // A namespace and capitals are no difference.
    stage
        .app
        .world_mut()
        .entity_mut(joints[elbow])
        .insert(Name::new("rig:l_ELBOW"));
    stage.app.world_mut().entity_mut(garment).remove::<GarmentFault>();
    stage.app.update();
    assert!(stage.app.world().get::<GarmentFault>(garment).is_none());
    assert!(stage.app.world().get::<GarmentState>(garment).is_some());
}

#[test]
fn sixteen_garments_have_the_same_bytes_as_one() {
    let mut stage = Stage::new(1);
    let (character, joints) = stage.character();
    let garments: Vec<Entity> = (0..16)
        .map(|_| stage.garment(character, Display::Ticks))
        .collect();
    for tick in 0..5 {
        let pose = pose_at(&stage.model, tick as f32);
        stage.pose(&joints, &pose);
        stage.app.update();
    }
    let first = stage.vertices(garments[0]);
    for garment in &garments[1..] {
        assert_eq!(stage.vertices(*garment), first);
    }
}

#[test]
fn a_character_that_is_scaled_by_axis_is_refused() {
    let mut stage = Stage::new(1);
    let (character, joints) = stage.character();
    let garment = stage.garment(character, Display::Ticks);
    let pose = pose_at(&stage.model, 0.0);
    stage.pose(&joints, &pose);
    let flat = Transform::from_scale(Vec3::new(1.0, 1.0, 0.5));
    stage.app.world_mut().entity_mut(character).insert(flat);
    // The garment is attached in one frame and stepped in the next.
    (0..2).for_each(|_| stage.app.update());
    let fault = stage
        .app
        .world()
        .get::<GarmentFault>(garment)
        .unwrap()
        .to_string();
    assert!(
        fault.contains("expected one positive scale along all axes, found 1.00, 1.00, 0.50"),
        "{fault}"
    );
}
