//! Bounding volume hierarchy over the body's vertices or faces, built once in the bind pose and
//! refitted on the device.

use crate::{
    GpuContext, GpuError,
    kernel::{Dispatch, GROUP, Kernel, Source},
};
use glam::Vec3;
use wgpu::{Buffer, BufferUsages};

/// Largest number of items in a leaf.
const MAX_LEAF_ITEMS: usize = 6;
/// Largest number of leaves: 4⁹, because the stacks of the searches hold nine levels.
const MAX_LEAVES: usize = 1 << 18;
/// Entry of an empty place in a leaf, the same as in `tree.wgsl`.
const NO_ITEM: u32 = u32::MAX;

/// Leaves of a complete tree with four children a node. Asset.
// A complete tree needs no links: the children of a node follow from its number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Leaves {
    /// Items leaf after leaf, `capacity` for each; [`NO_ITEM`] fills up.
    pub(crate) items: Vec<u32>,
    /// Number of leaves, a power of four.
    pub(crate) count: usize,
    /// Number of places in each leaf.
    pub(crate) capacity: usize,
}

impl Leaves {
    /// Halves the items at medians of their positions until every leaf holds few enough.
    pub(crate) fn new(positions: &[Vec3]) -> Self {
        let mut count = 1;
        while positions.len() > count * MAX_LEAF_ITEMS {
            count *= 4;
        }
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        let mut parts = vec![&mut order[..]];
        while parts.len() < count {
            parts = parts
                .into_iter()
                .flat_map(|part| halves(part, positions))
                .collect();
        }
        let capacity = parts.iter().map(|part| part.len()).max().unwrap_or(0).max(1);
        let mut items = vec![NO_ITEM; count * capacity];
        for (leaf, part) in items.chunks_exact_mut(capacity).zip(&parts) {
            leaf[..part.len()].copy_from_slice(part);
        }
        Self {
            items,
            count,
            capacity,
        }
    }

    /// Number of the first leaf, which is the number of nodes above the leaves: a geometric series.
    pub(crate) fn first(&self) -> usize {
        (self.count - 1) / 3
    }

    fn nodes(&self) -> usize {
        self.first() + self.count
    }
}

/// Splits items into the lower and the upper half along the axis of widest spread.
fn halves<'a>(part: &'a mut [u32], positions: &[Vec3]) -> [&'a mut [u32]; 2] {
    let at = |item: u32| positions[item as usize];
    let low = part.iter().fold(Vec3::INFINITY, |low, &i| low.min(at(i)));
    let high = part.iter().fold(Vec3::NEG_INFINITY, |high, &i| high.max(at(i)));
    let axis = (high - low).max_position();
    let middle = part.len() / 2;
    if part.len() > 1 {
        // Ties are broken by number, so that the halves are unique.
        part.select_nth_unstable_by(middle, |&a, &b| {
            at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(&b))
        });
    }
    let (lower, upper) = part.split_at_mut(middle);
    [lower, upper]
}

/// Kind of the items of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Items {
    Vertices,
    Faces,
}

impl Items {
    /// WGSL that names the body's vertices at the corners of an item.
    fn source(self) -> &'static str {
        match self {
            Self::Vertices => {
                "const CORNERS = 1u;
                 fn corner_of(item: u32, corner: u32) -> u32 { return item; }"
            }
            Self::Faces => {
                "const CORNERS = 3u;
                 // A face is two vectors of four, see `robust.wgsl`.
                 @group(0) @binding(3) var<storage, read> faces: array<vec4<u32>>;
                 fn corner_of(item: u32, corner: u32) -> u32 { return faces[2u * item][corner]; }"
            }
        }
    }
}

/// Tree on the device. Asset.
#[derive(Debug)]
pub(crate) struct Tree {
    leaves: Leaves,
    pub(crate) items: Buffer,
    refit_leaves: Kernel,
    refit_nodes: Kernel,
}

