//! Posed body on the device, and the correction of vertices inside it.

use crate::{
    GpuContext, GpuError,
    animator::Buffers,
    garment::is_in_frame,
    kernel::{Dispatch, GROUP, Kernel, Source},
    mesh::{Mesh, SHOWN_BYTES},
    tree::{Items, Tree},
};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use unic_core::{Model, intersection::ContactFilter, topology::weld};
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

/// Robust intersection handling, for each vertex by itself. Asset.
#[derive(Debug)]
struct RobustRule {
    /// Tree over the body's faces.
    tree: Tree,
    faces: Buffer,
    /// Faces around vertices and sets of joints, see `robust.wgsl`.
    tables: Buffer,
    push: Kernel,
}

/// Dispatches of intersection handling.
pub(crate) struct Handling {
    /// Dispatches that pose the body.
    pub(crate) pose: Vec<Dispatch>,
    /// Dispatch that moves vertices out of the body.
    pub(crate) correct: Dispatch,
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
            correct: drag.dispatch(&bindings, model.vertex_count().div_ceil(GROUP))?,
        })
    }

    /// Makes the dispatches that move shown positions out of the body by the robust rule.
    pub(crate) fn robust(
        &self,
        context: &GpuContext,
        buffers: &Buffers,
        model: &Model,
    ) -> Result<Handling, GpuError> {
        let RobustRule {
            tree,
            faces,
            tables,
            push,
        } = &self.robust;
        let scratch = Scratch::new(context, self, tree, model);
        let mut bindings = scratch.bindings(tree).to_vec();
        bindings.extend([(0, &buffers.tick), (9, &buffers.shown), (14, faces), (15, tables)]);
        Ok(Handling {
            pose: self.pose(&buffers.tick, &scratch, tree, Some(faces))?,
            correct: push.dispatch(&bindings, model.vertex_count().div_ceil(GROUP))?,
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
    /// Nearest item of each garment vertex in the last frame.
    seeds: Buffer,
}

impl Scratch {
    fn new(context: &GpuContext, body: &Body, tree: &Tree, model: &Model) -> Self {
        Self {
            body: context.zeroed("body", SHOWN_BYTES * body.mesh.count, BufferUsages::empty()),
            boxes: tree.boxes(context),
            // Each animator has its own seeds: the nearest items of one say nothing about another.
            seeds: context.upload("seeds", &vec![u32::MAX; model.vertex_count()]),
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

/// Body face in the memory layout of `robust.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Face {
    corners: [u32; 3],
    joint: u32,
    welded: [u32; 3],
    padding: u32,
}

impl RobustRule {
    fn new(context: &GpuContext, model: &Model) -> Result<Self, GpuError> {
        let body = &model.character().body;
        let faces = faces(model);
        let centre = |f: &[u32; 3]| f.iter().map(|&v| body.vertices[v as usize]).sum::<Vec3>() / 3.0;
        let centres: Vec<Vec3> = body.faces.iter().map(centre).collect();
        let tree = Tree::new(context, Items::Faces, &centres)?;
        let FacesAround {
            rows: mut tables,
            first_face,
        } = faces_around(body.vertices.len(), &faces);
        // One buffer for both tables: devices promise no more than eight storage buffers a kernel.
        let first_set = tables.len();
        tables.extend(pushing_joints(model, &faces));
        let text = [VERTEX_STATE, NEAREST, include_str!("kernels/robust.wgsl")].concat();
        let own = [
            ("VERTICES", model.vertex_count() as f64),
            ("WORDS", words(model) as f64),
            ("AROUND", first_face as f64),
            ("PUSHING", first_set as f64),
        ];
        let source = Source {
            text: &text,
            entry: "push",
            constants: &[&own[..], &tree.constants(centres.len())].concat(),
        };
        Ok(Self {
            push: Kernel::new(context, &source),
            faces: context.upload("faces", &faces),
            tables: context.upload("tables", &tables),
            tree,
        })
    }
}

fn faces(model: &Model) -> Vec<Face> {
    let character = model.character();
    let welded = weld(&character.body.vertices);
    let joints = character.joints_of_faces();
    let pairs = character.body.faces.iter().zip(joints);
    pairs
        .map(|(&corners, joint)| Face {
            corners,
            joint: joint as u32,
            welded: corners.map(|v| welded[v as usize]),
            padding: 0,
        })
        .collect()
}

/// Faces around each welded vertex, in compressed rows.
struct FacesAround {
    /// Starts of the rows, then their faces.
    rows: Vec<u32>,
    /// Place of the first face in `rows`.
    first_face: usize,
}

fn faces_around(vertices: usize, faces: &[Face]) -> FacesAround {
    let mut pairs: Vec<(u32, u32)> = (faces.iter().enumerate())
        .flat_map(|(face, f)| f.welded.map(|v| (v, face as u32)))
        .collect();
    // Sorted by vertex, then by face: sums over the rows have a fixed order.
    pairs.sort_unstable();
    pairs.dedup();
    let start = |v: u32| pairs.partition_point(|&(at, _)| at < v) as u32;
    let mut rows: Vec<u32> = (0..=vertices as u32).map(start).collect();
    let first_face = rows.len();
    rows.extend(pairs.iter().map(|&(_, face)| face));
    FacesAround { rows, first_face }
}

/// Number of words of 32 bits in a set of joints.
fn words(model: &Model) -> usize {
    model.character().skeleton.len().div_ceil(32)
}

/// Computes the set of joints whose parts may push each garment vertex, one bit each.
fn pushing_joints(model: &Model, faces: &[Face]) -> Vec<u32> {
    let filter = ContactFilter::new(model.character(), model.garment());
    // The filter answers by face, the same for all faces of a joint: any of them will do.
    let mut face_of_joint = vec![None; model.character().skeleton.len()];
    for (i, face) in (0u32..).zip(faces) {
        face_of_joint[face.joint as usize] = Some(i);
    }
    let words = words(model);
    let mut sets = vec![0u32; words * model.vertex_count()];
    for (vertex, set) in sets.chunks_exact_mut(words).enumerate() {
        for (joint, face) in face_of_joint.iter().enumerate() {
            if face.is_some_and(|face| filter.face_may_push(face, vertex)) {
                set[joint / 32] |= 1 << (joint % 32);
            }
        }
    }
    sets
}
