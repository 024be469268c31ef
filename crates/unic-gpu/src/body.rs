//! The posed body, and vertices that are inside of it.

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
use unic_core::{intersection::ContactParts, model::Model, topology::weld};
use wgpu::{Buffer, BufferUsages};

/// Places, skinning and text of what the two ways out of the body share.
const PLACES: &str = include_str!("kernels/places.wgsl");
const NEAREST: &str = include_str!("kernels/nearest.wgsl");

/// The body on the device. Asset.
#[derive(Debug)]
pub(crate) struct Body {
    mesh: Mesh,
    pose: Kernel,
    paper: Paper,
    robust: Robust,
}

/// The paper's intersection handling. Asset.
#[derive(Debug)]
struct Paper {
    /// Over the body's vertices.
    tree: Tree,
    drag: Kernel,
}

/// Ours, vertex by vertex. Asset.
#[derive(Debug)]
struct Robust {
    /// Over the body's faces.
    tree: Tree,
    faces: Buffer,
    tables: Buffer,
    push: Kernel,
}

/// What poses the body and moves vertices out of it.
pub(crate) struct Handling {
    pub(crate) pose: Vec<Dispatch>,
    pub(crate) correct: Dispatch,
}

impl Body {
    pub(crate) fn new(context: &GpuContext, model: &Model) -> Result<Self, GpuError> {
        let character = model.character();
        let text = [
            PLACES,
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
        Ok(Self {
            pose: Kernel::new(context, &source),
            paper: Paper::new(context, model)?,
            robust: Robust::new(context, model)?,
            mesh,
        })
    }

    /// States are moved out of the body by the paper's rule.
    pub(crate) fn paper(
        &self,
        context: &GpuContext,
        of: &Buffers,
        model: &Model,
    ) -> Result<Handling, GpuError> {
        let Paper { tree, drag } = &self.paper;
        let scratch = Scratch::new(context, self, tree, model);
        let mut buffers = scratch.bindings(tree).to_vec();
        buffers.extend([(0, &of.tick), (5, &of.points), (6, &of.states)]);
        Ok(Handling {
            pose: self.pose(&of.tick, &scratch, tree, None)?,
            correct: drag.dispatch(&buffers, model.vertex_count().div_ceil(GROUP))?,
        })
    }

    /// Shown positions are moved out of the body by our rule.
    pub(crate) fn robust(
        &self,
        context: &GpuContext,
        of: &Buffers,
        model: &Model,
    ) -> Result<Handling, GpuError> {
        let Robust {
            tree,
            faces,
            tables,
            push,
        } = &self.robust;
        let scratch = Scratch::new(context, self, tree, model);
        let mut buffers = scratch.bindings(tree).to_vec();
        buffers.extend([(0, &of.tick), (9, &of.shown), (14, faces), (15, tables)]);
        Ok(Handling {
            pose: self.pose(&of.tick, &scratch, tree, Some(faces))?,
            correct: push.dispatch(&buffers, model.vertex_count().div_ceil(GROUP))?,
        })
    }

    /// Positions, normals, boxes.
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

/// The posed body of one animator.
struct Scratch {
    body: Buffer,
    boxes: Buffer,
    /// By garment vertex: the item that was nearest.
    seeds: Buffer,
}

impl Scratch {
    fn new(context: &GpuContext, body: &Body, tree: &Tree, model: &Model) -> Self {
        Self {
            body: context.zeroed("body", SHOWN_BYTES * body.mesh.count, BufferUsages::empty()),
            boxes: tree.boxes(context),
            seeds: context.upload("seeds", &vec![u32::MAX; model.vertex_count()]),
        }
    }

    /// As `nearest.wgsl` numbers them.
    fn bindings<'a>(&'a self, tree: &'a Tree) -> [(u32, &'a Buffer); 4] {
        [
            (10, &tree.items),
            (11, &self.boxes),
            (12, &self.body),
            (13, &self.seeds),
        ]
    }
}

