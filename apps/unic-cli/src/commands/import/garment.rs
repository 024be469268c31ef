//! Checks of the garment of an import, and its frame rate.

use super::{animation::Animation, notes::Notes};
use crate::args::ImportArgs;
use anyhow::{Result, bail};
use std::collections::HashSet;
use unic_core::{mesh::TriMesh, topology::edges};
use unic_io::Capture;

/// Smallest share of the rest shape's edges that the animation's faces have too. Formats cut
/// polygons into triangles along different diagonals, one edge of five for quadrangles. Meshes in
/// another vertex order have hardly any edge in common.
const MIN_COMMON_EDGES: f32 = 0.5;

/// Checks that the animation has the vertices of the rest shape, in its order.
///
/// # Errors
/// Another number of vertices; faces that show another order.
pub(super) fn check_vertices(
    args: &ImportArgs,
    before: Option<&Capture>,
    animation: &Animation,
    rest: &TriMesh,
) -> Result<()> {
    let (expected, found) = (rest.vertices.len(), animation.vertex_count());
    let of = match (&args.rest, before) {
        (Some(path), _) => path,
        (None, Some(capture)) => &capture.root,
        (None, None) => &args.garment,
    };
    let garment = args.garment.display();
    if expected != found {
        bail!(
            "{garment}: expected {expected} vertices as in the rest shape of {}, found {found}: export both \
             from one mesh, with its vertex order kept",
            of.display()
        );
    }
    match &animation.mesh {
        Some(mesh) if common_edges(rest, mesh) < MIN_COMMON_EDGES => bail!(
            "{garment}: expected the faces of the rest shape of {}, found others: export both from one mesh, \
             with its vertex order kept",
            of.display()
        ),
        _ => Ok(()),
    }
}

/// Returns the share of the edges of `rest` that `mesh` has too.
fn common_edges(rest: &TriMesh, mesh: &TriMesh) -> f32 {
    let found: HashSet<[u32; 2]> = edges(&mesh.faces).into_iter().collect();
    let own = edges(&rest.faces);
    let common = own.iter().filter(|edge| found.contains(*edge)).count();
    common as f32 / own.len().max(1) as f32
}

/// Returns the frame rate of the garment: its file's, that of `--fps`, or that of the capture. None
/// if only the motion can tell.
///
/// # Errors
/// A rate that is not that of the capture.
pub(super) fn frame_rate(
    args: &ImportArgs,
    before: Option<&Capture>,
    animation: &Animation,
    notes: &mut Notes,
) -> Result<Option<f32>> {
    let own = before.map(|capture| capture.manifest.fps);
    let stated = animation.fps.or(args.fps);
    if let (Some(file), Some(asked)) = (animation.fps, args.fps)
        && file != asked
    {
        let text = format!("the file states {file} fps, which is taken instead of --fps {asked}");
        notes.add(&args.garment, &text);
    }
    match (own, stated) {
        // Frames of cloth are not interpolated: a capture has one frame rate.
        (Some(own), Some(stated)) if (own - stated).abs() > 1e-4 * own => bail!(
            "{}: expected the {own} frames per second of {}, found {stated}",
            args.garment.display(),
            args.out.display()
        ),
        _ => Ok(own.or(stated)),
    }
}
