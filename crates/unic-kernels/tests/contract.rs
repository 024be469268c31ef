//! Contract:
//!
//! - Results have the same bytes for any number of threads, every exact instruction set and every
//!   retention.
//! - Parameter gradients are added, all others are overwritten.
//! - Empty batches are valid.
//! - Inputs that do not fit are errors that name the input, and outputs stay unchanged.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the run")]

mod common;

use common::{Case, compute, numbers};
use unic_kernels::*;

const SHAPE: FieldShape = FieldShape {
    point_inputs: 3,
    latent: 5,
    hidden: 40,
    hidden_layers: 3,
    skip: Some(2),
    outputs: 3,
};

/// The default instruction set, and matrix units if there are any.
fn default_and_matrix_units() -> impl Iterator<Item = InstructionSet> {
    let matrix_units = Some(InstructionSet::Amx).filter(|set| set.is_available());
    std::iter::once(InstructionSet::detect()).chain(matrix_units)
}

fn on_threads<T: Send>(threads: usize, run: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
        .install(run)
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let case = Case::new(SHAPE, 7, 900, 1);
    let gradients = numbers(case.output_count(), 1.0, 2);
    let run = || {
        compute(
            &case,
            &case.field(),
            &mut SavedActivations::default(),
            &gradients,
            0.0,
        )
    };
    let one = on_threads(1, run);
    for threads in [2, 3, 8] {
        assert!(one == on_threads(threads, run), "{threads} threads");
    }
}

#[test]
fn all_exact_instruction_sets_give_the_same_bytes() {
    let shapes = [
        SHAPE,
        FieldShape {
            hidden: 17,
            point_inputs: 34,
            outputs: 5,
            ..SHAPE
        },
    ];
    for case in shapes.map(|shape| Case::new(shape, 3, 75, 1)) {
        let gradients = numbers(case.output_count(), 1.0, 2);
        let run = |set| {
            compute(
                &case,
                &case.field_on(set),
                &mut SavedActivations::default(),
                &gradients,
                0.0,
            )
        };
        let portable = run(InstructionSet::Portable);
        for set in [InstructionSet::Avx512, InstructionSet::Avx2] {
            match set.is_available() {
                true => assert!(portable == run(set), "{set:?}"),
                false => eprintln!("skipped: {set:?} is not available"),
            }
        }
    }
}

/// Small integers: bf16 represents them and f32 their products and sums exactly.
fn whole(count: usize, most: i32, seed: u64) -> Vec<f32> {
    let wide = numbers(count, f64::from(most) + 0.499, seed);
    wide.into_iter().map(f32::round).collect()
}

#[test]
fn matrix_units_are_exact_for_small_integers() {
    if !InstructionSet::Amx.is_available() {
        eprintln!("skipped: {:?} is not available", InstructionSet::Amx);
        return;
    }
    // With one hidden layer no factor needs more than the 8 significant bits of bf16.
    for (hidden, point_inputs, outputs) in [(40, 3, 3), (17, 34, 2), (256, 3, 3), (64, 5, 1), (1, 1, 4)] {
        let shape = FieldShape {
            hidden,
            hidden_layers: 1,
            skip: Some(1),
            point_inputs,
            outputs,
            ..SHAPE
        };
        for (groups, points) in [(3, 75), (1, 1), (2, 450), (5, 192)] {
            let mut case = Case::new(shape, groups, points, 1);
            case.parameters = whole(case.parameters.len(), 1, 4);
            case.points = whole(case.points.len(), 2, 5);
            case.latents = whole(case.latents.len(), 2, 6);
            let gradients = whole(case.output_count(), 2, 7);
            let run = |set| {
                compute(
                    &case,
                    &case.field_on(set),
                    &mut SavedActivations::default(),
                    &gradients,
                    3.0,
                )
            };
            let (exact, found) = (run(InstructionSet::Portable), run(InstructionSet::Amx));
            assert!(exact == found, "{shape:?}, {groups} x {points}");
        }
    }
}

#[test]
fn matrix_units_give_the_same_bytes_for_any_number_of_threads() {
    if !InstructionSet::Amx.is_available() {
        eprintln!("skipped: {:?} is not available", InstructionSet::Amx);
        return;
    }
    let case = Case::new(SHAPE, 7, 900, 1);
    let gradients = numbers(case.output_count(), 1.0, 2);
    let field = case.field_on(InstructionSet::Amx);
    let run = || compute(&case, &field, &mut SavedActivations::default(), &gradients, 0.0);
    let one = on_threads(1, run);
    for threads in [2, 5] {
        assert!(one == on_threads(threads, run), "{threads} threads");
    }
    let mut none = SavedActivations::new(Retention::Recompute);
    assert!(one == compute(&case, &field, &mut none, &gradients, 0.0));
}

#[test]
fn recomputed_activations_give_the_same_bytes_and_take_no_memory() {
    let case = Case::new(SHAPE, 3, 500, 1);
    let gradients = numbers(case.output_count(), 1.0, 2);
    let (mut kept, mut none) = (
        SavedActivations::default(),
        SavedActivations::new(Retention::Recompute),
    );
    let expected = compute(&case, &case.field(), &mut kept, &gradients, 0.0);
    assert!(expected == compute(&case, &case.field(), &mut none, &gradients, 0.0));
    assert!(none.bytes() * 100 < kept.bytes());
}

