//! Components of a prior in 16 bits.

use crate::simd::Instructions;
use glam::Vec3;

/// Number of components that are added at once.
const LANES: usize = 16;

/// Largest number of steps of a coordinate.
const MOST_STEPS: f32 = i16::MAX as f32;

/// Vectors of K components for each of V vertices.
///
/// Every frame reads all of them, so memory bounds the time. Their coordinates are therefore integers
/// of 16 bits, in steps of the component. Half a step is at most 1 / 32,767 of the component's
/// largest coordinate: 10 µm where a component moves a vertex by 30 cm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Components {
    /// Coordinates in steps, V × 3 × K: K numbers of the x of a vertex, then of its y and its z.
    coordinates: Vec<i16>,
    /// Step of each component, metres.
    step_m: Vec<f32>,
}

impl Components {
    /// Takes coordinates in steps, V × 3 × K, and the step of each of the K components in metres.
    ///
    /// [`Model::new`](crate::Model::new) checks the lengths and the steps.
    pub fn of_coordinates(coordinates: Vec<i16>, step_m: Vec<f32>) -> Self {
        Self { coordinates, step_m }
    }

    /// Rounds V × `count` vectors, those of a vertex adjacent, to steps.
    ///
    /// Steps are powers of two, so vectors that were rounded before keep their values. A component with
    /// a number that is not finite gets a step that is not finite.
    pub fn of_vectors(vectors: &[Vec3], count: usize) -> Self {
        let component = |k: usize| vectors.iter().skip(k).step_by(count.max(1));
        let step_m: Vec<f32> = (0..count).map(|k| step_of(component(k))).collect();
        let in_steps = |x: f32, step: f32| (x / step).round() as i16;
        let of_vertex = |vectors: &[Vec3]| -> Vec<i16> {
            let axis = |axis: usize| {
                let pairs = vectors.iter().zip(&step_m);
                pairs.map(move |(vector, step)| in_steps(vector[axis], *step))
            };
            (0..3).flat_map(axis).collect()
        };
        let coordinates = vectors.chunks_exact(count.max(1)).flat_map(of_vertex);
        Self {
            coordinates: coordinates.collect(),
            step_m,
        }
    }

    /// Number of components K.
    pub fn len(&self) -> usize {
        self.step_m.len()
    }

    /// Returns whether there is no component.
    pub fn is_empty(&self) -> bool {
        self.step_m.is_empty()
    }

    /// Coordinates in steps, V × 3 × K.
    pub fn coordinates(&self) -> &[i16] {
        &self.coordinates
    }

    /// Coordinates in metres, V × 3 × K.
    pub fn in_metres(&self) -> impl Iterator<Item = f32> {
        let steps = self.coordinates.iter().zip(self.step_m.iter().cycle());
        steps.map(|(steps, step_m)| f32::from(*steps) * step_m)
    }

    /// Step of each component, metres.
    pub fn step_m(&self) -> &[f32] {
        &self.step_m
    }

    /// Returns the vector of a component at a vertex, metres.
    pub fn vector(&self, vertex: usize, component: usize) -> Vec3 {
        let at = |axis: usize| f32::from(self.coordinates[(3 * vertex + axis) * self.len() + component]);
        Vec3::new(at(0), at(1), at(2)) * self.step_m[component]
    }

    /// Returns all vectors, V × K in metres, those of a vertex adjacent.
    pub fn to_vectors(&self) -> Vec<Vec3> {
        let vertices = self.coordinates.len() / (3 * self.len()).max(1);
        let all = (0..vertices).flat_map(|v| (0..self.len()).map(move |k| (v, k)));
        all.map(|(v, k)| self.vector(v, k)).collect()
    }

    /// Multiplies the vectors of each vertex by a number, and rounds again.
    pub(crate) fn masked(&self, mask: &[f32]) -> Self {
        let mut vectors = self.to_vectors();
        let of_vertices = vectors.chunks_exact_mut(self.len().max(1)).zip(mask);
        of_vertices.for_each(|(vectors, share)| vectors.iter_mut().for_each(|v| *v *= *share));
        Self::of_vectors(&vectors, self.len())
    }

    /// Returns whether all steps are not negative, and all vectors finite.
    pub(crate) fn is_usable(&self) -> bool {
        let largest = f32::from(i16::MIN).abs();
        let is_usable = |step: &f32| *step >= 0.0 && (step * largest).is_finite();
        self.step_m.iter().all(is_usable)
    }

    /// Joins the components of both, those of `other` last.
    pub(super) fn joined(&self, other: &Self) -> Self {
        let rows = |components: &Self| components.coordinates.len().checked_div(components.len());
        let row = |components: &Self, row: usize| {
            let count = components.len();
            components.coordinates[row * count..(row + 1) * count].to_vec()
        };
        let of_both = |i| [row(self, i), row(other, i)].concat();
        let count = rows(self).or(rows(other)).unwrap_or(0);
        Self {
            coordinates: (0..count).flat_map(of_both).collect(),
            step_m: [&self.step_m[..], &other.step_m].concat(),
        }
    }

