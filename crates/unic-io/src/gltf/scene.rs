//! Tree of nodes and their transforms.

use super::container::Container;
use crate::error::Result;
use glam::{Mat4, Quat, Vec3};
use gltf::scene::Transform;

/// Transform of a node relative to its parent, in parts, as animations change it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    pub(super) translation: Vec3,
    pub(super) rotation: Quat,
    pub(super) scale: Vec3,
}

impl Local {
    fn matrix(self) -> Mat4 {
        Mat4::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }
}

/// Nodes of a file.
#[derive(Debug)]
pub(super) struct Scene {
    /// Name of each node; `node_3` where the file has none.
    pub(super) names: Vec<String>,
    pub(super) parents: Vec<Option<usize>>,
    /// Transforms outside any animation.
    pub(super) locals: Vec<Local>,
    /// Nodes in an order in which parents precede their children.
    pub(super) order: Vec<usize>,
}

impl Scene {
    /// Reads the nodes.
    ///
    /// # Errors
    /// Nodes with two parents, cycles, transforms that are not finite.
    pub(super) fn read(container: &Container) -> Result<Self> {
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
        let locals: Vec<Local> = nodes.iter().map(|node| local(node.transform())).collect();
        if let Some(node) = locals.iter().position(|local| !local.matrix().is_finite()) {
            let found = format!("others at node {node}");
            return Err(container.error("finite transforms", found));
        }
        let name = |node: &gltf::Node| match node.name() {
            Some(name) if !name.is_empty() => name.to_owned(),
            _ => format!("node_{}", node.index()),
        };
        let order = order(&parents).ok_or_else(|| container.error("a tree of nodes", "a cycle"))?;
        Ok(Self {
            names: nodes.iter().map(name).collect(),
            parents,
            locals,
            order,
        })
    }

    /// Computes `world_from_node` of all nodes into `out`, with the transforms of `locals`.
    pub(super) fn world(&self, locals: &[Local], out: &mut Vec<Mat4>) {
        out.clear();
        out.resize(self.parents.len(), Mat4::IDENTITY);
        for &node in &self.order {
            let local = locals[node].matrix();
            out[node] = self.parents[node].map_or(local, |parent| out[parent] * local);
        }
    }
}

fn local(transform: Transform) -> Local {
    let (translation, rotation, scale) = match transform {
        // The decomposition of the crate divides by a scale of zero.
        Transform::Matrix { matrix } => {
            let (scale, rotation, translation) =
                Mat4::from_cols_array_2d(&matrix).to_scale_rotation_translation();
            (translation, rotation, scale)
        }
        Transform::Decomposed {
            translation,
            rotation,
            scale,
        } => (translation.into(), Quat::from_array(rotation), scale.into()),
    };
    Local {
        translation,
        // Files round quaternions; one of length zero is no rotation.
        rotation: match rotation.length_squared() > f32::MIN_POSITIVE {
            true => rotation.normalize(),
            false => Quat::IDENTITY,
        },
        scale,
    }
}

/// Orders nodes so that parents come first; None if some are their own ancestors.
fn order(parents: &[Option<usize>]) -> Option<Vec<usize>> {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); parents.len()];
    for (node, parent) in parents.iter().enumerate() {
        if let Some(parent) = parent {
            children[*parent].push(node);
        }
    }
    let mut order: Vec<usize> = (0..parents.len())
        .filter(|node| parents[*node].is_none())
        .collect();
    let mut next = 0;
    while let Some(&node) = order.get(next) {
        order.extend_from_slice(&children[node]);
        next += 1;
    }
    (order.len() == parents.len()).then_some(order)
}
