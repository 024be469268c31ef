//! Wrinkles of a garment by wavelength: its shape split into five bands.

use super::{smoothing::Smoothing, welded::WeldedMesh};
use crate::error::Result;
use faer::Mat;
use glam::{DVec3, Vec3};
use unic_core::{mesh::vertex_normals, sampling::Sampling};

/// Wavelengths between the bands, cm. A smoothing halves the amplitude of a wave of its length.
pub(super) const WAVELENGTHS_CM: [u32; 4] = [3, 6, 12, 24];

/// Number of bands: one below each wavelength, and one above the last.
pub(super) const BANDS: usize = WAVELENGTHS_CM.len() + 1;

/// Number of vertices above which signals are read at a subset.
const MOST_VERTICES: usize = 8_000;

/// Distance of a vertex from the mean position beyond which a shape counts as diverged, metres.
/// Products of such numbers overflow in f32.
const FARTHEST_M: f64 = 1e6;

/// Filter that splits the shape of a garment into [`BANDS`] bands of wavelengths.
///
/// A band is the difference of two [`Smoothing`]s S_λ, as a distance along the normals of the coarser
/// one. Distances along the surface's own normals do not change when the garment moves rigidly.
/// The coarsest band is S_24 of the shape minus S_24 of the skinned rest shape.
pub(super) struct BandFilter {
    mesh: WeldedMesh,
    /// Smoothings in the order of [`WAVELENGTHS_CM`].
    smoothings: Vec<Smoothing>,
    /// Welded vertices at which signals are read.
    kept: Vec<u32>,
    /// Lumped rest area of each kept vertex, m².
    weights: Vec<f64>,
}

/// Shape of the welded vertices.
pub(super) struct Shape {
    /// Mean position, metres.
    mean: DVec3,
    /// Positions minus the mean position, N × 3, metres.
    centred: Mat<f64>,
}

impl BandFilter {
    /// Factorises the smoothings of a rest mesh.
    ///
    /// # Errors
    /// A rest mesh whose matrices cannot be factorised, such as one with areas of 1e-300 m².
    pub(super) fn new(mesh: WeldedMesh) -> Result<Self> {
        let smoothing = |&cm: &u32| Smoothing::new(&mesh, f64::from(cm) / 100.0);
        let smoothings: Vec<_> = WAVELENGTHS_CM.iter().map(smoothing).collect::<Result<_>>()?;
        let kept = spread_vertices(&mesh);
        // Masses do not depend on the wavelength.
        let masses = smoothings.first().map_or(&[][..], Smoothing::masses);
        Ok(Self {
            weights: kept.iter().map(|&v| masses[v as usize]).collect(),
            mesh,
            smoothings,
            kept,
        })
    }

    /// Returns the weight of each vertex of a band's signal: its lumped rest area, m².
    pub(super) fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Returns the coarsest smoothing of a shape, given by the positions of all garment vertices.
    pub(super) fn coarsest(&self, positions: &[Vec3]) -> Shape {
        let Shape { mean, centred } = self.shape(positions);
        let coarsest = self.smoothings.last().map(|last| last.smooth(&centred));
        Shape {
            mean,
            centred: coarsest.unwrap_or(centred),
        }
    }

    /// Returns the signals of a shape, given by the positions of all garment vertices: for each
    /// band the distance of each kept vertex along the normal, metres. `skinned` is the
    /// [coarsest](Self::coarsest) smoothing of the skinned rest shape.
    pub(super) fn signals(&self, positions: &[Vec3], skinned: &Shape) -> Vec<f32> {
        let (mut signals, coarsest, normals) = self.split(positions);
        let offset = coarsest.mean - skinned.mean;
        self.push_distances(
            &coarsest.centred,
            &skinned.centred,
            offset,
            &normals,
            &mut signals,
        );
        signals
    }

    /// Returns the [signals](Self::signals) of all bands but the coarsest, which alone depends on the
    /// skinned rest shape.
    pub(super) fn wrinkles(&self, positions: &[Vec3]) -> Vec<f32> {
        self.split(positions).0
    }

    /// Splits a shape into the signals of all bands but the coarsest, the coarsest smoothing, and its
    /// normals.
    fn split(&self, positions: &[Vec3]) -> (Vec<f32>, Shape, Vec<Vec3>) {
        let Shape { mean, centred } = self.shape(positions);
        let mut signals = Vec::with_capacity(BANDS * self.kept.len());
        let mut normals = Vec::new();
        let mut finer: Option<Mat<f64>> = None;
        for smoothing in &self.smoothings {
            let coarser = smoothing.smooth(&centred);
            self.normals(&coarser, &mut normals);
            let fine = finer.as_ref().unwrap_or(&centred);
            self.push_distances(fine, &coarser, DVec3::ZERO, &normals, &mut signals);
            finer = Some(coarser);
        }
        let centred = finer.unwrap_or(centred);
        (signals, Shape { mean, centred }, normals)
    }

    /// Appends the distances `fine` + `offset` − `coarse` of the kept vertices along the normals.
    fn push_distances(
        &self,
        fine: &Mat<f64>,
        coarse: &Mat<f64>,
        offset: DVec3,
        normals: &[Vec3],
        signals: &mut Vec<f32>,
    ) {
        let distance = |&v: &u32| {
            let v = v as usize;
            let difference = row(fine, v) + offset - row(coarse, v);
            difference.dot(normals[v].as_dvec3()) as f32
        };
        signals.extend(self.kept.iter().map(distance));
    }

    /// Reads the shape of the welded vertices. A shape that has diverged becomes NaN.
    fn shape(&self, positions: &[Vec3]) -> Shape {
        let welded: Vec<DVec3> = self.mesh.gather(positions).map(|p| p.as_dvec3()).collect();
        let mean = welded.iter().sum::<DVec3>() / welded.len().max(1) as f64;
        // Written so that NaN counts as far.
        let is_near = |p: &DVec3| (*p - mean).abs().max_element() < FARTHEST_M;
        let scale = if welded.iter().all(is_near) { 1.0 } else { f64::NAN };
        // Without the mean position, coordinates of a character that has walked far lose no digits.
        let centred = Mat::from_fn(welded.len(), 3, |i, axis| scale * (welded[i] - mean)[axis]);
        Shape { mean, centred }
    }

    /// Computes the unit normals of a shape of the welded vertices.
    fn normals(&self, shape: &Mat<f64>, normals: &mut Vec<Vec3>) {
        let positions: Vec<Vec3> = (0..shape.nrows()).map(|v| row(shape, v).as_vec3()).collect();
        vertex_normals(&positions, &self.mesh.rest.faces, normals);
    }
}

/// Returns a row of an N × 3 matrix.
fn row(matrix: &Mat<f64>, i: usize) -> DVec3 {
    DVec3::new(matrix[(i, 0)], matrix[(i, 1)], matrix[(i, 2)])
}

/// Returns all vertices of a mesh, or about [`MOST_VERTICES`] well-spread ones of a larger mesh, in
/// ascending order.
fn spread_vertices(mesh: &WeldedMesh) -> Vec<u32> {
    let count = mesh.vertices.len();
    if count > MOST_VERTICES {
        let share = MOST_VERTICES as f32 / count as f32;
        if let Ok(sampling) = Sampling::of_share(&mesh.rest, share) {
            let mut samples = sampling.samples().to_vec();
            samples.sort_unstable();
            return samples;
        }
    }
    (0..count as u32).collect()
}
