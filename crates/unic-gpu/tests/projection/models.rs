//! Models with a strain projection.

use crate::common;
use glam::Vec3;
use std::sync::Arc;
use unic_core::{
    Model,
    character::Garment,
    config::ProjectionConfig,
    mesh::TriMesh,
    model::ModelParts,
    projection::{StrainLimit, limited_pairs},
    skinning::SkinningWeights,
};

/// Model of a variant with a strain projection, on a tube with a seam.
pub(crate) fn model(variant: &str, radius: f32) -> Arc<Model> {
    on_tube(variant, common::tube(13, 12, radius), 12)
}

/// The same on a fine tube, whose projection has coarse levels.
pub(crate) fn fine_model(variant: &str, radius: f32) -> Arc<Model> {
    on_tube(variant, common::tube(80, 48, radius), 48)
}

fn on_tube(variant: &str, tube: Garment, segments: u32) -> Arc<Model> {
    let variant = common::variant(variant);
    let mut parts = common::parts(&variant);
    parts.garment = with_seam(tube, segments);
    parts.prior = common::prior(parts.garment.rest.vertices.len(), variant.components);
    with_projection(parts)
}

/// The same on a fine tube whose lower end is fixed, with a gradual mask above it.
pub(crate) fn masked_fine_model(variant: &str, radius: f32) -> Arc<Model> {
    let mut parts = fine_model(variant, radius).to_parts();
    let heights: Vec<f32> = parts.garment.rest.vertices.iter().map(|p| p.y).collect();
    let (low, high) = heights
        .iter()
        .fold((f32::MAX, f32::MIN), |(low, high), y| (low.min(*y), high.max(*y)));
    let share = |y: &f32| ((y - low) / (high - low) * 3.0 - 1.0).clamp(0.0, 1.0);
    parts.garment.mask = Some(heights.iter().map(share).collect());
    Arc::new(Model::new(parts).unwrap())
}

/// Fine model whose mean shape is in folds that narrow, with pushes into the order of the cloth.
pub(crate) fn folded_model(order: f32) -> Arc<Model> {
    let mut parts = fine_model("second order", 0.27).to_parts();
    let rest = &parts.garment.rest.vertices;
    // Waves along the tube whose flanks hang over by the height of their crests.
    let shift = |p: &Vec3, mean: Vec3| {
        let phase = 40.0 * p.y;
        let outwards = Vec3::new(p.x, 0.0, p.z).normalize();
        mean + outwards * (0.06 * phase.sin()) + Vec3::Y * (0.05 * (2.0 * phase).sin())
    };
    parts.prior.mean = rest
        .iter()
        .zip(&parts.prior.mean)
        .map(|(p, m)| shift(p, *m))
        .collect();
    let mut config = parts.config.projection.unwrap();
    config.order = order;
    let model = with_projection(parts);
    let mut parts = model.to_parts();
    parts.config.projection = Some(config);
    Arc::new(Model::new(parts).unwrap())
}

/// Fine model in pleats around the tube, whose mean shape has their layers inside out, with an order along
/// the smoothed shape and one of layers.
pub(crate) fn pleated_model([order, layers]: [f32; 2]) -> Arc<Model> {
    const RINGS: usize = 6;
    const THICK: f32 = 0.01;
    let mut parts = fine_model("second order", 0.27).to_parts();
    let vertices = parts.garment.rest.vertices.iter_mut();
    for (p, mean) in vertices.zip(&mut parts.prior.mean) {
        let ring = ((p.y - 0.5) / 0.8 * 79.0).round() as usize;
        let (layer, along) = (ring / RINGS % 3, ring % RINGS);
        // The middle layer runs back.
        let along = if layer == 1 { RINGS - 1 - along } else { along };
        p.y = 0.7 + 0.8 / 79.0 * (RINGS * (ring / RINGS / 3) + along) as f32;
        let outwards = Vec3::new(p.x, 0.0, p.z).normalize();
        let (height, rise) = (1.0 - layer as f32, 2.0 * along as f32 / RINGS as f32);
        *p += outwards * (THICK * (height + rise));
        *mean -= outwards * (1.3 * THICK * height);
    }
    let model = with_projection(parts);
    let mut parts = model.to_parts();
    let config = parts.config.projection.as_mut().unwrap();
    (config.order, config.layers) = (order, layers);
    Arc::new(Model::new(parts).unwrap())
}

/// The same model without coarse levels.
pub(crate) fn without_levels(model: &Model) -> Arc<Model> {
    let mut parts = model.to_parts();
    let config = parts.config.projection.as_mut().unwrap();
    config.coarse_sweeps = 0;
    let edges = limited_pairs(config, &parts.garment.rest).len();
    parts.strain_limits.truncate(edges);
    Arc::new(Model::new(parts).unwrap())
}

/// Model whose edges must be 3 to 20 % longer than in the mean shape.
pub(crate) fn with_projection(mut parts: ModelParts) -> Arc<Model> {
    let (rest, mean) = (&parts.garment.rest, &parts.prior.mean);
    let at = |v: u32| rest.vertices[v as usize] + mean[v as usize];
    let limit = |&[a, b]: &[u32; 2]| {
        let length = at(a).distance(at(b));
        StrainLimit {
            shortest: 1.03 * length,
            longest: 1.2 * length,
        }
    };
    let config = ProjectionConfig::default();
    parts.strain_limits = limited_pairs(&config, rest).iter().map(limit).collect();
    parts.config.projection = Some(config);
    Arc::new(Model::new(parts).unwrap())
}

/// Cuts a tube open along its first column, whose vertices are then there twice.
fn with_seam(tube: Garment, segments: u32) -> Garment {
    let count = tube.rest.vertices.len() as u32;
    let column = (0..count).step_by(segments as usize);
    let vertices = tube.rest.vertices.iter().copied();
    let doubled = column.clone().map(|v| tube.rest.vertices[v as usize]);
    let last = |v: u32| v < count && v % segments == segments - 1;
    let faces = tube.rest.faces.iter().map(|face| {
        let is_at_seam = face.iter().any(|&v| last(v));
        face.map(|v| match is_at_seam && v % segments == 0 {
            true => count + v / segments,
            false => v,
        })
    });
    let rows = (0..count).chain(column).map(|v| tube.weights.row(v as usize));
    let weights = SkinningWeights::from_rows(common::JOINTS, rows).unwrap();
    let rest = TriMesh::new(vertices.chain(doubled).collect(), faces.collect()).unwrap();
    Garment::new(rest, weights)
}
