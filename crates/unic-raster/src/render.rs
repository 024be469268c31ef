use glam::{IVec2, Vec2, Vec3};
use rayon::prelude::*;

use crate::camera::{Camera, View};
use crate::colour::{linear_from_srgb, srgb_from_linear};
use crate::ground::Floor;
use crate::light::{FaceSide, Lights, ShadingPoint, Sphere, key_direction};
use crate::project::Pieces;
use crate::raster::{BAND_ROWS, Band, PIXEL_SAMPLES, Sample, bands};
use crate::surface::{Surface, face_normal};
use crate::{Image, RasterError};

/// Contents of a picture: surfaces, ground and background.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Surfaces to draw, which also cast shadows.
    pub surfaces: &'a [Surface<'a>],
    /// Floor under the surfaces.
    pub ground: Ground,
    /// Colours at the top and at the bottom of the background's gradient, sRGB, 0 to 1.
    pub background: [[f32; 3]; 2],
}

/// Floor of a [`Scene`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ground {
    /// No floor: only the background.
    None,
    /// A plane at this height (world +Y, metres) with soft shadows and a grid of half metres.
    ///
    /// It is drawn behind all surfaces, so that parts below it stay visible.
    Height(f32),
}

impl<'a> Scene<'a> {
    /// Scene of surfaces on a ground at height 0 in front of a neutral background.
    pub fn new(surfaces: &'a [Surface<'a>]) -> Self {
        let background = [[0.80, 0.81, 0.825], [0.93, 0.925, 0.915]];
        Self {
            surfaces,
            ground: Ground::Height(0.0),
            background,
        }
    }
}

/// Draws a scene as an image of `width` × `height` pixels.
///
/// The result depends on the arguments alone, not on the number of threads. Faces with a non-finite
/// vertex are skipped.
///
/// # Errors
/// - [`RasterError::ImageSize`] for a width or height out of range.
/// - [`RasterError::Length`] if normals or colours are not one per vertex.
/// - [`RasterError::FaceIndex`] for a vertex index out of range.
pub fn render(scene: &Scene, camera: &Camera, width: u32, height: u32) -> Result<Image, RasterError> {
    let mut image = Image::filled(width, height, [0; 3])?;
    scene.surfaces.iter().try_for_each(Surface::check)?;
    let context = RenderContext::new(scene, camera, width, height);
    let members = bands(&context.pieces.triangles, height as usize);
    // Bands are independent and triangles keep their order in each: threads cannot change a pixel.
    image
        .pixels_mut()
        .par_chunks_mut(BAND_ROWS * width as usize)
        .zip(members)
        .enumerate()
        .for_each(|(band, (out, members))| context.draw_band(band * BAND_ROWS, &members, out));
    Ok(image)
}

/// Data that all bands of a picture share.
struct RenderContext<'a> {
    surfaces: &'a [Surface<'a>],
    /// Linear albedo of each surface: one element if solid, otherwise one per vertex.
    albedo: Vec<Vec<Vec3>>,
    view: View,
    width: usize,
    height: usize,
    /// Linear colours at the top and at the bottom.
    background: [Vec3; 2],
    pieces: Pieces,
    lights: Lights,
    floor: Option<Floor>,
}

impl<'a> RenderContext<'a> {
    fn new(scene: &Scene<'a>, camera: &Camera, width: u32, height: u32) -> Self {
        let view = camera.view(width, height);
        let sphere = bounding_sphere(scene.surfaces);
        let around = sphere.unwrap_or(Sphere {
            centre: Vec3::ZERO,
            radius: 1.0,
        });
        let surfaces = scene.surfaces;
        let floor = || match scene.ground {
            Ground::Height(height) if height.is_finite() && sphere.is_some() => {
                Some(Floor::new(surfaces, around, height, key_direction(camera)))
            }
            _ => None,
        };
        let (lights, floor) = rayon::join(|| Lights::new(surfaces, around, camera), floor);
        Self {
            surfaces,
            albedo: surfaces.iter().map(Surface::linear_albedo).collect(),
            view,
            width: width as usize,
            height: height as usize,
            background: scene.background.map(linear_from_srgb),
            pieces: Pieces::new(surfaces, &view),
            lights,
            floor,
        }
    }

