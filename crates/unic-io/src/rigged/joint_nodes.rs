//! Joints of a file as a tree with one root.

use super::file::SceneFile;
use crate::error::Result;
use std::collections::{HashMap, HashSet};

/// Joints as a tree with one root, which is the first.
pub(super) struct JointNodes {
    /// Node of each joint.
    pub(super) nodes: Vec<usize>,
    /// Index of each joint's parent among the joints.
    pub(super) parents: Vec<Option<usize>>,
    /// Descriptions of what was changed, one sentence each.
    pub(super) notes: Vec<String>,
}

impl JointNodes {
    /// Connects joints. Several roots are joined by the node above all of them. A root that is not
    /// among `moving` and has one child is left out, so that the joint that moves the body is the
    /// root.
    ///
    /// # Errors
    /// Several roots without a node above them.
    pub(super) fn new(scene: &SceneFile, nodes: &[usize], moving: &HashSet<usize>) -> Result<Self> {
        let mut set: HashSet<usize> = nodes.iter().copied().collect();
        let mut notes = Vec::new();
        let roots = roots(scene, &set);
        if let [one, another, ..] = roots[..] {
            let names = [one, another].map(|node| scene.name(node));
            let Some(above) = node_above(scene, &roots) else {
                let found = format!("{}: {} and others", roots.len(), names.join(", "));
                return Err(scene.error("one root of the skeleton", found));
            };
            notes.push(format!(
                "{} roots are joined by the node {}",
                roots.len(),
                scene.name(above)
            ));
            set.insert(above);
        }
        let root = moving_root(scene, &mut set, moving, &mut notes);
        // In the order of the file, the root first.
        let mut seen = HashSet::new();
        let ordered: Vec<usize> = (std::iter::once(root).chain(nodes.iter().copied()))
            .filter(|node| set.contains(node) && seen.insert(*node))
            .collect();
        let places = ordered.iter().enumerate();
        let places: HashMap<usize, usize> = places.map(|(index, node)| (*node, index)).collect();
        let above = nearest_above(scene, &set);
        let parent = |node: &usize| above[*node].and_then(|parent| places.get(&parent).copied());
        Ok(Self {
            parents: ordered.iter().map(parent).collect(),
            nodes: ordered,
            notes,
        })
    }
}

/// Nearest node of a set above each node.
fn nearest_above(scene: &SceneFile, set: &HashSet<usize>) -> Vec<Option<usize>> {
    let mut above = vec![None; scene.len()];
    for &node in scene.order() {
        // Parents come first, so that theirs is known.
        above[node] = match scene.parent(node) {
            Some(parent) if set.contains(&parent) => Some(parent),
            Some(parent) => above[parent],
            None => None,
        };
    }
    above
}

/// Nodes of a set without another one above them, ascending.
fn roots(scene: &SceneFile, set: &HashSet<usize>) -> Vec<usize> {
    let above = nearest_above(scene, set);
    let mut roots: Vec<usize> = set
        .iter()
        .copied()
        .filter(|node| above[*node].is_none())
        .collect();
    roots.sort_unstable();
    roots
}

/// The lowest node above all of `roots`.
fn node_above(scene: &SceneFile, roots: &[usize]) -> Option<usize> {
    let mut below = vec![0; scene.len()];
    roots.iter().for_each(|root| below[*root] += 1);
    for &node in scene.order().iter().rev() {
        if let Some(parent) = scene.parent(node) {
            below[parent] += below[node];
        }
    }
    let first = *roots.first()?;
    let mut above = std::iter::successors(scene.parent(first), |&node| scene.parent(node));
    above.find(|node| below[*node] == roots.len())
}

/// Takes joints that move nothing out of the top of the set, and returns the root that remains.
fn moving_root(
    scene: &SceneFile,
    set: &mut HashSet<usize>,
    moving: &HashSet<usize>,
    notes: &mut Vec<String>,
) -> usize {
    let above = nearest_above(scene, set);
    let mut children: HashMap<usize, Vec<usize>> = HashMap::new();
    for &node in set.iter() {
        if let Some(parent) = above[node] {
            children.entry(parent).or_default().push(node);
        }
    }
    // One root: several were joined before, and a skin has at least one joint.
    let mut root = set
        .iter()
        .copied()
        .find(|node| above[*node].is_none())
        .unwrap_or_default();
    while let Some([child]) = children.get(&root).map(Vec::as_slice)
        && !moving.contains(&root)
    {
        notes.push(format!(
            "the joint {} moves no vertex and is left out: {} is the root",
            scene.name(root),
            scene.name(*child)
        ));
        set.remove(&root);
        root = *child;
    }
    root
}
