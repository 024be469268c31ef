//! Plan of a sweep: which workgroups solve which constraints in which pass.
//!
//! A Gauss-Seidel sweep solves its constraints stage by stage; those of one stage share no vertex.
//! One dispatch a stage would be hundreds of dispatches a frame, each of which takes longer to start
//! than to run. So vertices are divided into patches, one for each workgroup, and a *pass* is a run
//! of stages that every workgroup solves for its own patch in its own memory. A workgroup solves all
//! constraints that its patch depends on in that pass, also those of its neighbours' vertices, and
//! keeps its own vertices alone. So several workgroups may solve one constraint, with the same
//! result, and all positions are those of the sweep in its order.

use glam::Vec3;
use std::ops::Range;

/// Sizes of the workgroups of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PlanSizes {
    /// Largest number of vertices of one workgroup in a pass, at least four.
    pub(super) capacity: usize,
    /// Largest number of vertices of a patch, if there are several.
    pub(super) patch: usize,
    /// Largest number of stages in a pass.
    pub(super) stages: usize,
}

/// Vertices of a constraint. Those with fewer than four repeat some.
pub(super) type Corners = [u32; 4];

/// Run of stages that all workgroups solve in one dispatch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pass {
    /// Number of stages before the pass.
    pub(super) first_stage: usize,
    /// Number of stages in the pass.
    pub(super) stages: usize,
    /// Work of each workgroup.
    pub(super) groups: Vec<GroupWork>,
}

/// Work of one workgroup in one pass.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct GroupWork {
    /// Vertices that it reads. The first ones are its patch, which it writes.
    pub(super) vertices: Vec<u32>,
    /// Number of vertices in its patch.
    pub(super) owned: usize,
    /// Places in the stage of the constraints to solve, for each stage of the pass.
    pub(super) constraints: Vec<Vec<u32>>,
}

/// Divides a sweep into passes. Constraints of one stage share no vertex; `positions` has one
/// position for each vertex, and neighbours in it share a patch.
pub(super) fn passes(stages: &[Vec<Corners>], positions: &[Vec3], sizes: PlanSizes) -> Vec<Pass> {
    let patches = patches(positions, sizes);
    let lookup: Vec<Vec<u32>> = (stages.iter())
        .map(|stage| constraint_of_vertex(stage, positions.len()))
        .collect();
    let mut cone = Cone {
        stages,
        lookup: &lookup,
        place: vec![NONE; positions.len()],
    };
    let mut passes = Vec::new();
    let mut first = 0;
    while first < stages.len() {
        let pass = cone.longest_pass(first, &patches, sizes);
        first += pass.stages;
        passes.push(pass);
    }
    passes
}

const NONE: u32 = u32::MAX;

/// Place of the constraint of each vertex in a stage.
fn constraint_of_vertex(stage: &[Corners], vertices: usize) -> Vec<u32> {
    let mut of_vertex = vec![NONE; vertices];
    for (place, constraint) in (0..).zip(stage) {
        for &vertex in constraint {
            of_vertex[vertex as usize] = place;
        }
    }
    of_vertex
}

/// Finds what the vertices of a patch depend on.
struct Cone<'a> {
    stages: &'a [Vec<Corners>],
    lookup: &'a [Vec<u32>],
    /// Place of each vertex in the work of the current patch. Scratch.
    place: Vec<u32>,
}

impl Cone<'_> {
    /// Finds the pass with the most stages from `first` on whose workgroups have room.
    fn longest_pass(&mut self, first: usize, patches: &[Vec<u32>], sizes: PlanSizes) -> Pass {
        // One stage has room. Usually all do.
        let (mut fits, mut too_long) = (1, (self.stages.len() - first).min(sizes.stages) + 1);
        let mut pass = self.pass(first..first + 1, patches);
        let mut length = too_long - 1;
        while fits + 1 < too_long {
            let longer = self.pass(first..first + length, patches);
            match longer
                .groups
                .iter()
                .all(|group| group.vertices.len() <= sizes.capacity)
            {
                true => (fits, pass) = (length, longer),
                false => too_long = length,
            }
            length = fits.midpoint(too_long);
        }
        pass
    }

    fn pass(&mut self, stages: Range<usize>, patches: &[Vec<u32>]) -> Pass {
        Pass {
            first_stage: stages.start,
            stages: stages.len(),
            groups: (patches.iter())
                .map(|patch| self.group(stages.clone(), patch))
                .collect(),
        }
    }

    /// Collects the constraints backwards: those of the last stage that move the patch, and those of
    /// every stage before that move any vertex of a constraint after them.
    fn group(&mut self, stages: Range<usize>, patch: &[u32]) -> GroupWork {
        let mut vertices = patch.to_vec();
        for (place, &vertex) in (0..).zip(patch) {
            self.place[vertex as usize] = place;
        }
        let mut constraints = Vec::with_capacity(stages.len());
        for stage in stages.rev() {
            let mut needed: Vec<u32> = (vertices.iter())
                .map(|&vertex| self.lookup[stage][vertex as usize])
                .filter(|&constraint| constraint != NONE)
                .collect();
            needed.sort_unstable();
            needed.dedup();
            for &constraint in &needed {
                for vertex in self.stages[stage][constraint as usize] {
                    let place = &mut self.place[vertex as usize];
                    if *place == NONE {
                        *place = vertices.len() as u32;
                        vertices.push(vertex);
                    }
                }
            }
            constraints.push(needed);
        }
        constraints.reverse();
        for &vertex in &vertices {
            self.place[vertex as usize] = NONE;
        }
        GroupWork {
            vertices,
            owned: patch.len(),
            constraints,
        }
    }
}

