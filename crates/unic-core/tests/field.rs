//! Contract of the field's kernels: every instruction set of this machine agrees with a reference
//! in f64 for every precision, and integer precisions give the same bits on all of them.
//!
//! Crate `unic-portability` runs the same suite on other processors.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

use unic_core::{
    Precision,
    config::FieldConfig,
    network::{Field, FieldBiases, FieldScratch, Linear, TILE},
    simd::Instructions,
};

/// Pseudo-random numbers from -1 to 1, the same on every processor; sines, for one, are not.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 23) as f32 - 1.0
    }

    fn take(&mut self, count: usize) -> Vec<f32> {
        (0..count).map(|_| self.next()).collect()
    }

    /// Random layer whose outputs are about as large as its inputs.
    fn layer(&mut self, inputs: usize, outputs: usize) -> Linear {
        let scale = (6.0 / inputs as f32).sqrt();
        Linear {
            inputs,
            outputs,
            weight: self.take(inputs * outputs).iter().map(|w| w * scale).collect(),
            bias: self.take(outputs).iter().map(|b| b * 0.3).collect(),
        }
    }
}

/// Random layers of a field.
fn layers(config: &FieldConfig, points: usize, latent: usize, noise: &mut Noise) -> Vec<Linear> {
    let inputs = |i| match i {
        0 => points + latent,
        i if config.skip == Some(i) => config.width + points + latent,
        _ => config.width,
    };
    let mut layers: Vec<Linear> = (0..config.hidden_layers)
        .map(|i| noise.layer(inputs(i), config.width))
        .collect();
    layers.push(noise.layer(config.width, 3));
    layers
}

/// Evaluates a field in f64, one vertex at a time, without folding.
fn reference(field: &Field, skip: Option<usize>, point: &[f32], latent: &[f32]) -> Vec<f64> {
    let input: Vec<f64> = point.iter().chain(latent).map(|x| f64::from(*x)).collect();
    let mut x = input.clone();
    for (i, layer) in field.layers().iter().enumerate() {
        if skip == Some(i) {
            x.extend(&input);
        }
        let last = i + 1 == field.layers().len();
        x = (layer.weight.chunks(layer.inputs).zip(&layer.bias))
            .map(|(row, b)| f64::from(*b) + row.iter().zip(&x).map(|(w, x)| f64::from(*w) * x).sum::<f64>())
            .map(|y| if last { y } else { y.max(0.0) })
            .collect();
    }
    x
}

/// A field, a latent vector, and the inputs of a tile.
struct Case {
    config: FieldConfig,
    field: Field,
    latent: Vec<f32>,
    inputs: Vec<[f32; TILE]>,
}

/// Random cases of small fields, the last one without a latent vector.
fn cases() -> Vec<Case> {
    vec![
        Case::new(config(80, 8, Some(5)), 3, 128),
        Case::new(config(37, 3, None), 15, 5),
        Case::new(config(6, 2, Some(1)), 1, 1),
        Case::new(config(8, 1, None), 4, 2),
        Case::new(config(64, 4, Some(2)), 9, 0),
    ]
}

/// Random case of the paper's field.
fn paper_case() -> Case {
    Case::new(config(256, 8, Some(5)), 3, 128)
}

fn config(width: usize, hidden_layers: usize, skip: Option<usize>) -> FieldConfig {
    FieldConfig {
        width,
        hidden_layers,
        skip,
    }
}

impl Case {
    /// Makes a case with this many inputs of a vertex and numbers in the latent vector.
    fn new(config: FieldConfig, points: usize, latent: usize) -> Self {
        let mut noise = Noise(config.width as u32);
        let layers = layers(&config, points, latent, &mut noise);
        Self {
            config,
            field: Field::new(&config, points, latent, layers).unwrap(),
            latent: noise.take(latent),
            inputs: (0..points)
                .map(|_| std::array::from_fn(|_| noise.next()))
                .collect(),
        }
    }

    fn outputs(&self, precision: Precision, set: Instructions) -> [[f32; TILE]; 3] {
        let field = self.field.clone().with_kernel(precision, set);
        let (mut biases, mut scratch) = (FieldBiases::default(), FieldScratch::default());
        let mut out = [[0.0; TILE]; 3];
        field.fold(&self.latent, &mut biases);
        // Twice: the second result would show stale numbers in the buffers.
        for _ in 0..2 {
            field.evaluate(&biases, &self.inputs, &mut scratch, &mut out);
        }
        out
    }

