//! Data in the layout of the shaders.

use crate::mesh::PatternSpace;
use crate::renderer::Canvas;
use crate::scene::{Fabric, Mark, Part, Print, Scene, Shading, Shape};
use bytemuck::{Pod, Zeroable};
use glam::camera::rh::{proj::directx::orthographic, view::look_at_mat4};
use glam::{Mat4, Vec3};
use unic_raster::{Camera, Ground, linear_from_srgb};

/// `View` of view.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ViewUniform {
    clip_from_world: Mat4,
    key_from_world: Mat4,
    above_from_world: Mat4,
    eye: Vec3,
    ground_height: f32,
    right: Vec3,
    shadow_extent: f32,
    up: Vec3,
    taps: u32,
    forward: Vec3,
    pad_0: u32,
    to_key: Vec3,
    pad_1: u32,
}

impl ViewUniform {
    pub(crate) fn new(scene: &Scene, camera: &Camera, canvas: &Canvas) -> Self {
        let aspect = canvas.aspect();
        let [right, up, forward] = camera.ray_axes(aspect);
        let ground_height = match scene.ground {
            Ground::Height(height) => height,
            Ground::None => 0.0,
        };
        Self {
            clip_from_world: camera.clip_from_world(aspect),
            key_from_world: shadow_view(scene, scene.to_key),
            above_from_world: shadow_view(scene, Vec3::Y),
            eye: camera.eye(),
            ground_height,
            right,
            shadow_extent: 2.0 * scene.focus.radius,
            up,
            taps: canvas.quality().shadow_taps,
            forward,
            pad_0: 0,
            to_key: scene.to_key,
            pad_1: 0,
        }
    }
}

/// Clip space of a parallel view from a direction on the focus of a scene. Depth 0 is near.
///
/// Depth spans twice the extent of the sides, so that shadows fall on the floor behind the focus.
fn shadow_view(scene: &Scene, to_light: Vec3) -> Mat4 {
    let (centre, radius) = (scene.focus.centre, scene.focus.radius);
    let up = if to_light.y.abs() > 0.99 { Vec3::Z } else { Vec3::Y };
    let view = look_at_mat4(centre + to_light * radius, centre, up);
    orthographic(-radius, radius, -radius, radius, 0.0, 4.0 * radius) * view
}

/// `Part` of surface.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PartUniform {
    colour: Vec3,
    surface: u32,
    accent: Vec3,
    print: u32,
    share: f32,
    shading: u32,
    has_colours: u32,
    is_flat: u32,
}

impl PartUniform {
    pub(crate) fn new(part: &Part) -> Self {
        let material = part.material;
        let share = match part.shape {
            Shape::Host(_) => 1.0,
            Shape::Device { share, .. } => share,
        };
        Self {
            colour: linear_from_srgb(material.colour),
            surface: surface_code(material.fabric),
            accent: linear_from_srgb(material.accent),
            print: print_code(material.print),
            share,
            shading: match part.shading {
                Shading::Lit | Shading::Wireframe => 0,
                Shading::Normals => 1,
                Shading::Flat => 2,
            },
            has_colours: u32::from(part.colours.is_some()),
            is_flat: u32::from(part.mesh.pattern() == PatternSpace::Cloth),
        }
    }
}

/// Constants `SKIN` to `SATIN` of surface.wgsl.
fn surface_code(fabric: Fabric) -> u32 {
    match fabric {
        Fabric::Skin => 0,
        Fabric::Plain => 1,
        Fabric::Jersey => 2,
        Fabric::Twill => 3,
        Fabric::Linen => 4,
        Fabric::Satin => 5,
    }
}

/// Constants `PRINT_…` of surface.wgsl.
fn print_code(print: Print) -> u32 {
    match print {
        Print::None => 0,
        Print::Stripes => 1,
        Print::Checks => 2,
        Print::Dots => 3,
    }
}

/// `MarkPoint` of mark.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MarkPoint {
    position: Vec3,
    colour: [f32; 4],
}

impl MarkPoint {
    pub(crate) fn of_mark(mark: &Mark) -> impl Iterator<Item = Self> {
        let [r, g, b, opacity] = mark.colour;
        let colour = linear_from_srgb([r, g, b]).extend(opacity).to_array();
        // Whole triangles only.
        let count = mark.corners.len() / 3 * 3;
        mark.corners[..count]
            .iter()
            .map(move |&position| Self { position, colour })
    }
}
