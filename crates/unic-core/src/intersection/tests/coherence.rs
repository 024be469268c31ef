//! Contract of what is carried from frame to frame: it saves work, and changes no bit.

use super::*;
use crate::parallel::{Serial, install};

/// A body and a garment around it in one frame.
#[derive(Clone, Debug)]
struct Frame {
    body_radii: Vec<f32>,
    cloth_radii: Vec<f32>,
    /// Of both; far where they have been teleported.
    at: Vec3,
}

fn frame() -> impl Strategy<Value = Frame> {
    let at = prop_oneof![3 => Just(Vec3::ZERO), 1 => point(50.0)];
    (vec(0.13f32..0.16, 42), vec(0.125f32..0.24, 42), at).prop_map(|(body_radii, cloth_radii, at)| Frame {
        body_radii,
        cloth_radii,
        at,
    })
}

/// A ball whose radii repeat.
fn uneven(level: usize, radii: &[f32], at: Vec3) -> TriMesh {
    let mut mesh = sphere(level, 1.0);
    let pairs = mesh.vertices.iter_mut().zip(radii.iter().cycle());
    pairs.for_each(|(v, r)| *v = *v * *r + at);
    mesh
}

/// What is shown of each frame; by one pass, or by a new one every time.
fn run(frames: &[Frame], is_new_every_time: bool) -> Vec<Vec<Vec3>> {
    let (mut body, garment) = rigid(sphere(3, 0.15), sphere(3, 0.2));
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    let show = |frame: &Frame| {
        let vertices = uneven(3, &frame.body_radii, frame.at).vertices;
        let mut positions = uneven(3, &frame.cloth_radii, frame.at).vertices;
        if is_new_every_time {
            body = rigid(sphere(3, 0.15), sphere(3, 0.2)).0;
            pass = DisplayPass::new(RULE, &garment, &body);
        }
        body.pose(&vertices);
        let posed = PosedVertices {
            body: &body,
            vertices: &vertices,
            colliders: &[],
        };
        pass.apply(posed, &mut positions);
        positions
    };
    frames.iter().map(show).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn the_frames_before_and_the_threads_change_nothing(frames in vec(frame(), 2..5)) {
        let shown = run(&frames, false);
        prop_assert_eq!(&shown, &run(&frames, true));
        prop_assert_eq!(&shown, &install(Arc::new(Serial), || run(&frames, false)));
        let moved = frames.iter().zip(&shown).any(|(frame, shown)| {
            *shown != uneven(3, &frame.cloth_radii, frame.at).vertices
        });
        prop_assert!(moved);
    }
}
