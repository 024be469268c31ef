//! The posed body, and vertices that are inside of it.

use crate::{
    GpuContext, GpuError,
    garment::{GarmentBuffers, is_in_frame},
    kernel::{Dispatch, Kernel, Source},
    mesh::{Mesh, SHOWN_BYTES},
    tree::Tree,
};
use unic_core::model::Model;
use wgpu::{Buffer, BufferUsages};

/// The body on the device. Asset.
#[derive(Debug)]
pub(crate) struct Body {
    mesh: Mesh,
    tree: Tree,
    pose: Kernel,
    /// The paper's intersection handling.
    drag: Kernel,
}

/// The posed body of one animator. Scratch.
#[derive(Debug)]
pub(crate) struct BodyBuffers {
    shown: Buffer,
    boxes: Buffer,
    /// By garment vertex: the body vertex that was nearest.
    seeds: Buffer,
}

impl BodyBuffers {
    pub(crate) fn new(context: &GpuContext, body: &Body, garment_vertices: usize) -> Self {
        Self {
            shown: context.zeroed("body", SHOWN_BYTES * body.mesh.count, BufferUsages::empty()),
            boxes: body.tree.boxes(context),
            seeds: context.upload("seeds", &vec![u32::MAX; garment_vertices]),
        }
    }
}

impl Body {
    pub(crate) fn new(context: &GpuContext, model: &Model) -> Self {
        let character = model.character();
        let text = [
            include_str!("kernels/places.wgsl"),
            include_str!("kernels/skin.wgsl"),
            include_str!("kernels/body.wgsl"),
        ]
        .concat();
        let mesh = Mesh::new(context, &character.body, &character.weights, &[]);
        let source = Source {
            text: &text,
            entry: "pose",
            constants: &[("VERTICES", mesh.count as f64)],
        };
        let tree = Tree::new(context, &character.body.vertices);
        Self {
            drag: drag(context, model, &tree),
            pose: Kernel::new(context, &source),
            mesh,
            tree,
        }
    }

    /// Poses the body: positions, normals, boxes.
    pub(crate) fn pose(&self, tick: &Buffer, of: &BodyBuffers) -> Result<Vec<Dispatch>, GpuError> {
        let buffers = [
            (0, tick),
            (1, &self.mesh.vertices),
            (2, &self.mesh.weights),
            (9, &of.shown),
        ];
        let mut dispatches = vec![
            self.pose.dispatch(&buffers, self.mesh.groups())?,
            self.mesh.normals(&of.shown)?,
        ];
        dispatches.extend(self.tree.refit(&of.boxes, &of.shown)?);
        Ok(dispatches)
    }

    /// The paper's intersection handling, which changes states.
    pub(crate) fn drag(
        &self,
        garment: GarmentBuffers,
        body: &BodyBuffers,
        groups: usize,
    ) -> Result<Dispatch, GpuError> {
        let buffers = [
            (0, garment.tick),
            (5, garment.points),
            (6, garment.states),
            (10, &self.tree.items),
            (11, &body.boxes),
            (12, &body.shown),
            (13, &body.seeds),
        ];
        self.drag.dispatch(&buffers, groups)
    }
}

fn drag(context: &GpuContext, model: &Model, tree: &Tree) -> Kernel {
    let text = [include_str!("kernels/places.wgsl"), include_str!("kernels/paper.wgsl")].concat();
    let source = Source {
        text: &text,
        entry: "drag",
        constants: &[
            ("VERTICES", model.vertex_count() as f64),
            ("IN_FRAME", f64::from(u8::from(is_in_frame(model)))),
            ("LEAVES_FROM", tree.leaves.first() as f64),
            ("CAPACITY", tree.leaves.capacity as f64),
            ("BODY_VERTICES", model.character().body.vertices.len() as f64),
        ],
    };
    Kernel::new(context, &source)
}
