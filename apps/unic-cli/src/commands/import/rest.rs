//! The rest shape of the garment.

use super::{animation::Animation, notes::Notes};
use crate::args::ImportArgs;
use crate::mesh_units::MeshUnits;
use anyhow::{Result, anyhow, bail};
use glam::{Mat3, Vec3};
use unic_core::{Pose, character::Character, mesh::TriMesh, skinning::SkinningWeights, transform::Rigid};
use unic_io::{Capture, capture::default_weights, read_obj};

/// First frame that is imported.
pub(super) struct FirstFrame<'a> {
    pub(super) character: &'a Character,
    pub(super) pose: &'a Pose,
    /// Frame of the garment.
    pub(super) frame: usize,
}

/// Returns the rest shape: that of `--rest`, of the capture, or the first frame of the animation,
/// moved back to the character's rest pose.
///
/// # Errors
/// No file with faces, a rest shape that is not that of the capture.
pub(super) fn rest(
    args: &ImportArgs,
    before: Option<&Capture>,
    animation: &mut Animation,
    first: &FirstFrame,
    notes: &mut Notes,
) -> Result<TriMesh> {
    if let Some(path) = &args.rest {
        let units = MeshUnits::stated(args.up, args.scale);
        let mesh = units.mesh(read_obj(path)?);
        units.notes().iter().for_each(|note| notes.add(path, note));
        if let Some(capture) = before {
            capture.check_same_rest(path, &mesh)?;
        }
        return Ok(mesh);
    }
    if let Some(capture) = before {
        return Ok(capture.garment.rest.clone());
    }
    let Some(mut mesh) = animation.mesh.clone() else {
        bail!(
            "{}: expected a rest shape with faces, found positions alone; give the garment's mesh as --rest \
             FILE.obj",
            args.garment.display()
        );
    };
    animation.frame(first.frame, &mut mesh.vertices)?;
    let text = format!(
        "no rest shape given: frame {} is taken, moved back to the rest pose with its wrinkles; --rest takes \
         the mesh as it was made",
        first.frame
    );
    notes.add(&args.garment, &text);
    unposed(mesh, first).map_err(|e| anyhow!("{}: {e}", args.garment.display()))
}

/// Moves a garment from a pose back to the rest pose: the inverse of linear blend skinning, with the
/// weights of the nearest vertices of the posed body.
fn unposed(mut garment: TriMesh, first: &FirstFrame) -> Result<TriMesh> {
    let Character {
        body,
        skeleton,
        weights,
        ..
    } = first.character;
    let (mut joints, mut transforms, mut vertices) = (Vec::new(), Vec::new(), Vec::new());
    skeleton.forward_kinematics(first.pose, &mut joints);
    skeleton.world_from_rest(&joints, &mut transforms);
    weights.skin(&body.vertices, &transforms, &mut vertices);
    let posed = Character {
        body: TriMesh {
            vertices,
            ..body.clone()
        },
        skeleton: skeleton.clone(),
        weights: weights.clone(),
        file_mesh: None,
    };
    let weights = default_weights(&garment, &posed)?;
    for (vertex, position) in garment.vertices.iter_mut().enumerate() {
        *position = rest_position(&weights, &transforms, vertex, *position);
    }
    Ok(garment)
}

fn rest_position(weights: &SkinningWeights, world_from_rest: &[Rigid], vertex: usize, world: Vec3) -> Vec3 {
    let (mut linear, mut offset) = (Mat3::ZERO, Vec3::ZERO);
    for (joint, weight) in weights.row(vertex) {
        let transform = world_from_rest[joint];
        linear += Mat3::from_quat(transform.rotation) * weight;
        offset += transform.translation * weight;
    }
    let rest = linear.inverse() * (world - offset);
    // Rotations by half a turn may cancel, so that no inverse exists. Such a vertex stays.
    if rest.is_finite() { rest } else { world }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_testdata::{Figure, clip};

    #[test]
    fn a_skinned_garment_is_moved_back_to_its_rest_shape() {
        let figure = Figure::tube();
        let clip = clip("walk", 0, 20);
        let frames = figure.skinned(&clip);
        let mut garment = figure.garment.rest.clone();
        garment.vertices.clone_from(&frames[19]);
        let first = FirstFrame {
            character: &figure.character,
            pose: &clip.poses[19],
            frame: 19,
        };
        let rest = unposed(garment, &first).unwrap();
        let far = (rest.vertices.iter().zip(&figure.garment.rest.vertices))
            .map(|(a, b)| a.distance(*b))
            .fold(0.0, f32::max);
        // The weights are those of the posed body, which are near those of the rest pose.
        assert!(far < 0.02, "{far} m");
    }
}
