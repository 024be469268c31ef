//! Contract of contact with a body:
//!
//! - Friction has Coulomb's cone and acceleration, and cloth does not creep on a moving body.
//! - No particle passes through a fast or thin body.
//! - Penetrations are undone without adding energy.
//! - Results have the same bytes for any number of threads.
//! - On a human body, particles are inside it in its folds only.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod scene;

use glam::{Quat, Vec3};
use scene::{GRAVITY, INTERVAL_S, SUBSTEPS, Scene, both, capsule, placed, sheet, sphere};
use std::path::Path;
use unic_core::{Pose, mesh::TriMesh, surface::Surface};
use unic_sim::contact::{ContactSettings, Friction};

const FRICTION: Friction = Friction {
    r#static: 0.5,
    dynamic: 0.4,
};

fn settings() -> ContactSettings {
    ContactSettings {
        body_friction: FRICTION,
        ..Default::default()
    }
}

/// Distances in metres that particles slide from rest in `seconds` down a triangulated plane that
/// is tilted by `angle` radians.
fn slide(angle: f32, seconds: f32) -> Vec<f32> {
    let tilt = Quat::from_rotation_z(-angle);
    let mut plane = sheet(60, 0.1);
    plane.vertices = placed(&plane, tilt, Vec3::ZERO);
    let at = |k: usize| tilt * Vec3::new(-2.5 + 0.013 * k as f32, 0.003, 0.017 * k as f32);
    let starts: Vec<Vec3> = (0..40).map(at).collect();
    let mut scene = Scene::new(&plane, starts.clone(), settings());
    for _ in 0..(seconds / INTERVAL_S).round() as usize {
        scene.advance(&plane.vertices);
    }
    let ends = scene.particles.positions.iter().zip(&starts);
    ends.map(|(end, start)| (tilt.inverse() * (*end - *start)).x)
        .collect()
}

#[test]
fn particles_stick_within_the_friction_cone() {
    // tan 25° = 0.466 < 0.5
    for distance in slide(25f32.to_radians(), 3.0) {
        assert!(distance.abs() < 1e-4, "crept {distance} m");
    }
}

#[test]
fn particles_slide_beyond_the_friction_cone_with_the_closed_form_acceleration() {
    let (angle, seconds) = (40f32.to_radians(), 1.0);
    let acceleration = -GRAVITY.y * (angle.sin() - FRICTION.dynamic * angle.cos());
    // Symplectic Euler is ahead of the parabola by half a substep.
    let dt = INTERVAL_S / SUBSTEPS as f32;
    let expected = 0.5 * acceleration * seconds * (seconds + dt);
    for distance in slide(angle, seconds) {
        // Positions round at 1e-7 m, and gravity presses by 3e-5 m in a substep.
        assert!(
            (distance / expected - 1.0).abs() < 5e-3,
            "{distance} m instead of {expected}"
        );
    }
}

#[test]
fn a_particle_on_a_moving_and_turning_box_does_not_creep_in_a_minute() {
    let mut box_ = sheet(8, 0.1);
    box_.vertices.iter_mut().for_each(|v| v.y += 0.3);
    let start = Vec3::new(0.11, 0.303, -0.07);
    let mut scene = Scene::new(&box_, vec![start], settings());
    let place = |t: f32| {
        let tilt = Quat::from_rotation_x(0.15 * (1.1 * t).sin()) * Quat::from_rotation_y(0.9 * t);
        (tilt, Vec3::new((0.8 * t).sin(), 0.1 * (2.0 * t).cos(), 0.4 * t))
    };
    let (tilt, shift) = place(0.0);
    scene.interval.reset(&placed(&box_, tilt, shift));
    scene.particles = scene::at_rest(vec![tilt * start + shift]);
    let speed = (place(INTERVAL_S).1 - shift) / INTERVAL_S;
    scene.particles.velocities = vec![speed];
    let mut first = None;
    for k in 1..=7200 {
        let (tilt, shift) = place(k as f32 * INTERVAL_S);
        scene.advance(&placed(&box_, tilt, shift));
        let on_box = tilt.inverse() * (scene.particles.positions[0] - shift);
        // The box ends 24 m from the origin, where f32 has a resolution of 2 µm. By that rounding
        // in every interval the particle creeps about 3 mm in a minute.
        let first = *first.get_or_insert(on_box);
        assert!(
            on_box.distance(first) < 4e-3,
            "{} s: {on_box} from {first}",
            k as f32 * INTERVAL_S
        );
    }
}

