//! Tree of nodes and their transforms.

use super::container::Container;
use crate::error::Result;
use glam::{Mat4, Quat};
use gltf::scene::Transform;
use unic_scene::{Local, Node};

/// Reads the nodes.
///
/// # Errors
/// Nodes with two parents, transforms that are not finite.
pub(super) fn read(container: &Container) -> Result<Vec<Node>> {
    let nodes: Vec<_> = container.document.nodes().collect();
    let mut parents = vec![None; nodes.len()];
    for node in &nodes {
        for child in node.children() {
            let parent: &mut Option<usize> = &mut parents[child.index()];
            if let Some(other) = parent.replace(node.index()) {
                let found = format!("node {} below {other} and {}", child.index(), node.index());
                return Err(container.error("a tree of nodes", found));
            }
        }
    }
    let read = |(node, parent): (&gltf::Node, Option<usize>)| Node {
        name: name(node),
        parent,
        local: local(node.transform()),
    };
    Ok(nodes.iter().zip(parents).map(read).collect())
}

/// Name of a node; `node_3` where the file has none.
pub(super) fn name(node: &gltf::Node) -> String {
    let name = node.name().filter(|name| !name.is_empty());
    name.map_or_else(|| format!("node_{}", node.index()), str::to_owned)
}

fn local(transform: Transform) -> Local {
    match transform {
        // The decomposition of the crate divides by a scale of zero.
        Transform::Matrix { matrix } => {
            let local = Local::from_matrix(Mat4::from_cols_array_2d(&matrix));
            Local {
                rotation: unit(local.rotation),
                ..local
            }
        }
        Transform::Decomposed {
            translation,
            rotation,
            scale,
        } => Local {
            translation: translation.into(),
            rotation: unit(Quat::from_array(rotation)),
            scale: scale.into(),
        },
    }
}

/// Normalises a rotation: files round quaternions, and one of length zero is no rotation.
fn unit(rotation: Quat) -> Quat {
    match rotation.length_squared() > f32::MIN_POSITIVE {
        true => rotation.normalize(),
        false => Quat::IDENTITY,
    }
}
