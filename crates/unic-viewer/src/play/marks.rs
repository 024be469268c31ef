//! Marks on the floor of a play.

use crate::Mark;
use glam::{Vec2, Vec3};
use unic_core::motion_matching::Controller;

/// Height of marks above the floor, metres: they would flicker within it.
const HEIGHT_M: f32 = 0.004;

/// Path that the object of a character is about to take, the object, and the target of the mouse if
/// there is one, (x, z) metres.
pub(super) fn marks(controller: &Controller, target: Option<Vec2>) -> Vec<Mark> {
    let on_floor = |p: Vec2| Vec3::new(p.x, HEIGHT_M, p.y);
    let object = controller.state().object().root();
    let path: Vec<Vec3> = (controller.future().iter())
        .map(|root| on_floor(root.position))
        .collect();
    let mut marks = vec![
        Mark::ribbon(&path, 0.03, [0.98, 0.62, 0.15, 0.85]),
        Mark::ring(on_floor(object.position), 0.26, 0.018, [1.0, 1.0, 1.0, 0.55]),
    ];
    let ring = |target| Mark::ring(on_floor(target), 0.09, 0.03, [0.20, 0.75, 0.95, 0.9]);
    marks.extend(target.map(ring));
    marks
}
