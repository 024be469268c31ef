//! Heat diffusion on a triangle mesh, in one implicit step.
//!
//! For tools and metrics: skinning weights are smoothed by it, and the wrinkles of a garment are
//! what it removes from the garment's shape.

use glam::{DVec3, Vec3};

/// Largest error of a solution, in units of the data; far below the resolution of weights in f32.
const TOLERANCE: f64 = 1e-9;

/// Iterations after which a solve ends, should rounding keep it from its tolerance.
///
/// Conjugate gradients need about ten iterations for every edge that the diffusion length spans,
/// and hundreds at most.
const MAX_ITERATIONS: usize = 5_000;

/// Largest |cotangent| that an angle contributes, that of half a degree.
///
/// The cotangents of a single sliver would otherwise dominate the matrix and slow convergence.
const MAX_COTANGENT: f64 = 100.0;

/// Matrix A = M + τL of a diffusion step: lumped vertex areas M (m²) and cotangent Laplacian L.
///
/// Off-diagonal entries are never positive and rows sum to the masses, so that A is an M-matrix and
/// the rows of A⁻¹M are averages. Every solution stays between the least and the greatest value of
/// its data (maximum principle).
///
/// One step multiplies a wave of wavelength λ by 1 / (1 + τ (2π / λ)²): τ = (λ / 2π)² halves it.
#[derive(Clone, Debug)]
pub struct Diffusion {
    /// Lumped areas of the vertices, m².
    masses: Vec<f64>,
    /// Diagonal of A.
    diagonal: Vec<f64>,
    /// Index of the first coupling of each vertex, and the number of couplings at the end.
    starts: Vec<usize>,
    /// Off-diagonal entries, row after row.
    couplings: Vec<Coupling>,
}

/// Off-diagonal entry −`weight` of the matrix.
#[derive(Clone, Debug)]
struct Coupling {
    /// Column: the neighbouring vertex.
    neighbour: u32,
    /// τ times the cotangent weight of the edge; above zero.
    weight: f64,
}

/// Contribution of one angle to the weight of the edge opposite to it.
struct EdgeShare {
    /// The edge, with a direction: from the matrix row to its column.
    from: u32,
    to: u32,
    /// Half the cotangent of the angle.
    half_cotangent: f64,
}

impl Diffusion {
    /// Assembles the matrix for positions in metres and τ in m².
    ///
    /// Faces without area contribute nothing. A vertex without other faces has no mass and an empty
    /// row. Seams are open unless `faces` name welded vertices; see
    /// [`weld`](crate::topology::weld).
    ///
    /// # Panics
    /// When a face names a vertex that does not exist.
    pub fn new(positions: &[Vec3], faces: &[[u32; 3]], tau: f64) -> Self {
        let mut masses = vec![0.0; positions.len()];
        let mut shares = Vec::new();
        for face in faces {
            let corners = face.map(|v| positions[v as usize].as_dvec3());
            let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
            // A face without area has no angles; false for NaN, too.
            if area > 0.0 {
                face.iter().for_each(|&v| masses[v as usize] += area / 3.0);
                push_shares(face, &corners, &mut shares);
            }
        }
        // A stable sort, so that the shares of an edge are summed in the order of the faces.
        shares.sort_by_key(|share| (share.from, share.to));
        let mut diffusion = Self {
            diagonal: masses.clone(),
            masses,
            starts: vec![0],
            couplings: Vec::new(),
        };
        diffusion.couple(&shares, tau);
        diffusion
    }

    /// Sums the shares of each directed edge, which are sorted by edge, and fills the matrix.
    fn couple(&mut self, shares: &[EdgeShare], tau: f64) {
        for same_edge in shares.chunk_by(|a, b| (a.from, a.to) == (b.from, b.to)) {
            let EdgeShare { from, to, .. } = same_edge[0];
            let weight = tau * same_edge.iter().map(|share| share.half_cotangent).sum::<f64>();
            // Edges that are not Delaunay have a negative sum, which would break the maximum
            // principle. They count as zero.
            if weight > 0.0 {
                self.starts.resize(from as usize + 1, self.couplings.len());
                self.couplings.push(Coupling {
                    neighbour: to,
                    weight,
                });
                self.diagonal[from as usize] += weight;
            }
        }
        self.starts.resize(self.masses.len() + 1, self.couplings.len());
    }

