//! Work of the workgroups of a sweep in the memory layout of `sweep.wgsl`.

use super::plan::{Corners, GroupWork, Pass};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use unic_core::projection::{self, Freedom};

/// Constraints of a sweep by colour, in the order of the sweep: edges before stencils.
pub(super) struct Constraints<'a> {
    pub(super) edges: Vec<&'a [projection::Edge]>,
    pub(super) stencils: Vec<&'a [projection::Stencil]>,
    /// Freedom of the vertices.
    pub(super) freedom: &'a Freedom,
    /// Place of each vertex at rest, metres.
    pub(super) rest: &'a [Vec3],
}

impl Constraints<'_> {
    /// Vertices of the constraints of each stage.
    pub(super) fn corners(&self) -> Vec<Vec<Corners>> {
        let of_edge = |edge: &projection::Edge| {
            let [a, b] = edge.ends;
            [a, b, a, b]
        };
        let edges = (self.edges.iter()).map(|edges| edges.iter().map(of_edge).collect());
        let stencils = (self.stencils.iter()).map(|s| s.iter().map(|s| s.vertices).collect());
        edges.chain(stencils).collect()
    }
}

/// Work of one workgroup in the memory layout of `sweep.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Group {
    vertices: u32,
    count: u32,
    owned: u32,
    repeats: u32,
    edge_ends: u32,
    edge_stages: u32,
    stencil_ends: u32,
    stencil_stages: u32,
}

impl Group {
    /// The same work, several times.
    pub(super) fn repeated(self, times: usize) -> Self {
        let repeats = times as u32;
        Self { repeats, ..self }
    }
}

/// Edge in the memory layout of `sweep.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PackedEdge {
    ends: [u16; 2],
    limits: [f32; 2],
    /// Share of the first end. Both shares have the sum 1.
    share: f32,
}

/// Bending stencil in the memory layout of `sweep.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PackedStencil {
    vertices: [u16; 4],
    first_coefficients: [f32; 3],
    scale: f32,
    /// 65,535 is 1.
    freedom: [u16; 4],
}

/// Work of all workgroups of all passes.
#[derive(Debug, Default)]
pub(super) struct Packed {
    pub(super) vertices: Vec<u32>,
    pub(super) ends: Vec<u32>,
    pub(super) edges: Vec<PackedEdge>,
    pub(super) stencils: Vec<PackedStencil>,
}

impl Packed {
    /// Adds the work of one workgroup.
    pub(super) fn add(&mut self, pass: &Pass, work: &GroupWork, constraints: &Constraints) -> Group {
        let edge_colours = constraints.edges.len();
        let stages = || (pass.first_stage..).zip(&work.constraints);
        let mut places = vec![0; constraints.rest.len()];
        for (place, &vertex) in work.vertices.iter().enumerate() {
            // A workgroup has at most 2^16 vertices.
            places[vertex as usize] = place as u16;
        }
        let group = Group {
            vertices: self.vertices.len() as u32,
            count: work.vertices.len() as u32,
            owned: work.owned as u32,
            repeats: 1,
            edge_ends: self.ends.len() as u32,
            edge_stages: 0,
            stencil_ends: 0,
            stencil_stages: 0,
        };
        self.vertices.extend(&work.vertices);
        self.ends.push(self.edges.len() as u32);
        for (stage, chosen) in stages().filter(|(stage, _)| *stage < edge_colours) {
            // An edge of two fixed vertices moves neither, and has no shares with the sum 1.
            let moves = |edge: &&projection::Edge| edge.ends.iter().any(|&v| constraints.freedom.of(v) > 0.0);
            let edges = chosen.iter().map(|&i| &constraints.edges[stage][i as usize]);
            let edges = edges.filter(moves);
            (self.edges).extend(edges.map(|edge| PackedEdge::new(edge, constraints.freedom, &places)));
            self.ends.push(self.edges.len() as u32);
        }
        let stencil_ends = self.ends.len() as u32;
        self.ends.push(self.stencils.len() as u32);
        for (stage, chosen) in stages().filter(|(stage, _)| *stage >= edge_colours) {
            let stencils = chosen
                .iter()
                .map(|&i| &constraints.stencils[stage - edge_colours][i as usize]);
            (self.stencils).extend(stencils.map(|s| PackedStencil::new(s, constraints.freedom, &places)));
            self.ends.push(self.stencils.len() as u32);
        }
        Group {
            edge_stages: stencil_ends - group.edge_ends - 1,
            stencil_ends,
            stencil_stages: self.ends.len() as u32 - stencil_ends - 1,
            ..group
        }
    }
}

impl PackedEdge {
    fn new(edge: &projection::Edge, freedom: &Freedom, places: &[u16]) -> Self {
        // Shares may miss the sum 1 by rounding. A fixed end must not move at all.
        let share = match edge.ends.map(|end| freedom.of(end)) {
            [_, 0.0] => 1.0,
            ends => projection::Edge::shares(ends)[0],
        };
        Self {
            ends: edge.ends.map(|end| places[end as usize]),
            limits: [edge.limit.shortest, edge.limit.longest],
            share,
        }
    }
}

impl PackedStencil {
    fn new(stencil: &projection::Stencil, freedom: &Freedom, places: &[u16]) -> Self {
        let [first, second, third, _] = stencil.coefficients();
        Self {
            vertices: stencil.vertices.map(|v| places[v as usize]),
            first_coefficients: [first, second, third],
            scale: stencil.scale(),
            freedom: (stencil.vertices).map(|v| (freedom.of(v) * 65535.0).round() as u16),
        }
    }
}
