//! Contract of the data that passes keep from frame to frame: it saves work and changes no bit.

use super::*;
use crate::parallel::{Serial, install};
use glam::Quat;

/// A body and a garment around it in one frame.
#[derive(Clone, Debug)]
struct Frame {
    body_radii: Vec<f32>,
    cloth_radii: Vec<f32>,
    /// Position of both; far from the origin after a teleport.
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

/// Kind of garment and obstacles.
#[derive(Clone, Copy, Debug)]
enum Scene {
    Plain,
    /// Garment in which every face has corners of its own.
    Seams,
    Props,
    Layers,
}

const SCENES: [Scene; 4] = [Scene::Plain, Scene::Seams, Scene::Props, Scene::Layers];

impl Scene {
    /// Garment at these radii.
    fn cloth(self, radii: &[f32], at: Vec3) -> TriMesh {
        let ball = uneven(3, radii, at);
        match self {
            Self::Plain | Self::Props => ball,
            Self::Seams => split(&ball),
            Self::Layers => joined(ball, uneven(2, radii, at)),
        }
    }

    fn colliders(self, at: Vec3) -> Vec<Collider> {
        match self {
            Self::Props => vec![
                Collider::sphere(0.1, at + Vec3::X * 0.2),
                Collider::ground(at.y - 0.15),
            ],
            _ => vec![],
        }
    }

    fn pass(self, character: &Character, garment: &Garment, body: &RobustBody) -> DisplayPass {
        let mut pass = DisplayPass::new(RULE, garment, body);
        if let Self::Layers = self {
            pass.set_layers(&Layers::from_components(character, garment));
        }
        pass
    }
}

/// Ball with a different radius at each vertex; the list of radii repeats.
fn uneven(level: usize, radii: &[f32], at: Vec3) -> TriMesh {
    let mut mesh = sphere(level, 1.0);
    let pairs = mesh.vertices.iter_mut().zip(radii.iter().cycle());
    pairs.for_each(|(v, r)| *v = *v * *r + at);
    mesh
}

/// Shown positions of each frame, by one pass for all or by a new one every time.
fn run(scene: Scene, frames: &[Frame], is_new_every_time: bool) -> Vec<Vec<Vec3>> {
    let character = character(sphere(3, 0.15), &[-1], |_| 0);
    let garment = garment(scene.cloth(&[0.2], Vec3::ZERO), 1, |_| 0);
    let mut body = RobustBody::new(&character, &garment);
    let mut pass = scene.pass(&character, &garment, &body);
    let show = |frame: &Frame| {
        let vertices = uneven(3, &frame.body_radii, frame.at).vertices;
        let mut positions = scene.cloth(&frame.cloth_radii, frame.at).vertices;
        if is_new_every_time {
            body = RobustBody::new(&character, &garment);
            pass = scene.pass(&character, &garment, &body);
        }
        body.pose(&vertices);
        let posed = CollisionScene {
            body: &body,
            vertices: &vertices,
            colliders: &scene.colliders(frame.at),
            skinned: Some(SkinnedGarment {
                garment: &garment,
                world_from_rest: &[Rigid::new(Quat::IDENTITY, frame.at)],
                closing_share: 1.0,
            }),
        };
        pass.apply(posed, &mut positions);
        positions
    };
    frames.iter().map(show).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn positions_do_not_depend_on_earlier_frames_or_threads(frames in vec(frame(), 2..5)) {
        for scene in SCENES {
            let shown = run(scene, &frames, false);
            prop_assert_eq!(&shown, &run(scene, &frames, true), "{:?}", scene);
            prop_assert_eq!(&shown, &install(Arc::new(Serial), || run(scene, &frames, false)), "{:?}", scene);
            let moved = frames.iter().zip(&shown).any(|(frame, shown)| {
                *shown != scene.cloth(&frame.cloth_radii, frame.at).vertices
            });
            prop_assert!(moved, "{:?}", scene);
        }
    }
}
