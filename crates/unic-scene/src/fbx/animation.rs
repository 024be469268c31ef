//! Motion of FBX files: the curves of the first animation, sampled at the file's frame rate.

use super::local_of;
use crate::{
    fault::Fault,
    request::Content,
    sampling::check_length,
    scene::{Motion, Scene, Track},
};

/// Adds the names of the animations, and the samples of the first if they are asked for. `joints`
/// marks the nodes that are bones.
pub(super) fn read(
    file: &ufbx::Scene,
    joints: &[bool],
    content: Content,
    length: usize,
    scene: &mut Scene,
) -> Result<(), Fault> {
    let stacks = || file.anim_stacks.iter().filter(|stack| seconds(stack) > 0.0);
    let name = |stack: &ufbx::AnimStack| match &*stack.element.name {
        "" => "without a name".to_owned(),
        name => name.to_owned(),
    };
    scene.animations = stacks().map(|stack| name(stack)).collect();
    let (Some(stack), Content::Motion) = (stacks().next(), content) else {
        return Ok(());
    };
    let fps = file.settings.frames_per_second;
    if !(fps.is_finite() && fps > 0.0) {
        return Err(Fault::new("frames per second above 0", fps.to_string()));
    }
    // Saturates: a damaged time may be huge, and the length is checked next.
    let frames = ((seconds(stack) * fps).round() as usize).saturating_add(1);
    let animated = animated_nodes(stack, joints);
    check_length(frames, animated.len(), length)?;
    let track = |node: usize| {
        let locals = (0..frames).map(|frame| {
            let time = stack.time_begin + frame as f64 / fps;
            local_of(&ufbx::evaluate_transform(&stack.anim, &file.nodes[node], time))
        });
        Track {
            node,
            locals: locals.collect(),
        }
    };
    scene.motion = Some(Motion {
        name: Some(name(stack)),
        fps: fps as f32,
        rate: "as the file states".to_owned(),
        frames,
        tracks: animated.into_iter().map(track).collect(),
    });
    Ok(())
}

fn seconds(stack: &ufbx::AnimStack) -> f64 {
    stack.time_end - stack.time_begin
}

/// Bones, and other nodes that an animation moves, ascending.
fn animated_nodes(stack: &ufbx::AnimStack, joints: &[bool]) -> Vec<usize> {
    let mut is_animated = joints.to_vec();
    for property in stack.layers.iter().flat_map(|layer| layer.anim_props.iter()) {
        let element = &property.element;
        if element.type_ == ufbx::ElementType::Node
            && let Some(node) = is_animated.get_mut(element.typed_id as usize)
        {
            *node = true;
        }
    }
    let nodes = is_animated.iter().enumerate();
    nodes.filter_map(|(node, is)| is.then_some(node)).collect()
}
