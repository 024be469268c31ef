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
    let stacks = || {
        let stacks = file.anim_stacks.iter();
        stacks.filter_map(|stack| Some((stack, range(stack)?)))
    };
    let name = |stack: &ufbx::AnimStack| match &*stack.element.name {
        "" => "without a name".to_owned(),
        name => name.to_owned(),
    };
    scene.animations = stacks().map(|(stack, _)| name(stack)).collect();
    let (Some((stack, [begin, end])), Content::Motion) = (stacks().next(), content) else {
        return Ok(());
    };
    let fps = file.settings.frames_per_second;
    if !(fps.is_finite() && fps > 0.0) {
        return Err(Fault::new("frames per second above 0", fps.to_string()));
    }
    // Saturates: a damaged time may be huge, and the length is checked next.
    let frames = (((end - begin) * fps).round() as usize).saturating_add(1);
    let animated = animated_nodes(stack, joints);
    check_length(frames, animated.len(), length)?;
    let track = |node: usize| {
        let locals = (0..frames).map(|frame| {
            let time = begin + frame as f64 / fps;
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

/// Times of the first and the last frame of an animation, seconds: its own, else those of its keys.
/// None if nothing moves.
fn range(stack: &ufbx::AnimStack) -> Option<[f64; 2]> {
    let stated = [stack.time_begin, stack.time_end];
    if stated[1] > stated[0] {
        return Some(stated);
    }
    let values = stack.layers.iter().flat_map(|layer| layer.anim_values.iter());
    let curves = values.flat_map(|value| value.curves.iter().flatten());
    let ends = curves.filter_map(|curve| Some([curve.keyframes.first()?.time, curve.keyframes.last()?.time]));
    let whole = ends.reduce(|[low, high], [first, last]| [low.min(first), high.max(last)])?;
    (whole[1] > whole[0]).then_some(whole)
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