/// Particles on a square grid in the plane z = 0, around the origin.
fn curtain(half_width: f32, spacing: f32) -> Vec<Vec3> {
    let n = (half_width / spacing) as i32;
    let place = |x: i32, y: i32| Vec3::new(x as f32 * spacing, y as f32 * spacing, 0.0);
    (-n..=n)
        .flat_map(|x| (-n..=n).map(move |y| place(x, y)))
        .collect()
}

#[test]
fn fast_and_thin_bodies_never_pass_through_particles() {
    for (body, speed) in [
        (sphere(3, 0.06), 10.0),
        (capsule(0.03, 0.2), 5.0),
        (sphere(3, 0.02), 5.0),
    ] {
        let mut scene = Scene::new(&body, curtain(0.08, 0.01), settings());
        scene.gravity = Vec3::ZERO;
        let place = |t: f32| placed(&body, Quat::IDENTITY, Vec3::Z * (speed * t - 0.3));
        scene.interval.reset(&place(0.0));
        let dt = INTERVAL_S / SUBSTEPS as f32;
        for k in 1..=(0.6 / speed / INTERVAL_S) as usize {
            let before = scene.particles.positions.clone();
            scene.advance(&place(k as f32 * INTERVAL_S));
            let mut surface = Surface::build(&body);
            surface.refit(scene.interval.end());
            for (p, before) in scene.particles.positions.iter().zip(&before) {
                let hit = surface.closest(*p).unwrap();
                assert!(hit.signed_distance > 2e-3, "{p} is at {}", hit.signed_distance);
                // No jumps: a particle moves at most twice as fast as the body.
                assert!(p.distance(*before) < 2.0 * speed * dt * SUBSTEPS as f32 + 1e-3);
            }
        }
        let pushed = scene.particles.positions.iter().filter(|p| p.z > 0.05).count();
        assert!(pushed > 4, "{pushed} particles were pushed along");
    }
}

#[test]
fn penetrations_are_undone_at_the_recovery_speed_and_leave_no_velocity() {
    let body = sphere(4, 0.15);
    let directions = sphere(1, 1.0).vertices;
    let deep: Vec<Vec3> = directions.iter().map(|d| d * (0.15 - 0.021)).collect();
    let mut scene = Scene::new(&body, deep, settings());
    scene.gravity = Vec3::ZERO;
    let speed = scene.contacts.settings().recovery_m_per_s;
    let seconds = 0.024 / speed;
    let mut before = scene.particles.positions.clone();
    for k in 1..=(1.5 * seconds / INTERVAL_S) as usize {
        scene.advance(&body.vertices);
        for (p, last) in scene.particles.positions.iter().zip(&before) {
            assert!(
                p.distance(*last) < speed * INTERVAL_S + 1e-5,
                "a jump of {}",
                p.distance(*last)
            );
        }
        before.clone_from(&scene.particles.positions);
        if (k as f32) * INTERVAL_S < 0.8 * seconds {
            assert!(scene.particles.positions.iter().all(|p| p.length() < 0.151));
        }
    }
    for (p, v) in scene.particles.positions.iter().zip(&scene.particles.velocities) {
        assert!((p.length() - 0.153).abs() < 5e-4, "{}", p.length());
        assert!(v.length() < 1e-2, "left at {} m/s", v.length());
    }
}

#[test]
fn particles_rest_on_the_ground() {
    let settings = ContactSettings {
        ground_height_m: Some(-0.2),
        ..settings()
    };
    let mut scene = Scene::new(&TriMesh::default(), curtain(0.05, 0.02), settings);
    scene.particles.velocities.fill(Vec3::X);
    (0..240).for_each(|_| scene.advance(&[]));
    for (p, v) in scene.particles.positions.iter().zip(&scene.particles.velocities) {
        assert!((p.y + 0.197).abs() < 1e-6 && v.length() < 1e-4, "{p} at {v}");
    }
}