/// Divides vertices into compact patches: one if it has room, else halves of halves along the
/// longest side of their box.
fn patches(positions: &[Vec3], sizes: PlanSizes) -> Vec<Vec<u32>> {
    let all: Vec<u32> = (0..positions.len() as u32).collect();
    // A constraint has at most four vertices, so that the vertices of one stage have room.
    let most = match positions.len() <= sizes.capacity {
        true => sizes.capacity,
        false => sizes.patch.min(sizes.capacity / 4).max(1),
    };
    let mut patches = Vec::new();
    divide(all, positions, most, &mut patches);
    patches
}

fn divide(mut vertices: Vec<u32>, positions: &[Vec3], most: usize, patches: &mut Vec<Vec<u32>>) {
    if vertices.len() <= most {
        patches.push(vertices);
        return;
    }
    let at = |v: &u32| positions[*v as usize];
    let (low, high) = (vertices.iter().map(at))
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
    let axis = (high - low).max_position();
    // Equal coordinates are told apart by the vertices' numbers, so that the order is unique.
    vertices.sort_unstable_by(|a, b| at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(b)));
    // As few patches as there is need for, each as large as the others.
    let halves = vertices.len().div_ceil(most).div_ceil(2);
    let middle = vertices.len() * halves / vertices.len().div_ceil(most);
    let rest = vertices.split_off(middle);
    divide(vertices, positions, most, patches);
    divide(rest, positions, most, patches);
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_core::colouring::colour_constraints;

    /// Grid of n × n vertices, and its edges by colour.
    fn grid(n: u32) -> (Vec<Vec3>, Vec<Vec<Corners>>) {
        let positions = (0..n * n).map(|i| Vec3::new((i % n) as f32, (i / n) as f32, 0.0));
        let right = (0..n * n).filter(|i| i % n + 1 < n).map(|i| [i, i + 1]);
        let up = (0..n * (n - 1)).map(|i| [i, i + n]);
        let edges: Vec<[u32; 2]> = right.chain(up).collect();
        let colours = colour_constraints(&edges, (n * n) as usize);
        let corners = |&i: &u32| {
            let [a, b] = edges[i as usize];
            [a, b, a, b]
        };
        let stages = colours.iter().map(|colour| colour.iter().map(corners).collect());
        (positions.collect(), stages.collect())
    }

    /// Some step that depends on both ends and on their order.
    fn solve(values: &mut [f64], [a, b, ..]: Corners) {
        let (x, y) = (values[a as usize], values[b as usize]);
        values[a as usize] = 0.7 * x + 0.2 * y + 0.1;
        values[b as usize] = 0.4 * y - 0.3 * x;
    }

    /// Solves the passes as workgroups do: each reads the values before the pass.
    fn solved(passes: &[Pass], stages: &[Vec<Corners>], before: &[f64]) -> Vec<f64> {
        let mut values = before.to_vec();
        for pass in passes {
            let mut next = vec![f64::NAN; values.len()];
            for group in &pass.groups {
                let mut own = vec![f64::NAN; values.len()];
                for &v in &group.vertices {
                    own[v as usize] = values[v as usize];
                }
                for (stage, constraints) in (pass.first_stage..).zip(&group.constraints) {
                    (constraints.iter()).for_each(|&c| solve(&mut own, stages[stage][c as usize]));
                }
                for &v in &group.vertices[..group.owned] {
                    next[v as usize] = own[v as usize];
                }
            }
            values = next;
        }
        values
    }

    #[test]
    fn passes_give_the_values_of_the_sweep() {
        let (positions, stages) = grid(20);
        let before: Vec<f64> = (0..400).map(|i| f64::from(i).sin()).collect();
        let mut wanted = before.clone();
        stages.iter().flatten().for_each(|edge| solve(&mut wanted, *edge));
        for (capacity, patch, most, shape) in [
            (400, 400, 9, (1, 1)),
            (200, 50, 9, (1, 8)),
            (64, 16, 9, (1, 25)),
            (64, 16, 3, (2, 50)),
            (8, 2, 9, (2, 400)),
        ] {
            let sizes = PlanSizes {
                capacity,
                patch,
                stages: most,
            };
            let passes = passes(&stages, &positions, sizes);
            let groups = || passes.iter().flat_map(|pass| &pass.groups);
            assert_eq!((passes.len(), groups().count()), shape, "{sizes:?}");
            assert!(groups().all(|group| group.vertices.len() <= capacity));
            assert!(passes.iter().all(|pass| pass.stages <= most));
            assert_eq!(solved(&passes, &stages, &before), wanted, "{sizes:?}");
        }
    }

    #[test]
    fn every_vertex_is_in_one_patch() {
        let (positions, _) = grid(17);
        let sizes = PlanSizes {
            capacity: 80,
            patch: 20,
            stages: 1,
        };
        let patches = patches(&positions, sizes);
        assert!(patches.iter().all(|patch| (10..=20).contains(&patch.len())));
        let mut all = patches.concat();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..17 * 17));
    }
}
