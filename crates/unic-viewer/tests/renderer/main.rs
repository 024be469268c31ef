//! Pictures of the renderer: what they show, and that the processor, the device and the rasteriser
//! show the same. Without an adapter the tests print that they are skipped, and pass.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod stored;

use glam::Vec3;
use std::sync::Arc;
use unic_core::mesh::{TriMesh, vertex_normals};
use unic_gpu::{GpuContext, wgpu};
use unic_raster::{Camera, Ground, Image};
use unic_viewer::{
    Canvas, Fabric, Focus, Mark, Material, Mesh, Part, Print, Quality, Renderer, Scene, Shading, Shape,
    Vertex, ViewerError, rasterise,
};
use wgpu::util::DeviceExt;

const SIZE: [u32; 2] = [160, 120];

fn context() -> Option<GpuContext> {
    GpuContext::new()
        .inspect_err(|why| eprintln!("skipped: no adapter that draws ({why})"))
        .ok()
}

/// Ball of radius 0.4 m whose lowest point is 0.1 m above the floor.
fn ball() -> TriMesh {
    let (rings, sides) = (24u32, 48u32);
    let point = |ring: u32, side: u32| {
        let (polar, around) = (
            std::f32::consts::PI * ring as f32 / rings as f32,
            std::f32::consts::TAU * side as f32 / sides as f32,
        );
        let (x, z) = (polar.sin() * around.sin(), polar.sin() * around.cos());
        Vec3::new(x, polar.cos(), z) * 0.4 + Vec3::Y * 0.5
    };
    let vertices = (0..=rings)
        .flat_map(|r| (0..sides).map(move |s| point(r, s)))
        .collect();
    let at = |r: u32, s: u32| r * sides + s % sides;
    let quad = |r: u32, s: u32| {
        let (a, b, c, d) = (at(r, s), at(r + 1, s), at(r + 1, s + 1), at(r, s + 1));
        [[a, b, c], [a, c, d]]
    };
    let faces = (0..rings)
        .flat_map(|r| (0..sides).flat_map(move |s| quad(r, s)))
        .collect();
    TriMesh::new(vertices, faces).unwrap()
}

fn vertices(mesh: &TriMesh) -> Vec<Vertex> {
    let (mut normals, mut out) = (Vec::new(), Vec::new());
    vertex_normals(&mesh.vertices, &mesh.faces, &mut normals);
    Vertex::join(&mesh.vertices, &normals, &mut out);
    out
}

fn camera() -> Camera {
    Camera::look_at(Vec3::new(0.0, 1.1, 3.0), Vec3::new(0.0, 0.45, 0.0), 0.6).unwrap()
}

fn part<'a>(mesh: &'a Arc<Mesh>, shape: Shape<'a>) -> Part<'a> {
    Part {
        mesh,
        shape,
        material: Material::cloth(Fabric::Plain, [0.7, 0.2, 0.2]),
        colours: None,
        shading: Shading::Lit,
    }
}

fn scene<'a>(parts: &'a [Part<'a>], marks: &'a [Mark]) -> Scene<'a> {
    Scene {
        parts,
        marks,
        ground: Ground::Height(0.0),
        to_key: Vec3::new(0.6, 0.8, 0.0),
        focus: Focus {
            centre: Vec3::Y * 0.5,
            radius: 0.8,
        },
    }
}

fn draw(context: &GpuContext, scene: &Scene, quality: Quality) -> Image {
    let mut renderer = Renderer::new(context.clone());
    let mut canvas = Canvas::new(context, SIZE, quality).unwrap();
    renderer.draw(scene, &camera(), &mut canvas).unwrap();
    canvas.read(context).unwrap()
}

/// Colour at the place where a point of the world is seen.
fn at(image: &Image, point: Vec3) -> [i32; 3] {
    // Cheaper qualities draw smaller pictures.
    let pixel = camera().project(point, image.width(), image.height()).unwrap();
    let [r, g, b] = image.pixel(pixel.x as u32, pixel.y as u32).unwrap();
    [r.into(), g.into(), b.into()]
}

fn brightness([r, g, b]: [i32; 3]) -> i32 {
    r + g + b
}

/// Share of pixels in which one of two pictures differs from the other one by more than 20 of 255.
fn differing(a: &[[u8; 3]], b: &[[u8; 3]]) -> f32 {
    let off = |(a, b): &(&[u8; 3], &[u8; 3])| (0..3).any(|i| a[i].abs_diff(b[i]) > 20);
    a.iter().zip(b).filter(off).count() as f32 / a.len() as f32
}

#[test]
fn a_ball_is_lit_from_the_right_and_shades_the_floor_to_its_left() {
    let Some(context) = context() else { return };
    let mesh = Arc::new(Mesh::new(&ball()));
    let vertices = vertices(&ball());
    let parts = [part(&mesh, Shape::Host(&vertices))];
    for quality in [Quality::BEST, Quality::STEPS[4]] {
        let image = draw(&context, &scene(&parts, &[]), quality);
        let centre = Vec3::Y * 0.5;
        let lit = at(&image, centre + Vec3::new(0.28, 0.15, 0.24));
        let dark = at(&image, centre + Vec3::new(-0.28, 0.0, 0.24));
        assert!(lit[0] > 2 * lit[1], "red cloth: {lit:?}");
        assert!(brightness(lit) > brightness(dark) + 40, "{lit:?} {dark:?}");
        // The sun is at (0.6, 0.8): the shadow of the middle of the ball is 0.375 m to its left.
        let shadow = at(&image, Vec3::new(-0.375, 0.0, 0.0));
        let floor = at(&image, Vec3::new(0.7, 0.0, 0.3));
        assert!(
            brightness(floor) > brightness(shadow) + 100,
            "{floor:?} {shadow:?}"
        );
        let sky = image
            .pixel(image.width() / 2, 1)
            .map(|p| p.map(i32::from))
            .unwrap();
        assert!(sky[2] > sky[0], "the sky is blue: {sky:?}");
    }
}