    /// Draws the rows from `first_row` on, with the triangles that touch them, into `out`.
    fn draw_band(&self, first_row: usize, members: &[u32], out: &mut [[u8; 3]]) {
        let rows = first_row..first_row + out.len() / self.width;
        let mut band = Band::new(rows, self.width, PIXEL_SAMPLES);
        for &index in members {
            band.draw(index, &self.pieces.triangles[index as usize]);
        }
        for (i, (samples, out)) in band.pixels().iter().zip(out).enumerate() {
            let (x, y) = (i % self.width, first_row + i / self.width);
            *out = srgb_from_linear(self.resolve(IVec2::new(x as i32, y as i32), samples));
        }
    }

    /// Linear colour of a pixel: the mean of its samples.
    ///
    /// Every triangle is shaded once, in the middle of its samples.
    fn resolve(&self, pixel: IVec2, samples: &[Sample; 4]) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for (i, sample) in samples.iter().enumerate() {
            let same = |other: &Sample| other.triangle == sample.triangle;
            // An earlier sample has shaded this triangle for all of its samples.
            if samples[..i].iter().any(same) {
                continue;
            }
            let members = || (i..4).filter(|&j| same(&samples[j]));
            let count = members().count();
            let middle = members().map(|j| PIXEL_SAMPLES[j]).sum::<IVec2>() / count as i32;
            let colour = if sample.triangle == Sample::EMPTY.triangle {
                self.background(pixel)
            } else {
                self.lights
                    .shade(&self.point(sample.triangle as usize, pixel, middle))
            };
            sum += colour * (count as f32 * 0.25);
        }
        sum
    }

    /// Linear colour of the background and the floor at a pixel.
    fn background(&self, pixel: IVec2) -> Vec3 {
        let [top, bottom] = self.background;
        let centre = pixel.as_vec2() + Vec2::splat(0.5);
        let colour = top.lerp(bottom, centre.y / self.height as f32);
        self.floor
            .as_ref()
            .map_or(colour, |floor| colour * floor.transmission(&self.view, centre))
    }

    /// Point of a triangle at `offset` fixed-point steps from the top left corner of a pixel.
    fn point(&self, triangle: usize, pixel: IVec2, offset: IVec2) -> ShadingPoint {
        let (piece, screen) = (&self.pieces.pieces[triangle], &self.pieces.triangles[triangle]);
        let surface_index = piece.source.surface as usize;
        let surface = &self.surfaces[surface_index];
        let face = surface.faces[piece.source.face as usize];
        let corners = surface.corners(face);
        let weights = piece.face_weights(screen.perspective(screen.weights(pixel, offset)));
        let position = blend(corners, weights);
        let to_eye = (self.view.eye() - position).normalize_or_zero();
        // The winding of the face decides about the side: interpolated normals may point away from
        // the eye near a silhouette.
        let front = face_normal(corners).unwrap_or(to_eye);
        let side = if front.dot(to_eye) < 0.0 {
            FaceSide::Back
        } else {
            FaceSide::Front
        };
        let flat = if side == FaceSide::Back { -front } else { front };
        let smooth = blend(face.map(|index| surface.normals[index as usize]), weights);
        let albedo = match self.albedo[surface_index].as_slice() {
            [solid] => *solid,
            colours => blend(face.map(|index| colours[index as usize]), weights),
        };
        ShadingPoint {
            position,
            normal: towards(smooth, flat),
            to_eye,
            albedo,
            side,
        }
    }
}

/// Barycentric interpolation.
fn blend([a, b, c]: [Vec3; 3], weights: Vec3) -> Vec3 {
    a * weights.x + b * weights.y + c * weights.z
}

/// Unit vector along `normal` or its opposite, whichever is on the side of `flat`.
///
/// It is `flat` itself if `normal` has no direction.
fn towards(normal: Vec3, flat: Vec3) -> Vec3 {
    let unit = normal.try_normalize().unwrap_or(flat);
    if unit.dot(flat) < 0.0 { -unit } else { unit }
}

/// Sphere around the bounding box of all finite vertices; `None` if there are none.
fn bounding_sphere(surfaces: &[Surface]) -> Option<Sphere> {
    let vertices = surfaces.iter().flat_map(|surface| surface.vertices);
    let (min, max) = vertices
        .filter(|vertex| vertex.is_finite())
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), &v| {
            (min.min(v), max.max(v))
        });
    let half = (max - min) * 0.5;
    // A percent larger, and never empty: vertices must stay inside the shadow map.
    half.is_finite().then(|| Sphere {
        centre: min + half,
        radius: half.length().max(1e-3) * 1.01,
    })
}
