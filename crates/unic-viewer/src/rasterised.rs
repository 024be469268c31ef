//! Scenes drawn by the software rasteriser.

use crate::{Part, Scene, Shading, Shape, ViewerError};
use glam::Vec3;
use rayon::prelude::*;
use unic_raster::{Camera, Colouring, Image, Surface, render};

/// Colours at the top and at the bottom of the background, sRGB.
const BACKGROUND: [[f32; 3]; 2] = [[0.62, 0.68, 0.76], [0.86, 0.865, 0.87]];

/// Draws a scene as a picture of `size` (width, height) pixels without a graphics adapter.
///
/// Cloth has neither threads nor prints, and edges and marks are left out.
///
/// # Errors
/// A shape on a device, shapes or colours of another length than the mesh, a size out of range.
pub fn rasterise(scene: &Scene, camera: &Camera, size: [u32; 2]) -> Result<Image, ViewerError> {
    let drawn: Vec<Drawn> = scene.parts.par_iter().map(Drawn::new).collect::<Result<_, _>>()?;
    let surfaces: Vec<Surface> = drawn.iter().map(Drawn::surface).collect();
    let scene = unic_raster::Scene {
        surfaces: &surfaces,
        ground: scene.ground,
        background: BACKGROUND,
    };
    Ok(render(&scene, camera, size[0], size[1])?)
}

/// Part with its arrays apart, as the rasteriser takes them.
struct Drawn<'a> {
    part: &'a Part<'a>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    colours: Option<Vec<[f32; 3]>>,
}

impl<'a> Drawn<'a> {
    fn new(part: &'a Part<'a>) -> Result<Self, ViewerError> {
        part.check()?;
        let Shape::Host(vertices) = part.shape else {
            return Err(ViewerError::OnDevice);
        };
        let normals: Vec<Vec3> = vertices.iter().map(|vertex| vertex.normal).collect();
        let colours = match part.shading {
            Shading::Normals => Some(normals.iter().map(|n| (*n * 0.5 + 0.5).to_array()).collect()),
            Shading::Lit | Shading::Flat | Shading::Wireframe => part.colours.map(<[_]>::to_vec),
        };
        Ok(Self {
            part,
            positions: vertices.iter().map(|vertex| vertex.position).collect(),
            normals,
            colours,
        })
    }

    fn surface(&self) -> Surface<'_> {
        Surface {
            vertices: &self.positions,
            faces: self.part.mesh.faces(),
            normals: &self.normals,
            colour: match &self.colours {
                Some(colours) => Colouring::PerVertex(colours),
                None => Colouring::Solid(self.part.material.colour),
            },
        }
    }
}