#[test]
fn shapes_on_the_device_are_drawn_as_shapes_in_memory_and_between_ticks() {
    let Some(context) = context() else { return };
    let mesh = Arc::new(Mesh::new(&ball()));
    let before = vertices(&ball());
    let moved = |v: &Vertex| Vertex {
        position: v.position + Vec3::new(0.3, 0.1, 0.0),
        ..*v
    };
    let now: Vec<Vertex> = before.iter().map(moved).collect();
    let buffer = |vertices: &[Vertex]| {
        let device = context.device();
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: bytemuck::cast_slice(vertices),
            usage: wgpu::BufferUsages::STORAGE,
        })
    };
    let (before_buffer, now_buffer) = (buffer(&before), buffer(&now));
    for share in [0.0, 0.5, 1.0] {
        let mut between = Vec::new();
        Vertex::interpolate(&before, &now, share, &mut between);
        let host = [part(&mesh, Shape::Host(&between))];
        let device = [part(
            &mesh,
            Shape::Device {
                before: &before_buffer,
                now: &now_buffer,
                share,
            },
        )];
        let host = draw(&context, &scene(&host, &[]), Quality::BEST);
        let device = draw(&context, &scene(&device, &[]), Quality::BEST);
        assert_eq!(differing(host.pixels(), device.pixels()), 0.0, "share {share}");
    }
}

#[test]
fn the_rasteriser_shows_the_same_outline() {
    let Some(context) = context() else { return };
    let mesh = Arc::new(Mesh::new(&ball()));
    let vertices = vertices(&ball());
    let colours = vec![[0.0, 1.0, 0.0]; vertices.len()];
    let parts = [Part {
        colours: Some(&colours),
        shading: Shading::Flat,
        ..part(&mesh, Shape::Host(&vertices))
    }];
    let drawn = draw(&context, &scene(&parts, &[]), Quality::BEST);
    let rasterised = rasterise(&scene(&parts, &[]), &camera(), SIZE).unwrap();
    let is_green = |p: &[u8; 3]| p[1] > 60 && p[0] < 40 && p[2] < 40;
    let pairs = drawn.pixels().iter().zip(rasterised.pixels());
    let [mut both, mut one] = [0, 0];
    for (a, b) in pairs {
        both += usize::from(is_green(a) && is_green(b));
        one += usize::from(is_green(a) != is_green(b));
    }
    assert!(both > 800, "{both}");
    assert!(one * 20 < both, "{one} of {both} pixels differ");
}

#[test]
fn shadings_prints_and_marks_show() {
    let Some(context) = context() else { return };
    let mesh = Arc::new(Mesh::new(&ball()));
    let vertices = vertices(&ball());
    let lit = part(&mesh, Shape::Host(&vertices));
    let draw = |part: Part, marks: &[Mark]| draw(&context, &scene(&[part], marks), Quality::BEST);
    let plain = draw(lit, &[]);
    let towards_eye = Vec3::new(0.0, 0.5, 0.0) + Vec3::Z * 0.4;
    // A normal along +Z is blue.
    let normals = draw(
        Part {
            shading: Shading::Normals,
            ..lit
        },
        &[],
    );
    let blue = at(&normals, towards_eye);
    assert!(blue[2] > blue[0] + 40, "{blue:?}");
    let edges = draw(
        Part {
            shading: Shading::Wireframe,
            ..lit
        },
        &[],
    );
    assert!(differing(plain.pixels(), edges.pixels()) > 0.01);
    let mut striped = lit;
    striped.material = lit.material.printed(Print::Stripes, [1.0, 1.0, 1.0]);
    assert!(differing(plain.pixels(), draw(striped, &[]).pixels()) > 0.01);
    let place = Vec3::new(0.7, 0.004, 0.3);
    let path = [place - Vec3::X * 0.1, place + Vec3::X * 0.1];
    let marked = draw(lit, &[Mark::ribbon(&path, 0.1, [0.0, 1.0, 0.0, 1.0])]);
    let green = at(&marked, place);
    assert!(green[1] > green[0] + 60, "{green:?}");
}

#[test]
fn wrong_lengths_and_sizes_are_refused() {
    let mesh = Arc::new(Mesh::new(&ball()));
    let vertices = vertices(&ball());
    let parts = [part(&mesh, Shape::Host(&vertices[1..]))];
    let refused = rasterise(&scene(&parts, &[]), &camera(), SIZE);
    assert!(matches!(
        refused,
        Err(ViewerError::Length { what: "vertices", .. })
    ));
    let Some(context) = context() else { return };
    let mut renderer = Renderer::new(context.clone());
    let mut canvas = Canvas::new(&context, SIZE, Quality::BEST).unwrap();
    let refused = renderer.draw(&scene(&parts, &[]), &camera(), &mut canvas);
    assert!(matches!(refused, Err(ViewerError::Length { .. })));
    let colours = vec![[0.0; 3]; 3];
    let parts = [Part {
        colours: Some(&colours),
        ..part(&mesh, Shape::Host(&vertices))
    }];
    let refused = renderer.draw(&scene(&parts, &[]), &camera(), &mut canvas);
    assert!(matches!(
        refused,
        Err(ViewerError::Length { what: "colours", .. })
    ));
    for size in [[0, 100], [100, 0], [1 << 20, 8]] {
        let refused = Canvas::new(&context, size, Quality::BEST);
        assert!(matches!(refused, Err(ViewerError::Size { .. })), "{size:?}");
    }
}
