//! Farthest-point sampling of a mesh's vertices.

use super::NEIGHBOURS;
use crate::{
    mesh::TriMesh,
    topology::{components, weld},
};
use glam::Vec3;
use std::{cmp::Reverse, collections::BinaryHeap};

/// Smallest number of samples of a connected component, unless it has fewer vertices. Four points
/// determine a linear function in space.
const MIN_SAMPLES: usize = NEIGHBOURS / 2;

/// Returns `share` of the vertices of every connected component in farthest-point order (Gonzalez
/// 1985).
///
/// The components alternate in proportion to their size, so that the samples of a smaller share are
/// a prefix.
pub(super) fn farthest_point_samples(rest: &TriMesh, share: f32) -> Vec<u32> {
    let welded = weld(&rest.vertices);
    let faces: Vec<[u32; 3]> = rest.faces.iter().map(|f| f.map(|v| welded[v as usize])).collect();
    let components = components(rest.vertices.len(), &faces);
    let mut vertices_of_components = vec![Vec::new(); components.count];
    for v in 0..rest.vertices.len() as u32 {
        // A copy of a seam vertex has no welded faces of its own, so it takes the component of the
        // first.
        let component = components.of_vertex[welded[v as usize] as usize];
        vertices_of_components[component as usize].push(v);
    }
    let mut ranked: Vec<(f32, u32)> = Vec::new();
    let not_empty = vertices_of_components.iter().filter(|part| !part.is_empty());
    for component in not_empty {
        let wanted = ((component.len() as f32 * share).round() as usize)
            .max(MIN_SAMPLES)
            .min(component.len());
        let order = farthest_first(&rest.vertices, component, wanted);
        let size = component.len() as f32;
        // The smallest numbers of samples of all components come before any others.
        let rank = |i: usize| if i < MIN_SAMPLES { 0.0 } else { i as f32 / size };
        ranked.extend(order.into_iter().enumerate().map(|(i, v)| (rank(i), v)));
    }
    // A stable sort: samples of equal rank stay in the order of the components.
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.into_iter().map(|(_, v)| v).collect()
}

/// Returns `count` vertices of a component: the first, then always the one farthest from all
/// before, or the first of several.
fn farthest_first(vertices: &[Vec3], component: &[u32], count: usize) -> Vec<u32> {
    let positions: Vec<Vec3> = component.iter().map(|&v| vertices[v as usize]).collect();
    // Squared distance of each vertex to the nearest chosen one. A distance that overflows or is no
    // number leaves it.
    let mut squared_distances = vec![f32::INFINITY; component.len()];
    // Squares are not negative, so that their bits have their order.
    let entry = |squared: f32, i: u32| (squared.to_bits(), Reverse(i));
    let all = 0..component.len() as u32;
    let mut farthest: BinaryHeap<_> = all.map(|i| entry(f32::INFINITY, i)).collect();
    let mut grid = Grid::default();
    let mut near = Vec::new();
    let mut chosen = Vec::with_capacity(count);
    let mut next = 0;
    // No vertex is farther than this from the chosen ones, so that the next one is nearest to
    // vertices within it alone.
    let mut reach = f32::INFINITY;
    while chosen.len() < count {
        chosen.push(component[next]);
        let from = positions[next];
        // Below zero, the distance of unchosen copies at the same place, so that these come first.
        squared_distances[next] = f32::NEG_INFINITY;
        grid.find_near(&positions, from, reach, &mut near);
        for &i in &near {
            let squared = positions[i as usize].distance_squared(from);
            let before = &mut squared_distances[i as usize];
            if squared < *before {
                *before = squared;
                farthest.push(entry(squared, i));
            }
        }
        // Entries of chosen vertices, and of those that have come nearer since, are out of date.
        while let Some(&(bits, Reverse(i))) = farthest.peek()
            && squared_distances[i as usize].to_bits() != bits
        {
            farthest.pop();
        }
        let found = farthest
            .peek()
            .map(|&(bits, Reverse(i))| (f32::from_bits(bits), i));
        // Nothing is found when all are chosen.
        let (squared, i) = found.unwrap_or_default();
        (next, reach) = (i as usize, squared.sqrt() * ROUNDED_UP);
    }
    chosen
}

