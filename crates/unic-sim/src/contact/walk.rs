//! The closest point of the body's surface near the last one.

use crate::body::{blend, corners_of};
use glam::Vec3;
use unic_core::{
    mesh::TriMesh,
    surface::{Feature, Triangle},
    topology::weld,
};

/// Faces that one walk crosses at most: cloth slides a face or two within an interval.
const MOST_HOPS: usize = 4;

/// No face: beyond the rim of an open body.
pub(super) const NO_FACE: u32 = u32::MAX;

/// Which faces of the body touch, over vertices that are welded by place.
#[derive(Clone, Debug)]
pub(super) struct FaceGraph {
    pub(super) faces: Vec<[u32; 3]>,
    welded: Vec<[u32; 3]>,
    /// Faces around welded vertex i are `around[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    around: Vec<u32>,
}

/// The foot of a perpendicular on the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    pub(super) face: u32,
    pub(super) barycentric: Vec3,
    squared_distance: f32,
    feature: Feature,
}

impl FaceGraph {
    pub(super) fn new(bind: &TriMesh) -> Self {
        let first_at = weld(&bind.vertices);
        let welded: Vec<[u32; 3]> = (bind.faces.iter())
            .map(|f| f.map(|v| first_at[v as usize]))
            .collect();
        let mut pairs: Vec<(u32, u32)> = (welded.iter().enumerate())
            .flat_map(|(face, corners)| corners.map(|v| (v, face as u32)))
            .collect();
        pairs.sort_unstable();
        let row = |v: u32| pairs.partition_point(|&(at, _)| at < v) as u32;
        Self {
            faces: bind.faces.clone(),
            starts: (0..=bind.vertices.len() as u32).map(row).collect(),
            around: pairs.into_iter().map(|(_, face)| face).collect(),
            welded,
        }
    }

    /// Unit normal of a face; zero when it is degenerate.
    pub(super) fn normal(&self, positions: &[Vec3], face: u32) -> Vec3 {
        let [a, b, c] = corners_of(positions, self.faces[face as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Descends from `face` to faces that touch it as long as one is closer to `p`, and never from
    /// within the body to a face that looks the other way: through a thin limb the far side is
    /// closer, but it is not where `p` came from.
    pub(super) fn walk(&self, positions: &[Vec3], face: u32, p: Vec3) -> Foot {
        let mut best = self.foot(positions, face, p);
        for _ in 0..MOST_HOPS {
            let Some(closer) = self.step(positions, &best, p) else {
                break;
            };
            best = closer;
        }
        best
    }

    fn step(&self, positions: &[Vec3], from: &Foot, p: Vec3) -> Option<Foot> {
        let corners = self.welded[from.face as usize];
        let corner = |k: u8| corners[usize::from(k % 3)];
        let (pivot, other) = match from.feature {
            Feature::Face => return None,
            Feature::Edge(k) => (corner(k), corner(k + 1)),
            Feature::Vertex(k) => (corner(k), corner(k)),
        };
        let row = self.starts[pivot as usize] as usize..self.starts[pivot as usize + 1] as usize;
        let touching = (self.around[row].iter().copied())
            .filter(|&f| f != from.face && self.welded[f as usize].contains(&other));
        let mut best: Option<Foot> = None;
        for foot in touching.map(|f| self.foot(positions, f, p)) {
            if foot.squared_distance < best.unwrap_or(*from).squared_distance {
                best = Some(foot);
            }
        }
        best.filter(|foot| !self.turns_away(positions, from, foot, p))
    }

    fn turns_away(&self, positions: &[Vec3], from: &Foot, to: &Foot, p: Vec3) -> bool {
        let side = self.normal(positions, from.face);
        let is_inside = (p - self.point(positions, from)).dot(side) < 0.0;
        is_inside && side.dot(self.normal(positions, to.face)) < 0.0
    }

    fn foot(&self, positions: &[Vec3], face: u32, p: Vec3) -> Foot {
        let corners = corners_of(positions, self.faces[face as usize]);
        let hit = Triangle::new(corners).closest(p);
        Foot {
            face,
            barycentric: hit.barycentric,
            squared_distance: hit.squared_distance,
            feature: hit.feature,
        }
    }

    /// Position of a foot, metres.
    pub(super) fn point(&self, positions: &[Vec3], foot: &Foot) -> Vec3 {
        blend(positions, self.faces[foot.face as usize], foot.barycentric)
    }
}
