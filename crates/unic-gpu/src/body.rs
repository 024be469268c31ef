//! Posed body on the device, and the correction of vertices inside it.

mod robust;

use crate::{
    GpuContext, GpuError, GpuModel,
    animator::Buffers,
    garment::is_in_frame,
    kernel::{Dispatch, GROUP, Kernel, Source},
    mesh::{Mesh, SHOWN_BYTES},
    tree::{Items, Tree},
};
use robust::RobustRule;
use unic_core::{Corrects, Model};
use wgpu::{Buffer, BufferUsages};

/// WGSL that the kernels of both rules share.
const VERTEX_STATE: &str = include_str!("kernels/vertex_state.wgsl");
const NEAREST: &str = include_str!("kernels/nearest.wgsl");

/// Body on the device. Asset.
#[derive(Debug)]
pub(crate) struct Body {
    mesh: Mesh,
    pose: Kernel,
    paper: PaperRule,
    robust: RobustRule,
}

/// Intersection handling of the paper. Asset.
#[derive(Debug)]
struct PaperRule {
    /// Tree over the body's vertices.
    tree: Tree,
    drag: Kernel,
}

/// Dispatches of intersection handling.
pub(crate) struct Handling {
    /// Dispatches that pose the body.
    pub(crate) pose: Vec<Dispatch>,
    /// Dispatches that move vertices out of the body.
    pub(crate) correct: Vec<Dispatch>,
    /// Dispatches that give shown positions their edge lengths back and smooth their moves after that.
    /// Empty without a strain projection.
    pub(crate) relax: Vec<Dispatch>,
}

impl Body {
    pub(crate) fn new(context: &GpuContext, model: &Model) -> Result<Self, GpuError> {
        let character = model.character();
        let text = [
            VERTEX_STATE,
            include_str!("kernels/skin.wgsl"),
            include_str!("kernels/body.wgsl"),
        ]
        .concat();
        // The body has no prior, so its mean displacements are empty.
        let mesh = Mesh::new(context, &character.body, &character.weights, &[]);
        let source = Source {
            text: &text,
            entry: "pose",
            constants: &[("VERTICES", mesh.count as f64)],
        };
        Ok(Self {
            pose: Kernel::new(context, &source),
            paper: PaperRule::new(context, model)?,
            robust: RobustRule::new(context, model)?,
            mesh,
        })
    }

    /// Makes the dispatches that move states out of the body by the paper's rule.
    pub(crate) fn paper(
        &self,
        context: &GpuContext,
        buffers: &Buffers,
        model: &Model,
    ) -> Result<Handling, GpuError> {
        let PaperRule { tree, drag } = &self.paper;
        let scratch = Scratch::new(context, self, tree, model);
        let mut bindings = scratch.bindings(tree).to_vec();
        bindings.extend([(0, &buffers.tick), (5, &buffers.points), (6, &buffers.states)]);
        Ok(Handling {
            pose: self.pose(&buffers.tick, &scratch, tree, None)?,
            correct: vec![drag.dispatch(&bindings, model.vertex_count().div_ceil(GROUP))?],
            relax: Vec::new(),
        })
    }

    /// Makes the dispatches that move shown positions out of the body by the robust rule.
    pub(crate) fn robust(
        &self,
        asset: &GpuModel,
        buffers: &Buffers,
        corrects: Corrects,
    ) -> Result<Handling, GpuError> {
        let (rule, context) = (&self.robust, &asset.context);
        let scratch = Scratch::new(context, self, &rule.tree, &asset.model);
        let projection = asset.projection.as_ref();
        let relax = projection.map(|projection| rule.relax(context, buffers, &scratch, projection));
        Ok(Handling {
            pose: self.pose(&buffers.tick, &scratch, &rule.tree, Some(&rule.faces))?,
            correct: rule.correct(context, corrects, buffers, &scratch)?,
            relax: relax.transpose()?.unwrap_or_default(),
        })
    }

    /// Makes the dispatches that skin the body, compute its normals and refit the tree.
    fn pose(
        &self,
        tick: &Buffer,
        scratch: &Scratch,
        tree: &Tree,
        faces: Option<&Buffer>,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let buffers = [
            (0, tick),
            (1, &self.mesh.vertices),
            (2, &self.mesh.weights),
            (9, &scratch.body),
        ];
        let mut dispatches = vec![
            self.pose.dispatch(&buffers, self.mesh.groups())?,
            self.mesh.normals(&scratch.body)?,
        ];
        dispatches.extend(tree.refit(&scratch.boxes, &scratch.body, faces)?);
        Ok(dispatches)
    }
}

/// Posed body of one animator.
struct Scratch {
    body: Buffer,
    boxes: Buffer,
    /// Nearest item of each garment vertex in the last frame, and what else `robust.wgsl` stores.
    seeds: Buffer,
}

impl Scratch {
    fn new(context: &GpuContext, body: &Body, tree: &Tree, model: &Model) -> Self {
        let vertices = model.vertex_count();
        // A face and a mark for each vertex, a mark for all of them, and what the first push leaves.
        let mut seeds = vec![0; (2 + robust::PUSHED_WORDS) * vertices + 1];
        seeds[..vertices].fill(u32::MAX);
        Self {
            body: context.zeroed("body", SHOWN_BYTES * body.mesh.count, BufferUsages::empty()),
            boxes: tree.boxes(context),
            // Each animator has its own seeds: the nearest items of one say nothing about another.
            seeds: context.upload("seeds", &seeds),
        }
    }

    /// Buffers with their binding numbers in `nearest.wgsl`.
    fn bindings<'a>(&'a self, tree: &'a Tree) -> [(u32, &'a Buffer); 4] {
        [
            (10, &tree.items),
            (11, &self.boxes),
            (12, &self.body),
            (13, &self.seeds),
        ]
    }
}

impl PaperRule {
    fn new(context: &GpuContext, model: &Model) -> Result<Self, GpuError> {
        let vertices = &model.character().body.vertices;
        let tree = Tree::new(context, Items::Vertices, vertices)?;
        let text = [VERTEX_STATE, NEAREST, include_str!("kernels/paper.wgsl")].concat();
        let own = [
            ("VERTICES", model.vertex_count() as f64),
            ("IN_FRAME", f64::from(u8::from(is_in_frame(model)))),
        ];
        let source = Source {
            text: &text,
            entry: "drag",
            constants: &[&own[..], &tree.constants(vertices.len())].concat(),
        };
        Ok(Self {
            drag: Kernel::new(context, &source),
            tree,
        })
    }
}
