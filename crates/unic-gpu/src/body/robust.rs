//! Robust rule on the device, for each vertex by itself but for the order of layers.

use super::{NEAREST, Scratch, VERTEX_STATE};
use crate::{
    GpuContext, GpuError,
    animator::Buffers,
    kernel::{Dispatch, GROUP, Kernel, Source},
    projection::{ContactBuffers, Projection},
    tree::{Items, Tree},
};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use unic_core::{
    Corrects, Model,
    intersection::{ContactFilter, LAST_MARGIN_SHARE, keeps_layers_in_order},
    topology::weld,
};
use wgpu::{Buffer, BufferUsages};

/// Number of words that a first push leaves about a vertex: `PUSHED_WORDS` of `robust.wgsl`.
pub(super) const PUSHED_WORDS: usize = 7;

/// Robust intersection handling, for each vertex by itself but for the order of layers. Asset.
#[derive(Debug)]
pub(super) struct RobustRule {
    vertices: usize,
    /// Tree over the body's faces.
    pub(super) tree: Tree,
    pub(super) faces: Buffer,
    /// Faces around vertices and sets of joints, see `robust.wgsl`.
    tables: Buffer,
    push: Kernel,
    /// Push of shown positions, which are retracted first.
    push_shown: Kernel,
    /// Kernels that keep the order of layers; none for a coarse garment.
    order: Option<DepthOrder>,
    /// Kernels of the relaxation after the pushes; none without a strain projection.
    relaxation: Option<Relaxation>,
}

/// Kernels that keep the order of cloth that lies over one place of the body. Asset.
#[derive(Debug)]
struct DepthOrder {
    body_vertices: usize,
    clear: Kernel,
    find: Kernel,
    keep: Kernel,
    find_nearest: Kernel,
}

/// Kernels that find the planes in which a strain projection moves corrected vertices. Asset.
#[derive(Debug)]
struct Relaxation {
    find_moved: Kernel,
    find_planes: Kernel,
    push_again: Kernel,
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
    pub(super) fn new(context: &GpuContext, model: &Model) -> Result<Self, GpuError> {
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
        let text = [
            VERTEX_STATE,
            NEAREST,
            include_str!("../kernels/robust.wgsl"),
            include_str!("../kernels/planes.wgsl"),
            include_str!("../kernels/depths.wgsl"),
        ]
        .concat();
        let vertices = ("VERTICES", model.vertex_count() as f64);
        let around = ("AROUND", first_face as f64);
        let own = [
            vertices,
            around,
            ("WORDS", words(model) as f64),
            ("PUSHING", first_set as f64),
        ];
        let push = [&own[..], &tree.constants(centres.len())].concat();
        let kernel = |entry: &str, constants: &[(&str, f64)]| {
            let source = Source {
                text: &text,
                entry,
                constants,
            };
            Kernel::new(context, &source)
        };
        let share = ("MARGIN_SHARE", f64::from(LAST_MARGIN_SHARE));
        let again = [("AGAIN", 1.0), share];
        let relaxation = || Relaxation {
            find_moved: kernel("find_moved", &[vertices]),
            find_planes: kernel("find_planes", &[vertices, around]),
            push_again: kernel("push", &[&push[..], &again].concat()),
        };
        let body_vertices = body.vertices.len();
        let order = || DepthOrder {
            body_vertices,
            clear: kernel("clear_depths", &[("BODY_VERTICES", body_vertices as f64)]),
            find: kernel("find_depths", &[vertices]),
            keep: kernel("keep_order", &[vertices, around]),
            find_nearest: kernel("find_nearest", &push),
        };
        Ok(Self {
            vertices: model.vertex_count(),
            relaxation: model.projection().map(|_| relaxation()),
            order: keeps_layers_in_order(&model.garment().rest, body).then(order),
            push_shown: kernel("push", &[&push[..], &[("RETRACT", 1.0)]].concat()),
            push: kernel("push", &push),
            faces: context.upload("faces", &faces),
            tables: context.upload("tables", &tables),
            tree,
        })
    }

