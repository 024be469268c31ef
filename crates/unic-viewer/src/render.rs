use glam::{IVec2, Vec2, Vec3};
use rayon::prelude::*;

use crate::camera::{Camera, View};
use crate::colour::{linear_from_srgb, srgb_from_linear};
use crate::ground::Floor;
use crate::light::{Lights, Point, Side, Sphere, key_direction};
use crate::project::Pieces;
use crate::raster::{BAND_ROWS, Band, PIXEL_SAMPLES, Sample, bands};
use crate::surface::{Surface, face_normal};
use crate::{Image, ViewerError};

/// Everything in a picture but the camera.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// What is drawn and casts shadows.
    pub surfaces: &'a [Surface<'a>],
    /// The floor.
    pub ground: Ground,
    /// sRGB, 0 to 1, at the top and at the bottom of the picture; a gradient between.
    pub background: [[f32; 3]; 2],
}

/// The floor of a [`Scene`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ground {
    /// No floor: only the background.
    None,
    /// A plane at this height (world +Y, metres) with soft shadows and a grid of half metres. It
    /// lies behind everything, so that what sinks below it stays visible.
    Height(f32),
}

impl<'a> Scene<'a> {
    /// The surfaces on a ground at height 0, before a neutral background.
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
/// The result is a pure function of the arguments: it does not depend on the number of threads.
///
/// # Errors
/// [`ViewerError::ImageSize`], [`ViewerError::Length`] if normals or colours are not one a
/// vertex, [`ViewerError::FaceIndex`]. Faces with a non-finite vertex are skipped.
pub fn render(scene: &Scene, camera: &Camera, width: u32, height: u32) -> Result<Image, ViewerError> {
    let mut image = Image::filled(width, height, [0; 3])?;
    scene.surfaces.iter().try_for_each(Surface::check)?;
    let frame = Frame::new(scene, camera, width, height);
    let members = bands(&frame.pieces.triangles, height as usize);
    image
        .pixels_mut()
        .par_chunks_mut(BAND_ROWS * width as usize)
        .zip(members)
        .enumerate()
        .for_each(|(band, (out, members))| frame.draw_band(band * BAND_ROWS, &members, out));
    Ok(image)
}

/// What all bands of a picture share.
struct Frame<'a> {
    surfaces: &'a [Surface<'a>],
    /// A surface: one element if solid, else one a vertex.
    albedo: Vec<Vec<Vec3>>,
    view: View,
    width: usize,
    height: usize,
    background: [Vec3; 2],
    pieces: Pieces,
    lights: Lights,
    floor: Option<Floor>,
}

impl<'a> Frame<'a> {
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

    /// Mean of the samples: every triangle is shaded once, in the middle of its samples.
    fn resolve(&self, pixel: IVec2, samples: &[Sample; 4]) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for (i, sample) in samples.iter().enumerate() {
            let same = |other: &Sample| other.triangle == sample.triangle;
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

    fn background(&self, pixel: IVec2) -> Vec3 {
        let [top, bottom] = self.background;
        let centre = pixel.as_vec2() + Vec2::splat(0.5);
        let colour = top.lerp(bottom, centre.y / self.height as f32);
        self.floor
            .as_ref()
            .map_or(colour, |floor| colour * floor.transmission(&self.view, centre))
    }

    fn point(&self, triangle: usize, pixel: IVec2, offset: IVec2) -> Point {
        let (piece, screen) = (&self.pieces.pieces[triangle], &self.pieces.triangles[triangle]);
        let surface = &self.surfaces[piece.surface as usize];
        let face = surface.faces[piece.face as usize];
        let corners = surface.corners(face);
        let weights = piece.face_weights(screen.perspective(screen.weights(pixel, offset)));
        let position = blend(corners, weights);
        let to_eye = (self.view.eye() - position).normalize_or_zero();
        let front = face_normal(corners).unwrap_or(to_eye);
        let side = if front.dot(to_eye) < 0.0 {
            Side::Back
        } else {
            Side::Front
        };
        let flat = if side == Side::Back { -front } else { front };
        let smooth = blend(face.map(|index| surface.normals[index as usize]), weights);
        let albedo = match self.albedo[piece.surface as usize].as_slice() {
            [solid] => *solid,
            colours => blend(face.map(|index| colours[index as usize]), weights),
        };
        Point {
            position,
            normal: towards(smooth, flat),
            to_eye,
            albedo,
            side,
        }
    }
}

fn blend([a, b, c]: [Vec3; 3], weights: Vec3) -> Vec3 {
    a * weights.x + b * weights.y + c * weights.z
}

/// Unit vector along `normal` or its opposite, whichever lies on the side of `flat`; `flat` itself
/// if `normal` has no direction.
fn towards(normal: Vec3, flat: Vec3) -> Vec3 {
    let unit = normal.try_normalize().unwrap_or(flat);
    if unit.dot(flat) < 0.0 { -unit } else { unit }
}

/// A sphere around the box of all finite vertices; `None` if there are none.
fn bounding_sphere(surfaces: &[Surface]) -> Option<Sphere> {
    let vertices = surfaces.iter().flat_map(|surface| surface.vertices);
    let (min, max) = vertices
        .filter(|vertex| vertex.is_finite())
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), &v| {
            (min.min(v), max.max(v))
        });
    let half = (max - min) * 0.5;
    half.is_finite().then(|| Sphere {
        centre: min + half,
        radius: half.length().max(1e-3) * 1.01,
    })
}