impl Paper {
    fn new(context: &GpuContext, model: &Model) -> Result<Self, GpuError> {
        let places = &model.character().body.vertices;
        let tree = Tree::new(context, Items::Vertices, places)?;
        let text = [PLACES, NEAREST, include_str!("kernels/paper.wgsl")].concat();
        let [a, b, c] = tree.constants(places.len());
        let source = Source {
            text: &text,
            entry: "drag",
            constants: &[
                ("VERTICES", model.vertex_count() as f64),
                ("IN_FRAME", f64::from(u8::from(is_in_frame(model)))),
                a,
                b,
                c,
            ],
        };
        Ok(Self {
            drag: Kernel::new(context, &source),
            tree,
        })
    }
}

/// As in `robust.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Face {
    corners: [u32; 3],
    joint: u32,
    welded: [u32; 3],
    padding: u32,
}

impl Robust {
    fn new(context: &GpuContext, model: &Model) -> Result<Self, GpuError> {
        let body = &model.character().body;
        let faces = faces(model);
        let centre = |f: &[u32; 3]| f.iter().map(|&v| body.vertices[v as usize]).sum::<Vec3>() / 3.0;
        let places: Vec<Vec3> = body.faces.iter().map(centre).collect();
        let tree = Tree::new(context, Items::Faces, &places)?;
        let (mut tables, around) = faces_around(body.vertices.len(), &faces);
        let first_set = tables.len();
        tables.extend(pushing_joints(model, &faces));
        let text = [PLACES, NEAREST, include_str!("kernels/robust.wgsl")].concat();
        let [a, b, c] = tree.constants(places.len());
        let source = Source {
            text: &text,
            entry: "push",
            constants: &[
                ("VERTICES", model.vertex_count() as f64),
                ("WORDS", words(model) as f64),
                ("AROUND", around as f64),
                ("PUSHING", first_set as f64),
                a,
                b,
                c,
            ],
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
    let first_at = weld(&character.body.vertices);
    let joints = character.joints_of_faces();
    let pairs = character.body.faces.iter().zip(joints);
    pairs
        .map(|(&corners, joint)| Face {
            corners,
            joint: joint as u32,
            welded: corners.map(|v| first_at[v as usize]),
            padding: 0,
        })
        .collect()
}

/// Faces around each welded vertex in compressed rows, and where the faces start.
fn faces_around(vertices: usize, faces: &[Face]) -> (Vec<u32>, usize) {
    let mut pairs: Vec<(u32, u32)> = (faces.iter().enumerate())
        .flat_map(|(face, f)| f.welded.map(|v| (v, face as u32)))
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    let start = |v: u32| pairs.partition_point(|&(at, _)| at < v) as u32;
    let mut rows: Vec<u32> = (0..=vertices as u32).map(start).collect();
    let around = rows.len();
    rows.extend(pairs.iter().map(|&(_, face)| face));
    (rows, around)
}

/// Words of a set of joints.
fn words(model: &Model) -> usize {
    model.character().skeleton.len().div_ceil(32)
}

/// For each garment vertex the joints whose parts may push it, one bit each.
fn pushing_joints(model: &Model, faces: &[Face]) -> Vec<u32> {
    let parts = ContactParts::new(model.character(), model.garment());
    // Any face of a joint speaks for all of them.
    let mut face_of_joint = vec![None; model.character().skeleton.len()];
    for (i, face) in (0u32..).zip(faces) {
        face_of_joint[face.joint as usize] = Some(i);
    }
    let words = words(model);
    let mut sets = vec![0u32; words * model.vertex_count()];
    for (vertex, set) in sets.chunks_exact_mut(words).enumerate() {
        for (joint, face) in face_of_joint.iter().enumerate() {
            if face.is_some_and(|face| parts.face_pushes(face, vertex)) {
                set[joint / 32] |= 1 << (joint % 32);
            }
        }
    }
    sets
}