#[test]
fn particles_in_a_closing_fold_stay_slow_and_come_out_again() {
    // Two capsules as thick as arms around a sheet, pressed 3 cm into each other and opened again.
    let (left, right) = (capsule(0.05, 0.15), capsule(0.05, 0.15));
    let place = |gap: f32| {
        let aside = Vec3::X * (0.05 + 0.5 * gap);
        [
            placed(&left, Quat::IDENTITY, -aside),
            placed(&right, Quat::IDENTITY, aside),
        ]
        .concat()
    };
    let body = both(&left, &right);
    let mut sheet_between = curtain(0.08, 0.01);
    sheet_between
        .iter_mut()
        .for_each(|p| *p = Vec3::new(0.001, p.y, p.x));
    let mut scene = Scene::new(&body, sheet_between, settings());
    scene.gravity = Vec3::ZERO;
    scene.interval.reset(&place(0.05));
    for k in 1..=240 {
        let gap = 0.05 - 0.08 * (std::f32::consts::PI * k as f32 / 240.0).sin();
        scene.advance(&place(gap));
        for (p, v) in scene.particles.positions.iter().zip(&scene.particles.velocities) {
            assert!(p.is_finite() && v.length() < 1.0, "{p} at {v}, gap {gap}");
        }
    }
    // Half a second later all particles are outside.
    (0..60).for_each(|_| scene.advance(&place(0.05)));
    let mut surface = Surface::build(&body);
    surface.refit(scene.interval.end());
    for p in &scene.particles.positions {
        assert!(surface.closest(*p).unwrap().signed_distance > 2.5e-3, "{p}");
    }
}

fn sway(body: &TriMesh, positions: &[Vec3]) -> Scene {
    let mut scene = Scene::new(body, positions.to_vec(), settings());
    for k in 1..=60 {
        let turn = Quat::from_rotation_z(0.4 * (k as f32 * 0.1).sin());
        scene.advance(&placed(body, turn, Vec3::ZERO));
    }
    scene
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let body = sphere(3, 0.3);
    let positions: Vec<Vec3> = sphere(4, 0.31).vertices;
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| sway(&body, &positions).particles)
    };
    let one = with(1);
    assert_eq!(one, with(2));
    assert_eq!(one, with(5));
}

#[test]
fn particles_on_a_human_body_are_outside_except_in_folds() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/body/character.npz");
    if !file.exists() {
        eprintln!("skipped: {} is not there", file.display());
        return;
    }
    let character = unic_io::read_character(&file).unwrap();
    let (body, skeleton) = (&character.body, &character.skeleton);
    // Particles all over the body, every tenth one 21 mm inside. They fall freely.
    let mut normals = Vec::new();
    unic_core::mesh::vertex_normals(&body.vertices, &body.faces, &mut normals);
    let offset = |k: usize| if k.is_multiple_of(10) { -0.021 } else { 0.004 };
    let positions = (body.vertices.iter().zip(&normals).enumerate())
        .map(|(k, (v, n))| v + n * offset(k))
        .collect();
    let mut scene = Scene::new(body, positions, settings());
    let rest = skeleton.bind_pose();
    let (mut joints, mut from_rest, mut vertices) = (Vec::new(), Vec::new(), Vec::new());
    let mut pose_at = |t: f32, out: &mut Vec<Vec3>| {
        let mut pose: Pose = rest.clone();
        // Both arms down to the body and up, at up to 5 rad/s.
        let swing = 0.8 * (6.0 * t).sin();
        pose.local[16] = Quat::from_rotation_z(swing) * pose.local[16];
        pose.local[17] = Quat::from_rotation_z(-swing) * pose.local[17];
        skeleton.forward_kinematics(&pose, &mut joints);
        skeleton.world_from_rest(&joints, &mut from_rest);
        character.weights.skin(&body.vertices, &from_rest, out);
    };
    let mut surface = Surface::build(body);
    let (mut worst, mut inside, mut counted) = (0.0f32, 0, 0);
    for k in 1..=180 {
        pose_at(k as f32 * INTERVAL_S, &mut vertices);
        scene.advance(&vertices);
        surface.refit(&vertices);
        // In the first half second the particles that begin inside come out.
        for &p in scene.particles.positions.iter().filter(|_| k > 60) {
            assert!(p.is_finite());
            let hit = surface.closest(p).unwrap();
            let is_folded = scene.contacts.folds().is_face_folded(hit.face);
            let depth = if is_folded { 0.0 } else { -hit.signed_distance };
            worst = worst.max(depth);
            inside += usize::from(depth > 1e-3);
            counted += usize::from(!is_folded);
        }
    }
    let share = inside as f64 / counted as f64;
    eprintln!(
        "{:.3} % deeper than 1 mm, worst {} mm",
        100.0 * share,
        worst * 1e3
    );
    assert!(share < 2e-3, "{share} deeper than 1 mm, worst {worst} m");
}
