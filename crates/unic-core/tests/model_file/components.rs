//! Components of the prior in a file.

use super::*;
use glam::Vec3;
use safetensors::{Dtype, SafeTensors, tensor::TensorView};

/// Returns the file with other tensors in place of those of the same names, and without some.
fn with_tensors(bytes: &[u8], others: &[(&str, TensorView)], without: &[&str]) -> Vec<u8> {
    let (_, header) = SafeTensors::read_metadata(bytes).unwrap();
    let file = SafeTensors::deserialize(bytes).unwrap();
    let is_kept = |name: &str| !without.contains(&name) && others.iter().all(|(other, _)| *other != name);
    let kept = file.tensors().into_iter().filter(|(name, _)| is_kept(name));
    let others = others
        .iter()
        .map(|(name, tensor)| ((*name).to_owned(), tensor.clone()));
    safetensors::serialize(kept.chain(others).collect::<Vec<_>>(), header.metadata().clone()).unwrap()
}

/// Vectors as a tensor of 32 bits.
fn in_32_bits(vectors: &[Vec3], shape: Vec<usize>) -> TensorView<'_> {
    TensorView::new(Dtype::F32, shape, bytemuck::cast_slice(vectors)).unwrap()
}

#[test]
fn components_of_files_are_steps_times_their_lengths() {
    let bytes = full();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let [shapes, steps] = ["prior.shapes", "prior.steps"].map(|name| file.tensor(name).unwrap());
    let numbers = shapes
        .data()
        .as_chunks()
        .0
        .iter()
        .map(|word| i16::from_le_bytes(*word));
    let steps = steps
        .data()
        .as_chunks()
        .0
        .iter()
        .map(|word| f32::from_le_bytes(*word));
    let steps: Vec<f32> = steps.collect();
    let components = &full_parts().prior.components;
    for (i, number) in numbers.enumerate() {
        let (vertex, axis, k) = (i / 3 / steps.len(), i / steps.len() % 3, i % steps.len());
        assert_eq!(
            f32::from(number) * steps[k],
            components.vector(vertex, k)[axis],
            "{i}"
        );
    }
}

#[test]
fn components_in_32_bits_are_read() {
    let bytes = full();
    let components = &full_parts().prior.components;
    let (vectors, count) = (components.to_vectors(), components.len());
    let shape = vec![vectors.len() / count, count, 3];
    let earlier = |vectors: &[Vec3]| {
        let shapes = in_32_bits(vectors, shape.clone());
        with_tensors(&bytes, &[("prior.shapes", shapes)], &["prior.steps"])
    };
    assert!(read_frugally(&earlier(&vectors)).unwrap().to_bytes().unwrap() == bytes);
    // Steps do not belong to numbers of 32 bits.
    let both = with_tensors(
        &bytes,
        &[("prior.shapes", in_32_bits(&vectors, shape.clone()))],
        &[],
    );
    assert!(refusal(&both).contains("prior.steps"));
    // Others are rounded, by half a step at most.
    let others: Vec<Vec3> = vectors.iter().map(|v| *v * 0.77).collect();
    let read = read_frugally(&earlier(&others)).unwrap();
    for (read, other) in read.prior().components.to_vectors().iter().zip(&others) {
        assert!((*read - *other).abs().max_element() < 2e-6, "{read} {other}");
    }
    let mut broken = vectors.clone();
    broken[1].y = f32::NAN;
    assert!(refusal(&earlier(&broken)).contains("the prior"));
}

#[test]
fn a_prior_without_vertices_is_refused_whatever_its_number_of_components() {
    let shapes = in_32_bits(&[], vec![0, 1 << 60, 3]);
    let empty = in_32_bits(&[], vec![0, 3]);
    let bytes = with_tensors(&full(), &[("prior.mean", empty), ("prior.shapes", shapes)], &[]);
    let error = read_frugally(&bytes).unwrap_err().to_string();
    assert!(error.contains("prior.mean"), "{error}");
}
