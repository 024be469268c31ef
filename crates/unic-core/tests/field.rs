//! The contract of the field's kernels: every instruction set that this machine has agrees with the textbook in
//! every precision, on whole numbers to the bit. Crate `unic-portability` runs the same suite on other processors.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

use unic_core::{
    config::FieldConfig,
    network::{Field, FieldBiases, FieldScratch, Instructions, Linear, Precision, TILE},
};

/// Numbers from -1 to 1 that are the same on every processor, which sines are not.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 23) as f32 - 1.0
    }

    fn take(&mut self, count: usize) -> Vec<f32> {
        (0..count).map(|_| self.next()).collect()
    }

    /// What goes through it neither shrinks nor grows much.
    fn layer(&mut self, (inputs, outputs): (usize, usize)) -> Linear {
        let scale = (6.0 / inputs as f32).sqrt();
        Linear {
            inputs,
            outputs,
            weight: self.take(inputs * outputs).iter().map(|w| w * scale).collect(),
            bias: self.take(outputs).iter().map(|b| b * 0.3).collect(),
        }
    }
}

/// (inputs, outputs) of every linear map.
fn layer_sizes(config: &FieldConfig, points: usize, latent: usize) -> Vec<(usize, usize)> {
    let inputs = |i| match i {
        0 => points + latent,
        i if config.skip == Some(i) => config.width + points + latent,
        _ => config.width,
    };
    let hidden = (0..config.hidden_layers).map(|i| (inputs(i), config.width));
    hidden.chain([(config.width, 3)]).collect()
}

/// The textbook form in f64, one vertex at a time, without folding.
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

/// Width, hidden layers, skip layer, inputs of a vertex, latent numbers.
type Sizes = (usize, usize, Option<usize>, usize, usize);

const PAPER: Sizes = (256, 8, Some(5), 3, 128);

fn cases() -> Vec<Case> {
    let sizes = [
        (80, 8, Some(5), 3, 128),
        (37, 3, None, 15, 5),
        (6, 2, Some(1), 1, 1),
        (8, 1, None, 4, 2),
        (64, 4, Some(2), 9, 0),
    ];
    sizes.map(case).into()
}

fn case((width, hidden_layers, skip, points, latent): Sizes) -> Case {
    let config = FieldConfig {
        width,
        hidden_layers,
        skip,
    };
    let mut noise = Noise(width as u32);
    let sizes = layer_sizes(&config, points, latent);
    let layers = sizes.into_iter().map(|size| noise.layer(size)).collect();
    Case {
        config,
        field: Field::new(&config, points, latent, layers).unwrap(),
        latent: noise.take(latent),
        inputs: (0..points)
            .map(|_| std::array::from_fn(|_| noise.next()))
            .collect(),
    }
}

impl Case {
    fn outputs(&self, precision: Precision, set: Instructions) -> [[f32; TILE]; 3] {
        let field = self.field.clone().with_kernel(precision, set);
        let (mut biases, mut scratch) = (FieldBiases::default(), FieldScratch::default());
        let mut out = [[0.0; TILE]; 3];
        field.fold(&self.latent, &mut biases);
        // Twice, so that what is left in the buffers would show.
        for _ in 0..2 {
            field.evaluate(&biases, &self.inputs, &mut scratch, &mut out);
        }
        out
    }

    /// What the textbook says of every vertex.
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

/// Half the last bit of a number of each precision, a few times over: layers neither shrink nor grow
/// what goes through them.
fn tolerance(precision: Precision) -> f64 {
    match precision {
        Precision::F32 => 1e-5,
        Precision::Bf16 => 0.02,
        Precision::Int16 => 2e-3,
        Precision::Int8 => 0.05,
    }
}

#[test]
fn every_precision_on_every_instruction_set_agrees_with_the_textbook() {
    for case in cases().into_iter().chain([case(PAPER)]) {
        let expected = case.expected();
        for precision in Precision::ALL {
            for set in Instructions::available(precision) {
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
fn whole_numbers_give_the_same_bits_on_every_instruction_set() {
    let bits = |out: [[f32; TILE]; 3]| out.map(|c| c.map(f32::to_bits));
    for case in cases() {
        for precision in [Precision::Int16, Precision::Int8] {
            let portable = bits(case.outputs(precision, Instructions::Portable));
            for set in Instructions::available(precision) {
                assert!(
                    bits(case.outputs(precision, set)) == portable,
                    "{precision:?} {set:?}"
                );
            }
        }
    }
}

/// All outputs of the case without a latent vector, whose share of the biases is summed in an order that depends
/// on the machine.
#[test]
fn whole_numbers_give_the_same_bits_on_every_processor() {
    let case = cases().pop().unwrap();
    assert!(case.latent.is_empty());
    for (precision, expected) in [(Precision::Int16, 0x493b_36f9), (Precision::Int8, 0xceec_d625)] {
        let out = case.outputs(precision, Instructions::best(precision));
        let mix = |sum: u32, x: &f32| sum.rotate_left(5) ^ x.to_bits();
        let found = out.as_flattened().iter().fold(0, mix);
        assert_eq!(found, expected, "{precision:?}: {found:#010x}");
    }
}

#[test]
fn a_vertex_does_not_depend_on_its_neighbours() {
    for mut case in cases() {
        for precision in Precision::ALL {
            for set in Instructions::available(precision) {
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
fn numbers_that_are_none_stay_with_their_vertex() {
    for mut case in cases() {
        case.inputs[0][3] = f32::NAN;
        case.inputs[0][7] = f32::INFINITY;
        for precision in Precision::ALL {
            for set in Instructions::available(precision) {
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
    let layers = [(5, 4), (4, 2)].map(|size| Noise(1).layer(size));
    let error = Field::new(&config, 3, 2, layers.to_vec()).unwrap_err();
    assert_eq!(
        (error.layer.as_str(), error.expected_outputs, error.outputs),
        ("field.1", 3, 2)
    );
}