    /// Outputs of the reference at every vertex.
    fn expected(&self) -> Vec<Vec<f64>> {
        let point = |lane: usize| self.inputs.iter().map(|c| c[lane]).collect::<Vec<f32>>();
        let of = |lane| reference(&self.field, self.config.skip, &point(lane), &self.latent);
        (0..TILE).map(of).collect()
    }
}

/// Largest error over the tile, in units of the largest output.
fn error(found: &[[f32; TILE]; 3], expected: &[Vec<f64>]) -> f64 {
    let (mut error, mut size) = (0f64, 0f64);
    for (lane, expected) in expected.iter().enumerate() {
        for (found, expected) in found.iter().zip(expected) {
            error = error.max((f64::from(found[lane]) - expected).abs());
            size = size.max(expected.abs());
        }
    }
    error / size
}

/// Largest error of each precision: a few times half of its last bit, because layers keep the size
/// of their inputs.
fn tolerance(precision: Precision) -> f64 {
    match precision {
        Precision::F32 => 1e-5,
        Precision::Bf16 => 0.02,
        Precision::Int16 => 2e-3,
        Precision::Int8 => 0.05,
    }
}

#[test]
fn every_precision_on_every_instruction_set_agrees_with_the_reference() {
    for case in cases().into_iter().chain([paper_case()]) {
        let expected = case.expected();
        for precision in Precision::ALL {
            for set in precision.instructions() {
                let error = error(&case.outputs(precision, set), &expected);
                let width = case.config.width;
                assert!(
                    error < tolerance(precision),
                    "{precision:?} {set:?} {width}: {error}"
                );
            }
        }
    }
}

#[test]
fn integer_precisions_give_the_same_bits_on_every_instruction_set() {
    let bits = |out: [[f32; TILE]; 3]| out.map(|c| c.map(f32::to_bits));
    for case in cases() {
        for precision in [Precision::Int16, Precision::Int8] {
            let portable = bits(case.outputs(precision, Instructions::Portable));
            for set in precision.instructions() {
                assert!(
                    bits(case.outputs(precision, set)) == portable,
                    "{precision:?} {set:?}"
                );
            }
        }
    }
}

/// The case has no latent vector, because its products are summed in an order that depends on the
/// machine.
#[test]
fn integer_precisions_give_the_same_bits_on_every_processor() {
    let case = cases().pop().unwrap();
    assert!(case.latent.is_empty());
    for (precision, expected) in [(Precision::Int16, 0x493b_36f9), (Precision::Int8, 0xceec_d625)] {
        let out = case.outputs(precision, precision.best_instructions());
        let mix = |sum: u32, x: &f32| sum.rotate_left(5) ^ x.to_bits();
        let found = out.as_flattened().iter().fold(0, mix);
        assert_eq!(found, expected, "{precision:?}: {found:#010x}");
    }
}

#[test]
fn a_vertex_does_not_depend_on_its_neighbours() {
    for mut case in cases() {
        for precision in Precision::ALL {
            for set in precision.instructions() {
                let before = case.outputs(precision, set);
                case.inputs.iter_mut().for_each(|channel| channel[5] *= 1000.0);
                let after = case.outputs(precision, set);
                case.inputs.iter_mut().for_each(|channel| channel[5] /= 1000.0);
                let others = |out: [[f32; TILE]; 3]| {
                    out.map(|mut c| {
                        c[5] = 0.0;
                        c
                    })
                };
                assert_eq!(others(before), others(after), "{precision:?} {set:?}");
            }
        }
    }
}

#[test]
fn nan_and_infinity_do_not_spread_to_other_vertices() {
    for mut case in cases() {
        case.inputs[0][3] = f32::NAN;
        case.inputs[0][7] = f32::INFINITY;
        for precision in Precision::ALL {
            for set in precision.instructions() {
                let out = case.outputs(precision, set);
                let finite = |lane: usize| out.iter().all(|c| c[lane].is_finite());
                assert!(
                    (0..TILE).all(|l| l == 3 || l == 7 || finite(l)),
                    "{precision:?} {set:?}"
                );
            }
        }
    }
}

#[test]
fn layers_of_other_sizes_are_refused() {
    let config = FieldConfig {
        width: 4,
        hidden_layers: 1,
        skip: None,
    };
    let layers = vec![Noise(1).layer(5, 4), Noise(1).layer(4, 2)];
    let error = Field::new(&config, 3, 2, layers).unwrap_err();
    assert_eq!(
        (error.layer.as_str(), error.expected_outputs, error.outputs),
        ("field.1", 3, 2)
    );
}
