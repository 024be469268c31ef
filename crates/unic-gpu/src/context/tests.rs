//! Contract of matrix units: results do not depend on the size of subgroups.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

#[path = "../../../unic-core/tests/common/mod.rs"]
mod common;

use super::*;
use crate::{GpuAnimator, GpuModel};
use std::sync::Arc;
use unic_core::Start;

/// Pretends that subgroups may be twice as large as they are, so that half of them idle.
#[test]
fn results_do_not_depend_on_idle_subgroups() {
    let context = match GpuContext::with_matrix_units() {
        Ok(context) if context.has_matrix_units() => context,
        Ok(context) => return eprintln!("skipped: {} has no matrix units", context.adapter_name()),
        Err(GpuError::NoAdapter(why)) => return eprintln!("skipped: no adapter that computes ({why})"),
        Err(other) => panic!("{other}"),
    };
    let mut larger = context.clone();
    larger.matrix_units.as_mut().unwrap().largest_subgroup *= 2;
    let [expected, found] = [context, larger].map(|context| shown_after_four_steps(&context));
    assert!(expected.iter().all(|p| p.is_finite()));
    assert_eq!(expected, found);
}

fn shown_after_four_steps(context: &GpuContext) -> Vec<glam::Vec3> {
    let model = common::model(&common::variant("second order"));
    let asset = GpuModel::new(context, model, Precision::F16Matrix).unwrap();
    let mut animator = GpuAnimator::new(Arc::new(asset)).unwrap();
    let poses = common::motion(5);
    animator
        .reset(&common::input(&poses, 0), Start::MeanShape)
        .unwrap();
    for t in 1..5 {
        animator.step(&common::input(&poses, t)).unwrap();
    }
    animator.read_back().unwrap().positions
}
