use super::*;

fn rows(frames: usize, windows: usize) -> WindowRows {
    WindowRows { frames, windows }
}
use rand::RngExt;
use rand::rngs::ChaCha8Rng;

fn shape(encoder: Vec<usize>, channels: usize, categories: usize) -> NetworkShape {
    let field = FieldShape {
        latent: channels,
        hidden: 4,
        hidden_layers: 1,
        skip: None,
        ..FieldShape::PAPER
    };
    NetworkShape {
        encoder,
        channels,
        categories,
        code: LatentCode::PickedLogit,
        field,
        zero_head: false,
    }
}

fn regularisation(dropout: f32, input_dropout: f32, dropout_by_window: bool) -> RegularisationConfig {
    let config = crate::TrainConfig::preset(crate::Preset::Tiny).regularisation;
    RegularisationConfig {
        dropout,
        input_dropout,
        dropout_by_window,
        ..config
    }
}

/// A single linear map with no weights: its logits are the biases, whatever the motion.
fn constant_logits(shape: &NetworkShape, logits: &[f32], device: &Device) -> Network {
    let mut values = Network::new(shape, 1, device).values();
    values[0].fill(0.0);
    values[1] = logits.to_vec();
    Network::with_parameters(shape, &values, device)
}

#[test]
fn categories_are_picked_with_the_probabilities_of_the_softmax() {
    const ROWS: usize = 40_000;
    let logits = [1.0f32, -0.5, 0.3, 2.0];
    let shape = shape(vec![2, 4], 1, 4);
    let device = Device::flex();
    let noise = StepNoise::draw(&shape, &regularisation(0.0, 0.0, false), rows(1, ROWS), 1, 0);
    let network = constant_logits(&shape, &logits, &device);
    let latents = network.latents(&shape, Tensor::zeros([ROWS, 2], &device), Some(&noise));
    let latents = latents.try_into_vec_as::<f32>().unwrap();
    let total: f32 = logits.iter().map(|l| l.exp()).sum();
    let chi_square: f32 = logits
        .iter()
        .map(|logit| {
            let expected = ROWS as f32 * logit.exp() / total;
            let found = latents.iter().filter(|z| *z == logit).count() as f32;
            (found - expected).powi(2) / expected
        })
        .sum();
    // Three degrees of freedom: 16.3 is passed once in a thousand.
    assert!(chi_square < 16.3, "{chi_square}");
    // Without noise it is always the largest.
    let latents = network.latents(&shape, Tensor::zeros([3, 2], &device), None);
    assert_eq!(latents.try_into_vec_as::<f32>().unwrap(), [2.0; 3]);
}

