//! Pictures beside this file, with which the renderer's are compared.
//!
//! Drivers round in their own ways, so a few pixels may differ. `UNIC_STORE_PICTURES=1` writes the
//! pictures anew; look at them before they are committed.

use super::{ball, context, differing, draw, part, scene, vertices};
use glam::Vec3;
use std::{env, fs::File, io::BufReader, path::PathBuf, sync::Arc};
use unic_gpu::GpuContext;
use unic_raster::Image;
use unic_viewer::{Fabric, Mark, Material, Mesh, Part, Print, Quality, Scene, Shading, Shape};

/// Largest share of pixels that differ by more than 20 of 255.
const DIFFERING: f32 = 0.01;

fn compare(name: &str, image: &Image) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("tests/renderer/{name}.png"));
    if env::var_os("UNIC_STORE_PICTURES").is_some() {
        image.save_png(&path).unwrap();
    }
    let mut reader = png::Decoder::new(BufReader::new(File::open(&path).unwrap()))
        .read_info()
        .unwrap();
    let size = [reader.info().width, reader.info().height];
    assert_eq!(size, [image.width(), image.height()], "{name}");
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    let pixels: Vec<[u8; 3]> = bytes.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    let share = differing(image.pixels(), &pixels);
    assert!(
        share < DIFFERING,
        "{name}: {:.2} % of pixels differ",
        share * 100.0
    );
}

fn drawn(context: &GpuContext, mesh: &Arc<Mesh>, change: impl FnOnce(&mut Part), quality: Quality) -> Image {
    let vertices = vertices(&ball());
    let mut shown = part(mesh, Shape::Host(&vertices));
    change(&mut shown);
    draw(context, &scene(&[shown], &marks()), quality)
}

/// Orange ribbon on the floor before the ball.
fn marks() -> [Mark; 1] {
    let path = [Vec3::new(-0.9, 0.004, 0.6), Vec3::new(0.9, 0.004, 0.6)];
    [Mark::ribbon(&path, 0.05, [1.0, 0.5, 0.0, 1.0])]
}

#[test]
fn pictures_are_those_that_are_stored() {
    let Some(context) = context() else { return };
    let mesh = Arc::new(Mesh::new(&ball()));
    let colours = ball_colours();
    let best = Quality::BEST;
    let lit = drawn(&context, &mesh, |_| {}, best);
    compare("lit", &lit);
    let woven = |part: &mut Part| {
        part.material = Material::cloth(Fabric::CLOTHS[1], [0.2, 0.3, 0.6]).printed(Print::Stripes, [0.9; 3]);
    };
    compare("woven_stripes", &drawn(&context, &mesh, woven, best));
    compare(
        "wireframe",
        &drawn(&context, &mesh, |part| part.shading = Shading::Wireframe, best),
    );
    compare(
        "normals",
        &drawn(&context, &mesh, |part| part.shading = Shading::Normals, best),
    );
    let vertices = vertices(&ball());
    let coloured = Part {
        colours: Some(&colours),
        ..part(&mesh, Shape::Host(&vertices))
    };
    compare("colours", &draw(&context, &scene(&[coloured], &[]), best));
    for (i, quality) in Quality::STEPS.into_iter().enumerate().skip(1) {
        compare(&format!("quality_{i}"), &drawn(&context, &mesh, |_| {}, quality));
    }
    // The comparison sees a mark that is missing, and a shadow that is.
    let unmarked = draw(
        &context,
        &scene(&[part(&mesh, Shape::Host(&vertices))], &[]),
        best,
    );
    let (parts, marks) = ([part(&mesh, Shape::Host(&vertices))], marks());
    let noon = Scene {
        to_key: Vec3::Y,
        ..scene(&parts, &marks)
    };
    let other_sun = draw(&context, &noon, best);
    for (what, other) in [("mark", unmarked), ("sun", other_sun)] {
        let share = differing(lit.pixels(), other.pixels());
        assert!(share > DIFFERING, "{what}: {share}");
    }
}

/// Red that rises from the ball's top to its bottom.
fn ball_colours() -> Vec<[f32; 3]> {
    let vertices = ball().vertices;
    vertices.iter().map(|p| [(0.9 - p.y) / 0.8, 0.3, 0.8]).collect()
}
