//! Contract of the precision that a model gets when it is read: the fastest one of this machine
//! whose recorded error is small enough, f32 where none is recorded, and the same weights in its
//! file.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

use common::{parts, variants};
use serde_json::json;
use unic_core::{Model, Precision, PrecisionErrors};

/// Model whose training has recorded these errors, as read from its file.
fn read(errors: Option<PrecisionErrors>) -> Model {
    let mut parts = parts(&variants()[0]);
    if let Some(errors) = errors {
        parts.about.training = json!({ PrecisionErrors::KEY: errors });
    }
    let bytes = Model::new(parts).unwrap().to_bytes().unwrap();
    Model::from_bytes(&bytes).unwrap()
}

/// Errors of 10 mm in f32, and of so many in the others.
fn errors(bf16: f64, int16: f64, int8: f64) -> PrecisionErrors {
    let [bf16, int16, int8] = [bf16, int16, int8].map(|mm| Some(mm).filter(|mm| mm.is_finite()));
    PrecisionErrors {
        f32: 10.0,
        bf16,
        int16,
        int8,
    }
}

#[test]
fn a_model_without_recorded_errors_is_read_in_f32() {
    let model = read(None);
    assert_eq!(model.precision(), Precision::F32);
    assert_eq!(model.fastest_precision(f64::INFINITY), Precision::F32);
}

#[test]
fn errors_within_the_allowed_share_are_allowed() {
    let recorded = errors(10.09, 10.2, f64::NAN);
    let allowed = |precision, share| recorded.allows(precision, share);
    assert!(allowed(Precision::F32, 0.0));
    assert!(allowed(Precision::Bf16, 0.01) && !allowed(Precision::Bf16, 0.005));
    assert!(!allowed(Precision::Int16, 0.01) && allowed(Precision::Int16, 0.03));
    assert!(!allowed(Precision::Int8, f64::INFINITY));
    // An error that is not finite does not hide the others.
    let model = read(Some(recorded));
    assert_eq!(PrecisionErrors::of(model.about()), Some(recorded));
}

#[test]
fn the_fastest_precision_within_the_allowed_error_is_taken() {
    let all_good = read(Some(errors(10.0, 9.9, 10.09)));
    let order = Precision::fastest_first(all_good.config().field.width);
    assert_eq!(all_good.precision(), order[0]);
    // One that is too coarse is left out, whatever its speed.
    for coarse in Precision::ALL.into_iter().filter(|p| *p != Precision::F32) {
        let error = |p| if p == coarse { 10.2 } else { 10.0 };
        let recorded = errors(
            error(Precision::Bf16),
            error(Precision::Int16),
            error(Precision::Int8),
        );
        let model = read(Some(recorded));
        let expected = order.into_iter().find(|p| *p != coarse).unwrap();
        assert_eq!(model.precision(), expected, "without {}", coarse.name());
        assert_eq!(model.fastest_precision(0.03), order[0]);
    }
}

#[test]
fn a_model_in_another_precision_has_the_same_file() {
    let model = read(Some(errors(10.0, 10.0, 10.0)));
    for precision in Precision::ALL {
        let other = model.clone().with_precision(precision);
        assert_eq!(other.to_bytes().unwrap(), model.to_bytes().unwrap());
    }
}
