//! Vertex of a shape.

use glam::Vec3;

/// Vertex of a shape, in the layout of [`unic_gpu::GpuAnimator::vertex_buffer`].
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Vertex {
    /// Position, world space, metres.
    pub position: Vec3,
    /// Unit normal, or zero where there is none.
    pub normal: Vec3,
}

impl Vertex {
    /// Joins positions and normals of the same number.
    pub fn join(positions: &[Vec3], normals: &[Vec3], out: &mut Vec<Self>) {
        out.clear();
        let pairs = positions.iter().zip(normals);
        out.extend(pairs.map(|(&position, &normal)| Self { position, normal }));
    }

    /// Interpolates between two shapes of one mesh: `share` 0 is `before`, 1 is `now`.
    pub fn interpolate(before: &[Self], now: &[Self], share: f32, out: &mut Vec<Self>) {
        out.clear();
        let between = |(a, b): (&Self, &Self)| Self {
            position: a.position.lerp(b.position, share),
            normal: a.normal.lerp(b.normal, share),
        };
        out.extend(before.iter().zip(now).map(between));
    }
}