    /// Makes the dispatches that move shown positions out of the body.
    pub(super) fn correct(
        &self,
        context: &GpuContext,
        corrects: Corrects,
        buffers: &Buffers,
        scratch: &Scratch,
    ) -> Result<Vec<Dispatch>, GpuError> {
        // States that are corrected take the shortest way, as in training. What is shown is outside
        // the body then, so that layers need no order.
        if corrects == Corrects::State {
            return Ok(vec![self.push(&self.push, buffers, scratch)?]);
        }
        let mut dispatches = vec![self.push(&self.push_shown, buffers, scratch)?];
        if let Some(order) = &self.order {
            dispatches.extend(self.keep_order(order, context, buffers, scratch)?);
        }
        Ok(dispatches)
    }

    /// Makes the dispatches that keep the order of pushed layers.
    fn keep_order(
        &self,
        order: &DepthOrder,
        context: &GpuContext,
        buffers: &Buffers,
        scratch: &Scratch,
    ) -> Result<[Dispatch; 4], GpuError> {
        let bytes = 4 * order.body_vertices;
        let depths = context.zeroed("depths", bytes, BufferUsages::empty());
        let (depths, seeds, faces) = ((23, &depths), (13, &scratch.seeds), (14, &self.faces));
        let (shown, tables) = ((9, &buffers.shown), (15, &self.tables));
        let (tick, posed) = ((0, &buffers.tick), (12, &scratch.body));
        let keep = [tick, shown, posed, seeds, faces, tables, depths];
        let mut nearest = scratch.bindings(&self.tree).to_vec();
        nearest.extend([shown, faces, tables]);
        Ok([
            (order.clear).dispatch(&[depths], order.body_vertices.div_ceil(GROUP))?,
            order.find.dispatch(&[seeds, faces, depths], self.groups())?,
            order.keep.dispatch(&keep, self.groups())?,
            order.find_nearest.dispatch(&nearest, self.groups())?,
        ])
    }

    /// Makes the dispatches that bring edges back towards their limits after the pushes, smooth the
    /// pushes, and push once more.
    pub(super) fn relax(
        &self,
        context: &GpuContext,
        buffers: &Buffers,
        scratch: &Scratch,
        projection: &Projection,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let Some(kernels) = &self.relaxation else {
            return Ok(Vec::new());
        };
        let planes = context.zeroed("planes", 16 * self.vertices, BufferUsages::empty());
        let (seeds, body) = ((13, &scratch.seeds), (12, &scratch.body));
        let bindings = [
            (0, &buffers.tick),
            (9, &buffers.shown),
            body,
            seeds,
            (14, &self.faces),
            (15, &self.tables),
            (22, &planes),
        ];
        let contacts = ContactBuffers {
            seeds: &scratch.seeds,
            planes: &planes,
        };
        let mut dispatches = vec![
            kernels.find_moved.dispatch(&[seeds], 1)?,
            kernels.find_planes.dispatch(&bindings, self.groups())?,
        ];
        dispatches.extend(projection.relax(buffers, contacts)?);
        dispatches.push(self.push(&kernels.push_again, buffers, scratch)?);
        Ok(dispatches)
    }

    fn push(&self, kernel: &Kernel, buffers: &Buffers, scratch: &Scratch) -> Result<Dispatch, GpuError> {
        let mut bindings = scratch.bindings(&self.tree).to_vec();
        bindings.extend([
            (0, &buffers.tick),
            (9, &buffers.shown),
            (14, &self.faces),
            (15, &self.tables),
        ]);
        kernel.dispatch(&bindings, self.groups())
    }

    /// Number of workgroups for one invocation a vertex.
    fn groups(&self) -> usize {
        self.vertices.div_ceil(GROUP)
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
