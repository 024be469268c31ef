//! One implicit step of heat flow on a triangle mesh.

use glam::{DVec3, Vec3};

/// Largest error of a solution, in units of the data. Far below what f32 weights resolve.
const TOLERANCE: f64 = 1e-9;

/// Ends a solve that rounding keeps from its tolerance. Conjugate gradients need some ten steps for
/// every edge that the diffusion length spans, hundreds at most.
const MAX_ITERATIONS: usize = 5_000;

/// Largest |cotangent| that a face contributes: angles below half a degree count as that, or one
/// sliver would stiffen the whole system.
const MAX_COTANGENT: f64 = 100.0;

/// The matrix A = M + τL: lumped vertex areas M (m²) and cotangent Laplacian L, rows compressed.
///
/// Off-diagonal entries are never positive and rows sum to the masses, so A is an M-matrix and
/// A⁻¹M averages: every solution stays between the least and the greatest value of its data.
pub(crate) struct Diffusion {
    masses: Vec<f64>,
    diagonal: Vec<f64>,
    /// Couplings of vertex i are `couplings[starts[i]..starts[i + 1]]`: (neighbour, τ · weight > 0).
    starts: Vec<usize>,
    couplings: Vec<(u32, f64)>,
}

impl Diffusion {
    /// For positions in metres and τ in m².
    pub(crate) fn new(positions: &[Vec3], faces: &[[u32; 3]], tau: f64) -> Self {
        let mut masses = vec![0.0; positions.len()];
        let mut edges = Vec::new();
        for face in faces {
            let corners = face.map(|v| positions[v as usize].as_dvec3());
            let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
            if area > 0.0 {
                face.iter().for_each(|&v| masses[v as usize] += area / 3.0);
                push_cotangents(face, &corners, &mut edges);
            }
        }
        // Stable, so that sums are taken in the order of the faces.
        edges.sort_by_key(|&(edge, _)| edge);
        let mut all = Self {
            diagonal: masses.clone(),
            masses,
            starts: vec![0],
            couplings: Vec::new(),
        };
        all.couple(&edges, tau);
        all
    }

    /// Adds up the half weights of each directed edge; they come sorted.
    fn couple(&mut self, edges: &[([u32; 2], f64)], tau: f64) {
        for same_edge in edges.chunk_by(|a, b| a.0 == b.0) {
            let [from, to] = same_edge[0].0;
            let weight = tau * same_edge.iter().map(|(_, half)| half).sum::<f64>();
            // A negative sum (obtuse, not Delaunay) would break the maximum principle.
            if weight > 0.0 {
                self.starts.resize(from as usize + 1, self.couplings.len());
                self.couplings.push((to, weight));
                self.diagonal[from as usize] += weight;
            }
        }
        self.starts.resize(self.masses.len() + 1, self.couplings.len());
    }

    /// Replaces w₀ by w with (M + τL) w = M w₀, by conjugate gradients with Jacobi preconditioning.
    /// Vertices without mass keep their values.
    ///
    /// Since |A⁻¹M| ≤ 1 in the maximum norm, |r_i| ≤ ε m_i for all i bounds every error by ε.
    pub(crate) fn solve(&self, w: &mut [f64]) {
        let count = w.len();
        let mut product = vec![0.0; count];
        self.apply(w, &mut product);
        let mut residual: Vec<f64> = (0..count).map(|i| self.masses[i] * w[i] - product[i]).collect();
        let mut direction: Vec<f64> = (0..count).map(|i| self.preconditioned(&residual, i)).collect();
        let mut energy = dot(&residual, &direction);
        for _ in 0..MAX_ITERATIONS {
            if self.is_solved(&residual) {
                return;
            }
            self.apply(&direction, &mut product);
            let step = energy / dot(&direction, &product);
            for i in 0..count {
                w[i] += step * direction[i];
                residual[i] -= step * product[i];
            }
            let before = energy;
            energy = (0..count)
                .map(|i| residual[i] * self.preconditioned(&residual, i))
                .sum();
            for (i, direction) in direction.iter_mut().enumerate() {
                *direction = self.preconditioned(&residual, i) + energy / before * *direction;
            }
        }
    }

