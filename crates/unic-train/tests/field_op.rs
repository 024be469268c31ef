//! Contract: the fused field is the field of Burn's own operations, in value and in every
//! gradient, and its gradients are those of finite differences.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use burn::tensor::{Tensor, TensorData};
use common::{device, numbers, relative_error};
use proptest::prelude::*;
use unic_kernels::{FieldShape, InstructionSet};
use unic_train::{PackedField, Products, composed};

/// Data of one evaluation: `groups` latents, each of `points` points.
struct Case {
    shape: FieldShape,
    groups: usize,
    points: usize,
    /// Points, latents, parameters; row-major.
    values: [Vec<f32>; 3],
}

#[derive(Clone, Copy)]
enum Implementation {
    Fused(Products),
    Composed,
}

const FUSED: Implementation = Implementation::Fused(Products::F32);

impl Case {
    fn new(shape: FieldShape, groups: usize, points: usize) -> Self {
        let scale = (6.0 / shape.hidden as f32).sqrt();
        let values = [
            numbers(groups * points * shape.point_inputs, 1.0, 1),
            numbers(groups * shape.latent, 1.0, 2),
            numbers(shape.parameter_count(), scale, 3),
        ];
        Self {
            shape,
            groups,
            points,
            values,
        }
    }

    fn upstream(&self) -> Vec<f32> {
        numbers(self.groups * self.points * self.shape.outputs, 1.0, 4)
    }

    /// Outputs, and the gradients of Σ upstream · output by points, latents and parameters.
    fn evaluate(&self, implementation: Implementation) -> [Vec<f32>; 4] {
        let device = device();
        let rows = self.groups * self.points;
        let matrix = |i: usize, sizes: [usize; 2]| {
            Tensor::<2>::from_data(TensorData::new(self.values[i].clone(), sizes), &device).require_grad()
        };
        let x = matrix(0, [rows, self.shape.point_inputs]);
        let z = matrix(1, [self.groups, self.shape.latent]);
        let count = [self.values[2].len()];
        let w =
            Tensor::<1>::from_data(TensorData::new(self.values[2].clone(), count), &device).require_grad();
        let outputs = match implementation {
            Implementation::Fused(products) => {
                let field = PackedField::new(self.shape, w.clone(), products).unwrap();
                field.forward(x.clone(), z.clone()).unwrap()
            }
            Implementation::Composed => composed(&self.shape, x.clone(), z.clone(), w.clone()),
        };
        let upstream = TensorData::new(self.upstream(), [rows, self.shape.outputs]);
        let gradients = (outputs.clone() * Tensor::from_data(upstream, &device))
            .sum()
            .backward();
        let host = |t: Tensor<2>| t.try_into_vec_as::<f32>().unwrap();
        [
            host(outputs.inner()),
            host(x.grad(&gradients).unwrap()),
            host(z.grad(&gradients).unwrap()),
            w.grad(&gradients).unwrap().try_into_vec_as::<f32>().unwrap(),
        ]
    }

    /// Σ upstream · output, in f64.
    fn objective(&self) -> f64 {
        let [outputs, ..] = self.evaluate(FUSED);
        outputs
            .iter()
            .zip(self.upstream())
            .map(|(o, u)| f64::from(*o) * f64::from(u))
            .sum()
    }
}

fn assert_fused_is_composed(case: &Case) {
    let fused = case.evaluate(FUSED);
    let composed = case.evaluate(Implementation::Composed);
    for (name, (a, b)) in ["outputs", "points", "latents", "parameters"]
        .iter()
        .zip(fused.iter().zip(&composed))
    {
        let error = relative_error(a, b);
        assert!(
            error < 1e-4,
            "{name}: {error} for {:?}, {} x {}",
            case.shape,
            case.groups,
            case.points
        );
    }
}

#[test]
fn fused_equals_composed_for_the_published_field() {
    assert_fused_is_composed(&Case::new(FieldShape::PAPER, 3, 37));
}

