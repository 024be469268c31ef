//! Pictures of snapshots by the viewer's renderer: on a graphics adapter if there is one, else by the
//! software rasteriser.

use crate::pictures::{Renderer, Snapshot};
use anyhow::Result;
use glam::Vec3;
use std::sync::Arc;
use unic_core::mesh::{TriMesh, vertex_normals};
use unic_raster::{Ground, Image, captioned};
use unic_viewer::{Focus, Material, Mesh, Painter, PainterChoice, Part, Scene, Shading, Shape, Vertex};

/// Draws snapshots of one character.
pub(crate) struct Portraits<'a> {
    view: &'a Renderer<'a>,
    painter: Painter,
    body: Arc<Mesh>,
    garment: Arc<Mesh>,
}

impl<'a> Portraits<'a> {
    /// Draws with the camera and the size of `view`.
    ///
    /// # Errors
    /// A size that the adapter does not draw.
    pub(crate) fn new(view: &'a Renderer<'a>) -> Result<Self> {
        Ok(Self {
            painter: Painter::new(PainterChoice::Auto, view.size())?,
            body: Arc::new(Mesh::new(view.body())),
            garment: Arc::new(Mesh::new(view.garment())),
            view,
        })
    }

    /// Draws a snapshot with a line of text above it.
    ///
    /// # Errors
    /// A device that was lost.
    pub(crate) fn picture(&mut self, snapshot: &Snapshot, caption: &str) -> Result<Image> {
        let body = vertices(&snapshot.body, self.view.body());
        let garment = vertices(&snapshot.garment, self.view.garment());
        let part = |mesh, shape, material| Part {
            mesh,
            shape: Shape::Host(shape),
            material,
            colours: None,
            shading: Shading::Lit,
        };
        let parts = [
            part(&self.body, &body, Material::SKIN),
            part(&self.garment, &garment, Material::SHIRT),
        ];
        let camera = self.view.camera_of(snapshot);
        // From above the left shoulder of the viewer.
        let away = camera.forward();
        let right = away.cross(Vec3::Y).normalize_or_zero();
        let scene = Scene {
            parts: &parts,
            marks: &[],
            ground: Ground::Height(self.view.ground_height()),
            to_key: (Vec3::Y - 0.5 * away - 0.55 * right).normalize_or(Vec3::Y),
            focus: Focus::around(snapshot.body.iter().copied()),
        };
        Ok(captioned(&self.painter.picture(&scene, &camera)?, caption)?)
    }
}

fn vertices(positions: &[Vec3], mesh: &TriMesh) -> Vec<Vertex> {
    let (mut normals, mut out) = (Vec::new(), Vec::new());
    vertex_normals(positions, &mesh.faces, &mut normals);
    Vertex::join(positions, &normals, &mut out);
    out
}