#[test]
fn one_hot_code_has_the_value_of_the_argmax_and_the_gradient_of_the_softmax() {
    let shape = NetworkShape {
        code: LatentCode::OneHot,
        ..shape(vec![2, 6], 2, 3)
    };
    let logits = [0.1f32, 0.9, 0.5, 3.0, 1.0, 2.0];
    let device = Device::flex().autodiff();
    let network = constant_logits(&shape, &logits, &device);
    let code = network.latents(&shape, Tensor::ones([1, 2], &device), None);
    let values = code.clone().inner().try_into_vec_as::<f32>().unwrap();
    assert_eq!(values, [0.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
    let factors = [2.0f32, -3.0, 1.0, 0.5, 4.0, -1.0];
    let weighted = code * Tensor::<2>::from_data([factors], &device);
    let gradients = weighted.sum().backward();
    let bias = network.encoder[0].bias.as_ref().unwrap().val();
    let gradient = bias.grad(&gradients).unwrap().try_into_vec_as::<f32>().unwrap();
    let soft = |logits: &[f64]| -> f64 {
        let of_channel = |channel: usize| {
            let exp = |k: usize| logits[3 * channel + k].exp();
            let weighted = |k: usize| exp(k) * f64::from(factors[3 * channel + k]);
            (0..3).map(weighted).sum::<f64>() / (0..3).map(exp).sum::<f64>()
        };
        of_channel(0) + of_channel(1)
    };
    let logits = logits.map(f64::from);
    for (i, found) in gradient.into_iter().enumerate() {
        let moved = |by: f64| {
            let mut logits = logits;
            logits[i] += by;
            soft(&logits)
        };
        let slope = (moved(1e-4) - moved(-1e-4)) / 2e-4;
        assert!((f64::from(found) - slope).abs() < 1e-5, "{i}: {found} {slope}");
    }
    // Without gradients, as in validation, the code is the same.
    let plain = Device::flex();
    let network = constant_logits(&shape, &[0.1, 0.9, 0.5, 3.0, 1.0, 2.0], &plain);
    let code = network.latents(&shape, Tensor::ones([1, 2], &plain), None);
    assert_eq!(code.try_into_vec_as::<f32>().unwrap(), values);
}

#[test]
fn gradients_reach_only_the_picked_logits() {
    let shape = shape(vec![2, 6], 2, 3);
    let device = Device::flex().autodiff();
    let network = constant_logits(&shape, &[0.1, 0.9, 0.5, 3.0, 1.0, 2.0], &device);
    let rows = 5;
    let latents = network.latents(&shape, Tensor::ones([rows, 2], &device), None);
    let factors = Tensor::<2>::from_data([[2.0f32, -3.0]], &device);
    let gradients = (latents * factors).sum().backward();
    let bias = network.encoder[0].bias.as_ref().unwrap().val();
    let gradient = bias.grad(&gradients).unwrap().try_into_vec_as::<f32>().unwrap();
    assert_eq!(gradient, [0.0, 10.0, 0.0, -15.0, 0.0, 0.0]);
}

#[test]
fn dropout_keeps_the_mean_and_drops_its_share() {
    let (rate, input_rate) = (0.25, 0.5);
    let shape = shape(vec![100, 80, 4], 1, 4);
    let noise = StepNoise::draw(
        &shape,
        &regularisation(rate, input_rate, false),
        rows(20, 50),
        1,
        0,
    );
    for (mask, rate) in noise.masks.iter().zip([input_rate, rate]) {
        let mask = mask.as_ref().unwrap();
        let count = mask.len() as f32;
        let mean = mask.iter().sum::<f32>() / count;
        let dropped = mask.iter().filter(|m| **m == 0.0).count() as f32 / count;
        // Four standard deviations of a mean of `count` factors.
        let tolerance = 4.0 * (rate / (1.0 - rate) / count).sqrt();
        assert!(
            (mean - 1.0).abs() < tolerance && (dropped - rate).abs() < tolerance,
            "{mean} {dropped}"
        );
    }
    let none = StepNoise::draw(&shape, &regularisation(0.0, 0.0, false), rows(2, 3), 1, 0);
    assert!(none.masks.iter().all(Option::is_none));
}

#[test]
fn masks_by_window_are_the_same_in_every_frame_and_differ_between_windows() {
    let shape = shape(vec![30, 20, 4], 1, 4);
    let (frames, windows) = (4, 3);
    let masks = |by_window| {
        StepNoise::draw(
            &shape,
            &regularisation(0.5, 0.5, by_window),
            rows(frames, windows),
            1,
            0,
        )
        .masks
    };
    for (layer, width) in [(0, 30), (1, 20)] {
        let mask = masks(true)[layer].clone().unwrap();
        let by_frame: Vec<&[f32]> = mask.chunks(windows * width).collect();
        assert_eq!(by_frame.len(), frames);
        assert!(by_frame.iter().all(|frame| *frame == by_frame[0]));
        assert_ne!(by_frame[0][..width], by_frame[0][width..2 * width]);
        let mask = masks(false)[layer].clone().unwrap();
        assert_eq!(mask.len(), frames * windows * width);
        assert_ne!(
            mask[..windows * width],
            mask[windows * width..2 * windows * width]
        );
    }
}

#[test]
fn noise_depends_on_seed_and_step_alone() {
    let shape = shape(vec![30, 4], 1, 4);
    let draw =
        |seed, step| StepNoise::draw(&shape, &regularisation(0.5, 0.5, false), rows(2, 3), seed, step).gumbel;
    assert_eq!(draw(1, 5), draw(1, 5));
    assert_ne!(draw(1, 5), draw(2, 5));
    assert_ne!(draw(1, 5), draw(1, 6));
}

#[test]
fn parameters_round_trip_and_start_within_their_bounds() {
    let shape = shape(vec![10, 8, 4], 1, 4);
    let device = Device::flex();
    let network = Network::new(&shape, 7, &device);
    let values = network.values();
    assert_eq!(
        Network::with_parameters(&shape, &values, &device).values(),
        values
    );
    for (tensor, inputs) in values.iter().zip([10.0f32, 10.0, 8.0, 8.0]) {
        let bound = inputs.sqrt().recip();
        let largest = tensor.iter().fold(0.0f32, |a, b| a.max(b.abs()));
        assert!(largest <= bound && largest > 0.5 * bound);
    }
    let mut rng: ChaCha8Rng = generator(7, Stream::Parameters, 0);
    assert_eq!(values[0][0], (2.0 * rng.random::<f32>() - 1.0) / 10.0f32.sqrt());
}

#[test]
fn zero_head_outputs_zero() {
    let device = Device::flex().autodiff();
    let mut shape = shape(vec![10, 4], 1, 4);
    let largest = |shape: &NetworkShape| {
        let field = Network::new(shape, 7, &device)
            .field(shape, Products::F32)
            .unwrap();
        let outputs = field
            .forward(Tensor::ones([5, 3], &device), Tensor::ones([1, 1], &device))
            .unwrap();
        outputs.abs().max().into_scalar::<f32>()
    };
    assert!(largest(&shape) > 0.0);
    shape.zero_head = true;
    assert_eq!(largest(&shape), 0.0);
}