    /// Returns the first components.
    pub(super) fn truncated(&self, count: usize) -> Self {
        let rows = self.coordinates.chunks_exact(self.len().max(1));
        Self {
            coordinates: rows.flat_map(|row| &row[..count]).copied().collect(),
            step_m: self.step_m[..count].to_vec(),
        }
    }

    /// Multiplies coefficients by the steps, as [`add_to`](Self::add_to) takes them. The last components
    /// may lack coefficients, which are then zero.
    pub fn scale(&self, coefficients: &[f32], out: &mut Vec<f32>) {
        out.clear();
        out.extend(coefficients.iter().zip(&self.step_m).map(|(a, step)| a * step));
        out.resize(self.len(), 0.0);
    }

    /// Adds to the vectors of the vertices from `first` on the sums of their components times
    /// coefficients, which are [scaled](Self::scale). The bytes are the same on all instruction sets.
    ///
    /// # Panics
    /// With fewer scaled coefficients than components.
    pub fn add_to(&self, first: usize, scaled: &[f32], vectors: &mut [Vec3]) {
        self.add_on(Instructions::best(), first, scaled, vectors);
    }

    fn add_on(&self, instructions: Instructions, first: usize, scaled: &[f32], vectors: &mut [Vec3]) {
        if self.is_empty() {
            return;
        }
        let rows = self.coordinates[3 * first * self.len()..].chunks_exact(3 * self.len());
        instructions.run(
            #[inline(always)]
            || {
                for (vector, rows) in vectors.iter_mut().zip(rows) {
                    *vector += sum(rows, scaled);
                }
            },
        );
    }
}

/// Step of a component: the least power of two with which the largest coordinate has no more than
/// [`MOST_STEPS`] steps.
fn step_of<'a>(vectors: impl Iterator<Item = &'a Vec3>) -> f32 {
    /// Bits of the fraction of an f32.
    const FRACTION: u32 = 0x007F_FFFF;
    // Zero times a number that is not finite is NaN, which `max` would pass over.
    let [largest, poison] = vectors.fold([0.0f32; 2], |[largest, poison], v| {
        [
            largest.max(v.abs().max_element()),
            poison + (*v * 0.0).element_sum(),
        ]
    });
    let least = largest / MOST_STEPS + poison;
    match least.is_finite() {
        // By bits, because logarithms differ between machines. A step of zero could not divide.
        true => f32::from_bits((least.max(f32::MIN_POSITIVE).to_bits() + FRACTION) & !FRACTION),
        false => f32::NAN,
    }
}

/// Sum of the components of a vertex times coefficients, which are scaled: three rows of steps.
#[inline(always)]
fn sum(rows: &[i16], scaled: &[f32]) -> Vec3 {
    let count = rows.len() / 3;
    let (whole, last) = scaled[..count].as_chunks::<LANES>();
    let mut sums = [[0.0; LANES]; 3];
    for (axis, sums) in sums.iter_mut().enumerate() {
        let (steps, last_steps) = rows[axis * count..][..count].as_chunks::<LANES>();
        for (steps, scaled) in steps.iter().zip(whole) {
            add_products(sums, steps, scaled);
        }
        if !last.is_empty() {
            let (mut steps, mut scaled) = ([0; LANES], [0.0; LANES]);
            steps[..last.len()].copy_from_slice(last_steps);
            scaled[..last.len()].copy_from_slice(last);
            add_products(sums, &steps, &scaled);
        }
    }
    Vec3::from_array(sums.map(|mut lanes| {
        // Sums by halves have the same order on all instruction sets.
        let mut half = LANES / 2;
        while half > 0 {
            for lane in 0..half {
                lanes[lane] += lanes[lane + half];
            }
            half /= 2;
        }
        lanes[0]
    }))
}