    fn apply(&self, x: &[f64], out: &mut [f64]) {
        for (i, out) in out.iter_mut().enumerate() {
            let row = &self.couplings[self.starts[i]..self.starts[i + 1]];
            let pulled: f64 = row.iter().map(|&(j, weight)| weight * x[j as usize]).sum();
            *out = self.diagonal[i] * x[i] - pulled;
        }
    }

    fn preconditioned(&self, residual: &[f64], i: usize) -> f64 {
        if self.diagonal[i] > 0.0 {
            residual[i] / self.diagonal[i]
        } else {
            0.0
        }
    }

    fn is_solved(&self, residual: &[f64]) -> bool {
        residual
            .iter()
            .zip(&self.masses)
            .all(|(r, m)| r.abs() <= TOLERANCE * m)
    }
}

/// Half the cotangent of each angle, for both directions of the edge opposite to it.
fn push_cotangents(face: &[u32; 3], corners: &[DVec3; 3], edges: &mut Vec<([u32; 2], f64)>) {
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (u, v) = (corners[i] - corners[k], corners[j] - corners[k]);
        let cotangent = u.dot(v) / u.cross(v).length();
        let half = 0.5 * cotangent.clamp(-MAX_COTANGENT, MAX_COTANGENT);
        edges.extend([([face[i], face[j]], half), ([face[j], face[i]], half)]);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{point, sheet, sphere};
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn solutions_solve_the_system(
            data in vec(-1.0f64..1.0, 81), dents in vec(point(0.09), 81), length in 0.0f64..1.0,
        ) {
            let mut mesh = sheet(8, 8, 0.1);
            mesh.vertices.iter_mut().zip(&dents).for_each(|(v, d)| *v += *d);
            let diffusion = Diffusion::new(&mesh.vertices, &mesh.faces, length * length);
            let (mut w, mut product) = (data.clone(), vec![0.0; 81]);
            diffusion.solve(&mut w);
            diffusion.apply(&w, &mut product);
            for i in 0..81 {
                let mass = diffusion.masses[i];
                prop_assert!((product[i] - mass * data[i]).abs() <= 2.0 * TOLERANCE * mass);
            }
            let mean = |x: &[f64]| dot(&diffusion.masses, x);
            prop_assert!((mean(&w) - mean(&data)).abs() < 1e-9, "heat is neither made nor lost");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn heat_at_one_vertex_makes_no_other_colder(
            at in 0usize..81, dents in vec(point(0.09), 81), length in 1e-3f64..0.02,
        ) {
            // A sheet crumpled beyond Delaunay: with its negative cotangents some would be,
            // and a short step shows it before the heat of others covers it.
            let mut mesh = sheet(8, 8, 0.1);
            mesh.vertices.iter_mut().zip(&dents).for_each(|(v, d)| *v += *d);
            let mut w = vec![0.0; 81];
            w[at] = 1.0;
            Diffusion::new(&mesh.vertices, &mesh.faces, length * length).solve(&mut w);
            prop_assert!(w.iter().all(|w| (-TOLERANCE..=1.0 + TOLERANCE).contains(w)));
        }
    }

    #[test]
    fn the_sphere_damps_its_first_harmonic_by_the_known_factor() {
        // The Laplacian of z on a sphere of radius r is 2 z / r².
        let (radius, tau) = (0.5f32, 0.04);
        let mesh = sphere(5, radius);
        let mut w: Vec<f64> = mesh.vertices.iter().map(|v| f64::from(v.z)).collect();
        Diffusion::new(&mesh.vertices, &mesh.faces, tau).solve(&mut w);
        let factor = 1.0 / (1.0 + 2.0 * tau / f64::from(radius * radius));
        for (w, v) in w.iter().zip(&mesh.vertices) {
            assert!((w - factor * f64::from(v.z)).abs() < 2e-3 * f64::from(radius));
        }
    }
}