    /// Returns the lumped area of each vertex, m²: a third of the areas of its faces.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Iterates over the entries of A on and below the diagonal: row, column, value in m². A is
    /// symmetric, so that these determine it.
    ///
    /// They are for factorisations, which pay off where many right-hand sides follow.
    pub fn lower_entries(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        (0..self.masses.len()).flat_map(|row| {
            let couplings = &self.couplings[self.starts[row]..self.starts[row + 1]];
            let below = couplings
                .iter()
                .map(move |c| (row, c.neighbour as usize, -c.weight));
            below
                .filter(|(row, column, _)| column < row)
                .chain([(row, row, self.diagonal[row])])
        })
    }

    /// Replaces w₀ by the solution w of (M + τL) w = M w₀.
    ///
    /// Vertices without mass keep their values. The solver is conjugate gradients with a Jacobi
    /// preconditioner.
    ///
    /// # Panics
    /// When `w` does not have one number for each vertex.
    pub fn solve(&self, w: &mut [f64]) {
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

    /// Writes the product A x.
    fn apply(&self, x: &[f64], out: &mut [f64]) {
        for (i, out) in out.iter_mut().enumerate() {
            let row = &self.couplings[self.starts[i]..self.starts[i + 1]];
            let of_neighbours: f64 = row.iter().map(|c| c.weight * x[c.neighbour as usize]).sum();
            *out = self.diagonal[i] * x[i] - of_neighbours;
        }
    }

    /// Returns element `i` of the preconditioned residual.
    fn preconditioned(&self, residual: &[f64], i: usize) -> f64 {
        // Vertices without mass have an empty row.
        if self.diagonal[i] > 0.0 {
            residual[i] / self.diagonal[i]
        } else {
            0.0
        }
    }

    fn is_solved(&self, residual: &[f64]) -> bool {
        // |A⁻¹M| ≤ 1 in the maximum norm: if |r_i| ≤ ε m_i for all i, no error exceeds ε.
        residual
            .iter()
            .zip(&self.masses)
            .all(|(r, m)| r.abs() <= TOLERANCE * m)
    }
}

/// Appends the shares of a face's angles, for both directions of the opposite edges.
fn push_shares(face: &[u32; 3], corners: &[DVec3; 3], shares: &mut Vec<EdgeShare>) {
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (u, v) = (corners[i] - corners[k], corners[j] - corners[k]);
        let cotangent = u.dot(v) / u.cross(v).length();
        let half_cotangent = 0.5 * cotangent.clamp(-MAX_COTANGENT, MAX_COTANGENT);
        shares.extend([(i, j), (j, i)].map(|(from, to)| EdgeShare {
            from: face[from],
            to: face[to],
            half_cotangent,
        }));
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::{point, sheet, sphere};
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn solutions_satisfy_the_system_and_keep_the_mean(
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
            prop_assert!((mean(&w) - mean(&data)).abs() < 1e-9, "heat is conserved");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn heat_at_one_vertex_cools_no_other(
            at in 0usize..81, dents in vec(point(0.09), 81), length in 1e-3f64..0.02,
        ) {
            // A crumpled sheet is not Delaunay. With its negative cotangents some vertices would
            // cool; a short step shows it before heat from other vertices hides it.
            let mut mesh = sheet(8, 8, 0.1);
            mesh.vertices.iter_mut().zip(&dents).for_each(|(v, d)| *v += *d);
            let mut w = vec![0.0; 81];
            w[at] = 1.0;
            Diffusion::new(&mesh.vertices, &mesh.faces, length * length).solve(&mut w);
            prop_assert!(w.iter().all(|w| (-TOLERANCE..=1.0 + TOLERANCE).contains(w)));
        }
    }

    #[test]
    fn lower_entries_are_half_of_the_matrix() {
        let mesh = sphere(2, 0.5);
        let diffusion = Diffusion::new(&mesh.vertices, &mesh.faces, 0.04);
        let x: Vec<f64> = mesh.vertices.iter().map(|v| f64::from(v.x + v.y * v.z)).collect();
        let (mut product, mut expected) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        for (row, column, value) in diffusion.lower_entries() {
            product[row] += value * x[column];
            if row != column {
                product[column] += value * x[row];
            }
        }
        diffusion.apply(&x, &mut expected);
        let difference = product.iter().zip(&expected).map(|(a, b)| (a - b).abs());
        assert!(difference.fold(0.0, f64::max) < 1e-14);
        let area: f64 = diffusion.masses().iter().sum();
        assert!((area - std::f64::consts::PI).abs() < 0.1, "{area}");
    }

    #[test]
    fn first_harmonic_of_a_sphere_decays_by_the_exact_factor() {
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