impl Tree {
    /// Builds a tree over items at these positions in the bind pose.
    ///
    /// # Errors
    /// Fails when there are too many items.
    pub(crate) fn new(context: &GpuContext, items: Items, positions: &[Vec3]) -> Result<Self, GpuError> {
        let leaves = Leaves::new(positions);
        if leaves.count > MAX_LEAVES {
            return Err(GpuError::TooLarge {
                what: "the vertices or faces of the body",
                limit: MAX_LEAVES * MAX_LEAF_ITEMS,
                found: positions.len(),
            });
        }
        let text = include_str!("kernels/tree.wgsl").replace("//{items}", items.source());
        let kernel = |entry: &str, constants: &[(&str, f64)]| {
            let source = Source {
                text: &text,
                entry,
                constants,
            };
            Kernel::new(context, &source)
        };
        let sizes = [
            ("FIRST_LEAF", leaves.first() as f64),
            ("LEAVES", leaves.count as f64),
        ];
        let capacity = ("CAPACITY", leaves.capacity as f64);
        Ok(Self {
            items: context.upload("items", &leaves.items),
            refit_leaves: kernel("refit_leaves", &[sizes[0], sizes[1], capacity]),
            refit_nodes: kernel("refit_nodes", &sizes),
            leaves,
        })
    }

    /// Constants of `nearest.wgsl` for a number of items.
    pub(crate) fn constants(&self, items: usize) -> [(&'static str, f64); 3] {
        [
            ("FIRST_LEAF", self.leaves.first() as f64),
            ("CAPACITY", self.leaves.capacity as f64),
            ("ITEMS", items as f64),
        ]
    }

    /// Buffer for the boxes of one posed body. Scratch.
    pub(crate) fn boxes(&self, context: &GpuContext) -> Buffer {
        context.zeroed("boxes", 32 * self.leaves.nodes(), BufferUsages::empty())
    }

    /// Refits the boxes to the posed body; `faces` must be given for a tree over faces.
    pub(crate) fn refit(
        &self,
        boxes: &Buffer,
        body: &Buffer,
        faces: Option<&Buffer>,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let mut buffers = vec![(0, &self.items), (1, boxes), (2, body)];
        buffers.extend(faces.map(|faces| (3, faces)));
        let groups = self.leaves.count.div_ceil(GROUP);
        let mut dispatches = vec![self.refit_leaves.dispatch(&buffers, groups)?];
        if self.leaves.count > 1 {
            // One workgroup refits all levels: barriers do not reach across workgroups.
            dispatches.push(self.refit_nodes.dispatch(&[(1, boxes)], 1)?);
        }
        Ok(dispatches)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_in_one_leaf_and_leaf_sizes_differ_by_one_at_most() {
        for count in [0, 1, 6, 7, 24, 25, 1000] {
            let point = |i: usize| Vec3::new((i as f32 * 0.7).sin(), (i as f32 * 1.3).cos(), i as f32 * 1e-3);
            let positions: Vec<Vec3> = (0..count).map(point).collect();
            let leaves = Leaves::new(&positions);
            let mut items = leaves.items.clone();
            items.retain(|&i| i != NO_ITEM);
            items.sort_unstable();
            assert!(items.iter().copied().eq(0..count as u32));
            assert!(
                leaves.capacity <= MAX_LEAF_ITEMS && leaves.items.len() == leaves.count * leaves.capacity
            );
            let filled = |leaf: &[u32]| leaf.iter().filter(|&&i| i != NO_ITEM).count();
            let sizes = leaves.items.chunks(leaves.capacity).map(filled);
            assert!(sizes.clone().max().unwrap() - sizes.min().unwrap() <= 1);
        }
    }

    #[test]
    fn neighbours_in_space_share_a_leaf() {
        let line: Vec<Vec3> = (0..96).map(|i| Vec3::X * (i * 37 % 96) as f32).collect();
        let leaves = Leaves::new(&line);
        for leaf in leaves.items.chunks(leaves.capacity) {
            let places = leaf
                .iter()
                .filter(|&&i| i != NO_ITEM)
                .map(|&i| line[i as usize].x);
            let (low, high) = places.fold((f32::INFINITY, 0f32), |(a, b), x| (a.min(x), b.max(x)));
            assert!(high - low < 6.0, "{leaf:?}");
        }
    }
}