#[inline(always)]
fn add_products(sums: &mut [f32; LANES], steps: &[i16; LANES], scaled: &[f32; LANES]) {
    for lane in 0..LANES {
        sums[lane] += f32::from(steps[lane]) * scaled[lane];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::point;
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #[test]
        fn rounding_is_within_half_a_step_and_changes_nothing_twice(
            vectors in vec(point(0.3), 1..60), count in 1usize..20,
        ) {
            let vectors = &vectors[..vectors.len() / count * count];
            let rounded = Components::of_vectors(vectors, count);
            let again = rounded.to_vectors();
            for (i, (before, after)) in vectors.iter().zip(&again).enumerate() {
                let largest = vectors.iter().skip(i % count).step_by(count).map(|v| v.abs().max_element());
                let half = largest.fold(0.0, f32::max) / MOST_STEPS;
                prop_assert!((*before - *after).abs().max_element() <= half, "{before} {after}");
            }
            prop_assert_eq!(again.len(), vectors.len());
            prop_assert_eq!(Components::of_vectors(&again, count), rounded);
        }

        #[test]
        fn sums_are_those_of_the_vectors_on_all_instruction_sets(
            vectors in vec(point(0.3), 1..300), coefficients in vec(-3.0f32..3.0, 40), count in 1usize..40,
        ) {
            let vectors = &vectors[..vectors.len() / count * count];
            let components = Components::of_vectors(vectors, count);
            let mut scaled = Vec::new();
            components.scale(&coefficients, &mut scaled);
            let vertices = vectors.len() / count;
            let first = vertices / 2;
            let sums_on = |instructions| {
                let mut sums = vec![Vec3::X; vertices - first];
                components.add_on(instructions, first, &scaled, &mut sums);
                sums
            };
            let expected = sums_on(Instructions::Portable);
            for (v, sum) in (first..).zip(&expected) {
                let terms = (0..count).map(|k| components.vector(v, k).as_dvec3() * f64::from(coefficients[k]));
                let exact = terms.sum::<glam::DVec3>() + glam::DVec3::X;
                prop_assert!((sum.as_dvec3() - exact).length() < 1e-4, "{sum} {exact}");
            }
            for instructions in Instructions::available() {
                prop_assert_eq!(&sums_on(instructions), &expected, "{:?}", instructions);
            }
        }
    }

    #[test]
    fn steps_are_powers_of_two_at_all_sizes() {
        let halves = (-100..=110).map(|exponent| 1.5 * 2f32.powi(exponent));
        let near_powers = (-120..=110).flat_map(|exponent| {
            let power = 2f32.powi(exponent) * MOST_STEPS;
            [power.next_down(), power, power.next_up()]
        });
        for largest in halves.chain(near_powers) {
            let rounded = Components::of_vectors(&[Vec3::new(largest, -largest, 0.3 * largest)], 1);
            let step = rounded.step_m[0];
            assert_eq!(step.to_bits() & 0x007F_FFFF, 0, "{largest}");
            let steps = largest / step;
            assert!(
                (MOST_STEPS / 2.01..=MOST_STEPS * 1.00001).contains(&steps),
                "{largest}"
            );
            assert!((rounded.vector(0, 0).x - largest).abs() <= 1.001 * step);
            assert_eq!(
                Components::of_vectors(&rounded.to_vectors(), 1),
                rounded,
                "{largest}"
            );
        }
    }

    #[test]
    fn components_of_the_largest_numbers_are_not_usable() {
        assert!(!Components::of_vectors(&[Vec3::splat(f32::MAX)], 1).is_usable());
    }

    #[test]
    fn masked_components_are_within_half_a_step() {
        let vectors = [Vec3::new(0.1, 0.2, -0.3), Vec3::splat(0.05)];
        let components = Components::of_vectors(&vectors, 1);
        let masked = components.masked(&[0.5, 0.0]);
        let half = 0.5 * masked.step_m[0] + 0.25 * components.step_m[0];
        assert!((masked.vector(0, 0) - vectors[0] * 0.5).abs().max_element() <= half);
        assert_eq!(masked.vector(1, 0), Vec3::ZERO);
    }

    #[test]
    fn numbers_that_are_not_finite_leave_a_step_that_is_not_finite() {
        for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let vectors = [Vec3::X, Vec3::new(0.0, broken, 0.0), Vec3::Y, Vec3::Z];
            let steps = Components::of_vectors(&vectors, 2).step_m;
            assert!(steps[0].is_finite() && !steps[1].is_finite(), "{steps:?}");
        }
    }

    #[test]
    fn a_component_of_zeros_stays_at_zero() {
        let components = Components::of_vectors(&[Vec3::ZERO, Vec3::ZERO], 1);
        assert_eq!(components.to_vectors(), [Vec3::ZERO; 2]);
        assert_eq!(Components::default().to_vectors(), []);
        // Smaller than the smallest step.
        let tiny = Components::of_vectors(&[Vec3::splat(f32::MIN_POSITIVE / 2.0)], 1);
        assert!(tiny.to_vectors()[0].length() <= 2.0 * f32::MIN_POSITIVE);
    }

    #[test]
    fn joined_and_truncated_components_are_those_of_both() {
        let [a, b] = [
            vec![Vec3::X, Vec3::Y],
            vec![Vec3::Z, Vec3::ONE, Vec3::NEG_X, Vec3::Y],
        ];
        let (first, second) = (Components::of_vectors(&a, 1), Components::of_vectors(&b, 2));
        let joined = first.joined(&second);
        assert_eq!(second.in_metres().collect::<Vec<_>>()[..4], [0.0, 1.0, 0.0, 1.0]);
        assert_eq!(joined.to_vectors(), [a[0], b[0], b[1], a[1], b[2], b[3]]);
        assert_eq!(joined.truncated(1), first);
        assert_eq!(Components::default().joined(&second), second);
    }
}