/// Values by half a percent. Gradients by more: ReLUs whose input is within the rounding turn on or
/// off.
#[test]
fn matrix_units_approximate_the_composed_field() {
    if !InstructionSet::Amx.is_available() {
        eprintln!("skipped: {:?} is not available", InstructionSet::Amx);
        return;
    }
    let shape = FieldShape {
        hidden: 64,
        hidden_layers: 3,
        skip: Some(2),
        ..FieldShape::PAPER
    };
    let case = Case::new(shape, 3, 37);
    // Twice: the second forward pass finds what the first one's backward pass has left.
    for _ in 0..2 {
        let found = case.evaluate(Implementation::Fused(Products::Bf16));
        let exact = case.evaluate(Implementation::Composed);
        let errors: Vec<f64> = found
            .iter()
            .zip(&exact)
            .map(|(a, b)| relative_error(a, b))
            .collect();
        assert!((1e-5..0.01).contains(&errors[0]), "{errors:?}");
        assert!(errors[1..].iter().all(|e| *e < 0.25), "{errors:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn fused_equals_composed_for_odd_shapes(
        [point_inputs, latent, hidden] in [1usize..17, 1..20, 1..50],
        [hidden_layers, skip, outputs] in [1usize..5, 0..5, 1..6],
        [groups, points] in [1usize..4, 1..70],
    ) {
        let skip = (1..=hidden_layers).contains(&skip).then_some(skip);
        let shape = FieldShape { point_inputs, latent, hidden, hidden_layers, skip, outputs };
        assert_fused_is_composed(&Case::new(shape, groups, points));
    }
}

/// Along each gradient the objective grows by the gradient's norm. Of few points and units, so that
/// no ReLU turns on or off within the step.
#[test]
fn gradients_are_those_of_finite_differences() {
    const STEP: f32 = 1e-3;
    let shape = FieldShape {
        point_inputs: 5,
        latent: 4,
        hidden: 9,
        hidden_layers: 3,
        skip: Some(2),
        outputs: 3,
    };
    let [_, gradients @ ..] = Case::new(shape, 2, 3).evaluate(FUSED);
    for (i, gradient) in gradients.iter().enumerate() {
        let norm = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
        let moved = |step: f32| {
            let mut case = Case::new(shape, 2, 3);
            case.values[i]
                .iter_mut()
                .zip(gradient)
                .for_each(|(x, g)| *x += step * g / norm);
            case.objective()
        };
        let slope = (moved(STEP) - moved(-STEP)) / f64::from(2.0 * STEP);
        let error = (slope / f64::from(norm) - 1.0).abs();
        // Rounding of f32 outputs over a step of a thousandth.
        assert!(error < 2e-3, "parent {i}: slope {slope}, gradient {norm}");
    }
}

#[test]
fn sizes_that_do_not_fit_are_refused() {
    let device = device();
    let zeros = |count: usize| Tensor::<1>::zeros([count], &device);
    let shape = FieldShape {
        point_inputs: 2,
        latent: 3,
        hidden: 4,
        hidden_layers: 1,
        skip: None,
        outputs: 3,
    };
    assert!(PackedField::new(shape, zeros(shape.parameter_count() - 1), Products::F32).is_err());
    let field = PackedField::new(shape, zeros(shape.parameter_count()), Products::F32).unwrap();
    let forward = |points: [usize; 2], latents: [usize; 2]| {
        field
            .forward(Tensor::zeros(points, &device), Tensor::zeros(latents, &device))
            .is_ok()
    };
    assert!(forward([6, 2], [2, 3]));
    assert!(!forward([6, 3], [2, 3]), "points of another width");
    assert!(!forward([6, 2], [2, 2]), "latents of another width");
    assert!(
        !forward([7, 2], [2, 3]),
        "rows that are no multiple of the groups"
    );
}
