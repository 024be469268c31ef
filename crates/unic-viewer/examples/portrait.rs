//! Draws a frame of a capture with the renderer.
//!
//! ```text
//! cargo run --release -p unic-viewer --example portrait -- CAPTURE CLIP FRAME AZIMUTH OUTPUT.png
//! ```

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use unic_core::mesh::vertex_normals;
use unic_gpu::GpuContext;
use unic_io::Capture;
use unic_raster::{Camera, Ground};
use unic_viewer::{
    Canvas, Focus, Material, Mesh, Part, Quality, Renderer, Scene, Shading, Shape, Skinning, Vertex,
};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [folder, clip, frame, azimuth, output] = words.as_slice() else {
        return Err("expected CAPTURE CLIP FRAME AZIMUTH OUTPUT.png".into());
    };
    let capture = Capture::open(Path::new(folder))?;
    let clip = capture.load_clip(clip)?;
    let frame: usize = frame.parse()?;
    let garment = clip.garment.frame(frame).to_vec();
    let character = &capture.character;
    let mut skinning = Skinning::default();
    let body = skinning.body(character, &clip.clip.poses[frame]).0.to_vec();
    let vertices = |positions: &[glam::Vec3], faces: &[[u32; 3]]| {
        let (mut normals, mut out) = (Vec::new(), Vec::new());
        vertex_normals(positions, faces, &mut normals);
        Vertex::join(positions, &normals, &mut out);
        out
    };
    let body_shape = vertices(&body, &character.body.faces);
    let garment_shape = vertices(&garment, &capture.garment.rest.faces);
    let meshes = [&character.body, &capture.garment.rest].map(|mesh| Arc::new(Mesh::new(mesh)));
    let part = |i: usize, shape, material| Part {
        mesh: &meshes[i],
        shape: Shape::Host(shape),
        material,
        colours: None,
        shading: Shading::Lit,
    };
    let parts = [
        part(0, &body_shape, Material::SKIN),
        part(1, &garment_shape, Material::SHIRT),
    ];
    let focus = Focus::around(body.iter().copied());
    let scene = Scene {
        parts: &parts,
        marks: &[],
        ground: Ground::Height(0.0),
        to_key: glam::Vec3::new(0.45, 0.8, 0.55).normalize(),
        focus,
    };
    let half = glam::Vec3::new(0.5, 0.95, 0.5);
    let camera = Camera::framing(
        focus.centre - half,
        focus.centre + half,
        azimuth.parse()?,
        0.12,
        0.75,
    )?;
    let context = GpuContext::new()?;
    println!("{}", context.adapter_name());
    let mut renderer = Renderer::new(context.clone());
    let mut canvas = Canvas::new(&context, [720, 960], Quality::BEST)?;
    for _ in 0..3 {
        let start = Instant::now();
        renderer.draw(&scene, &camera, &mut canvas)?;
        context.wait()?;
        println!("{:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    }
    canvas.read(&context)?.save_png(output)?;
    Ok(())
}
