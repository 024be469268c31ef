//! Intersection handling of single vertices, with which devices are compared.

use glam::Vec3;
use unic_core::{
    Model, Pose,
    intersection::{CollisionScene, DisplayPass, RobustBody, RobustIntersection, SkinnedGarment},
    transform::Rigid,
};

/// Moves each vertex of a garment out of a posed body, without its neighbours.
pub fn correct_each(
    model: &Model,
    pose: &Pose,
    (rule, body): (RobustIntersection, &RobustBody),
    positions: &mut [Vec3],
) {
    let garment = model.garment();
    let scene = CollisionScene {
        body,
        // Only faces that are lifted need the body's vertices.
        vertices: &[],
        colliders: &[],
        skinned: Some(SkinnedGarment {
            garment,
            world_from_rest: &world_from_rest(model, pose),
            closing_share: 1.0,
        }),
    };
    let mut pass = DisplayPass::new(rule, garment, body);
    pass.find_contacts(scene, positions);
    pass.find_corrections(scene);
    pass.move_each(body, positions);
}

/// Returns the transforms of the joints from their rest in a pose.
fn world_from_rest(model: &Model, pose: &Pose) -> Vec<Rigid> {
    let skeleton = &model.character().skeleton;
    let (mut joints, mut world_from_rest) = (Vec::new(), Vec::new());
    skeleton.forward_kinematics(pose, &mut joints);
    skeleton.world_from_rest(&joints, &mut world_from_rest);
    world_from_rest
}

/// Returns the positions of a garment by linear blend skinning alone, with its carriers.
pub fn skinned_garment(model: &Model, pose: &Pose) -> Vec<Vec3> {
    let garment = model.garment();
    let (world_from_rest, mut positions) = (world_from_rest(model, pose), Vec::new());
    (garment.carriers()).skin(&garment.rest.vertices, &world_from_rest, &mut positions);
    positions
}