#[test]
fn reused_buffers_do_not_change_results() {
    let gradients = numbers(9_000, 1.0, 2);
    let mut saved = SavedActivations::default();
    for (groups, points) in [(2, 900), (1, 7), (5, 300)] {
        let case = Case::new(SHAPE, groups, points, 1);
        let gradients = &gradients[..case.output_count()];
        let fresh = compute(
            &case,
            &case.field(),
            &mut SavedActivations::default(),
            gradients,
            0.0,
        );
        assert!(fresh == compute(&case, &case.field(), &mut saved, gradients, 0.0));
    }
}

#[test]
fn parameter_gradients_are_added_and_the_others_overwritten() {
    let case = Case::new(SHAPE, 2, 40, 1);
    let gradients = numbers(case.output_count(), 1.0, 2);
    let from_zero = compute(
        &case,
        &case.field(),
        &mut SavedActivations::default(),
        &gradients,
        0.0,
    );
    let from_ten = compute(
        &case,
        &case.field(),
        &mut SavedActivations::default(),
        &gradients,
        10.0,
    );
    assert_eq!(from_zero.points, from_ten.points);
    assert_eq!(from_zero.latents, from_ten.latents);
    for (zero, ten) in from_zero.parameters.iter().zip(&from_ten.parameters) {
        assert!((zero + 10.0 - ten).abs() < 1e-4, "{zero} {ten}");
    }
}

#[test]
fn empty_batches_do_not_change_parameter_gradients() {
    for (groups, points) in [(0, 0), (0, 10), (3, 0)] {
        let case = Case::new(SHAPE, groups, points, 1);
        for set in default_and_matrix_units() {
            let found = compute(
                &case,
                &case.field_on(set),
                &mut SavedActivations::default(),
                &[],
                4.0,
            );
            assert!(found.parameters.iter().all(|&gradient| gradient == 4.0));
            assert!(found.latents.iter().all(|&gradient| gradient == 0.0));
        }
    }
}

#[test]
fn nan_inputs_give_nan_outputs_at_the_same_point_only() {
    let mut case = Case::new(SHAPE, 1, 30, 1);
    case.points[3 * 4] = f32::NAN;
    for set in default_and_matrix_units() {
        let mut outputs = vec![0.0; case.output_count()];
        case.field_on(set).infer(&case.batch(), &mut outputs).unwrap();
        let nan_points: Vec<usize> = (0..30)
            .filter(|point| outputs[point * 3..point * 3 + 3].iter().any(|y| y.is_nan()))
            .collect();
        assert_eq!(nan_points, [4], "{set:?}");
    }
}

#[test]
fn slices_of_wrong_length_are_errors_and_leave_outputs_unchanged() {
    let case = Case::new(SHAPE, 2, 10, 1);
    let mut field = case.field();
    let mut saved = SavedActivations::default();
    let mut outputs = vec![7.0; case.output_count() - 1];
    let error = field
        .forward(&case.batch(), &mut outputs, &mut saved)
        .unwrap_err();
    assert_eq!(
        error,
        KernelError::Length {
            what: "outputs",
            expected: 60,
            found: 59
        }
    );
    assert!(outputs.iter().all(|&output| output == 7.0));
    assert!(matches!(
        field.load(&[0.0]),
        Err(KernelError::Length {
            what: "parameters",
            found: 1,
            ..
        })
    ));
    let short = Batch {
        latents: &case.latents[1..],
        ..case.batch()
    };
    assert!(matches!(
        field.infer(&short, &mut outputs),
        Err(KernelError::Length { what: "latents", .. })
    ));
    let gradients = Gradients {
        points: &mut [0.0; 60],
        latents: &mut [0.0; 10],
        parameters: &mut [],
    };
    let result = field.backward(
        &case.batch(),
        &saved,
        &[0.0; 60],
        gradients,
        &mut BackwardScratch::default(),
    );
    assert!(matches!(result, Err(KernelError::Saved { .. })));
}

#[test]
fn shapes_out_of_range_are_errors() {
    for shape in [
        FieldShape { hidden: 0, ..SHAPE },
        FieldShape {
            point_inputs: usize::MAX,
            ..SHAPE
        },
        FieldShape {
            skip: Some(0),
            ..SHAPE
        },
        FieldShape {
            skip: Some(4),
            ..SHAPE
        },
    ] {
        assert!(
            matches!(Field::new(shape), Err(KernelError::Size { .. })),
            "{shape:?}"
        );
    }
}

#[test]
fn the_published_field_has_the_published_cost_and_shape() {
    assert_eq!(FieldShape::PAPER.flops_per_point(), 922_112);
    let shapes: Vec<_> = FieldShape::PAPER
        .layout()
        .iter()
        .map(|map| (map.outputs, map.inputs()))
        .collect();
    assert_eq!(
        (shapes[0], shapes[1], shapes[5], shapes[8]),
        ((256, 131), (256, 256), (256, 387), (3, 256))
    );
}