/// Factor above the rounding errors of a distance.
const ROUNDED_UP: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Points sorted by cubic cells.
#[derive(Default)]
struct Grid {
    /// Width of a cell, metres; 0 before the first use.
    cell: f32,
    /// Cell and index of each point.
    points: Vec<([i64; 3], u32)>,
}

impl Grid {
    /// Lists the points that may be nearer to `from` than `reach`, which does not grow from call to
    /// call.
    fn find_near(&mut self, positions: &[Vec3], from: Vec3, reach: f32, near: &mut Vec<u32>) {
        near.clear();
        if reach == f32::INFINITY {
            near.extend(0..positions.len() as u32);
            return;
        }
        if reach <= 0.0 {
            return;
        }
        // Cells much wider than the reach hold many points beyond it.
        if self.points.is_empty() || reach < 0.5 * self.cell {
            self.cell = reach;
            let point = |(p, i): (&Vec3, u32)| (self.cell_of(*p), i);
            let mut points: Vec<_> = positions.iter().zip(0..).map(point).collect();
            points.sort_unstable();
            self.points = points;
        }
        let [x, y, z] = self.cell_of(from);
        let around = |x: i64| [x.saturating_sub(1), x, x.saturating_add(1)];
        for (x, y) in around(x).into_iter().flat_map(|x| around(y).map(|y| (x, y))) {
            // Cells along z are neighbours in the order.
            let [low, _, high] = around(z).map(|z| [x, y, z]);
            let start = self.points.partition_point(|(cell, _)| *cell < low);
            let row = self.points[start..].iter().take_while(|(cell, _)| *cell <= high);
            near.extend(row.map(|(_, i)| *i));
        }
    }

    fn cell_of(&self, p: Vec3) -> [i64; 3] {
        let cell = f64::from(self.cell);
        p.as_dvec3().to_array().map(|x| (x / cell).floor() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::{collection::vec, prelude::*};

    /// Looks at all vertices for every sample.
    fn exhaustive(vertices: &[Vec3], component: &[u32], count: usize) -> Vec<u32> {
        let mut squared_distances = vec![f32::INFINITY; component.len()];
        let mut chosen = Vec::new();
        let mut next = 0;
        while chosen.len() < count {
            chosen.push(component[next]);
            let from = vertices[component[next] as usize];
            squared_distances[next] = f32::NEG_INFINITY;
            let mut farthest = (f32::NEG_INFINITY, 0);
            for (i, (squared, &v)) in squared_distances.iter_mut().zip(component).enumerate() {
                *squared = squared.min(vertices[v as usize].distance_squared(from));
                if *squared > farthest.0 {
                    farthest = (*squared, i);
                }
            }
            next = farthest.1;
        }
        chosen
    }

    fn check(vertices: &[Vec3]) {
        // Every third vertex belongs to another component.
        let component: Vec<u32> = (0..vertices.len() as u32).filter(|v| v % 3 != 1).collect();
        let chosen = farthest_first(vertices, &component, component.len());
        assert_eq!(chosen, exhaustive(vertices, &component, component.len()));
    }

    proptest! {
        #[test]
        fn every_sample_is_the_first_of_those_farthest_from_all_before(
            // Whole numbers: many points are equally far, and some are copies.
            points in vec([-9i8..9, -9..9, -2..2], 1..200),
            scale in 1e-3f32..1e3,
        ) {
            check(&points.iter().map(|p| Vec3::from(p.map(f32::from)) * scale).collect::<Vec<_>>());
        }
    }

    #[test]
    fn distances_that_overflow_do_not_stop_the_sampling() {
        let far = [1e30f32, -3e38, 0.0, 1e-30, 3e38, 5.0, 1e19, -1e19];
        let vertices: Vec<Vec3> = far.iter().flat_map(|&x| [Vec3::splat(x), Vec3::X * x]).collect();
        check(&vertices);
    }
}
