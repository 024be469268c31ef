//! Contract of [`render`]: visibility, lighting, refused input, and pixels that depend on the
//! arguments alone.

#![allow(
    clippy::unwrap_used,
    reason = "a failed unwrap is a failed test, in the functions it calls too"
)]

use glam::Vec3;
use proptest::prelude::*;
use unic_raster::{Camera, Colouring, Ground, Image, RasterError, Scene, Surface, render, vertex_normals};

const RED: [f32; 3] = [0.9, 0.1, 0.1];
const BLUE: [f32; 3] = [0.1, 0.1, 0.9];
const FACE: [[u32; 3]; 1] = [[0, 1, 2]];

/// Camera 4 m in front of the plane z = 0, whose region ±1 m fills the picture.
fn camera() -> Camera {
    let fov = 2.0 * 0.25_f32.atan();
    Camera::look_at(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, fov).unwrap()
}

fn surface<'a>(vertices: &'a [Vec3], normals: &'a [Vec3], colour: [f32; 3]) -> Surface<'a> {
    Surface {
        vertices,
        faces: &FACE,
        normals,
        colour: Colouring::Solid(colour),
    }
}

/// Draws surfaces without a floor on black: a pixel is lit exactly where a surface is.
fn draw(surfaces: &[Surface]) -> Image {
    let scene = Scene {
        surfaces,
        ground: Ground::None,
        background: [[0.0; 3]; 2],
    };
    render(&scene, &camera(), 80, 80).unwrap()
}

/// Sphere of radius 0.9 m around the origin, counter-clockwise from outside.
fn sphere(rings: u32, sectors: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let point = |ring: u32, sector: u32| {
        let (sin_p, cos_p) = (ring as f32 / rings as f32 * std::f32::consts::PI).sin_cos();
        let (sin_a, cos_a) = (sector as f32 / sectors as f32 * std::f32::consts::TAU).sin_cos();
        Vec3::new(sin_p * sin_a, cos_p, sin_p * cos_a) * 0.9
    };
    let vertices = (0..=rings)
        .flat_map(|r| (0..sectors).map(move |s| point(r, s)))
        .collect();
    let at = |ring: u32, sector: u32| ring * sectors + sector % sectors;
    let faces = (0..rings)
        .flat_map(|r| (0..sectors).map(move |s| (r, s)))
        .flat_map(|(r, s)| {
            [
                [at(r, s), at(r + 1, s), at(r + 1, s + 1)],
                [at(r, s), at(r + 1, s + 1), at(r, s + 1)],
            ]
        })
        .collect();
    (vertices, faces)
}

#[test]
fn a_known_triangle_covers_the_expected_pixels() {
    let vertices = [
        Vec3::new(-0.5, -0.5, 0.0),
        Vec3::new(0.5, -0.5, 0.0),
        Vec3::new(-0.5, 0.5, 0.0),
    ];
    let image = draw(&[surface(&vertices, &[Vec3::Z; 3], RED)]);
    // ±0.5 m are the pixels 20 to 60. Only pixels on the hypotenuse are partly covered.
    for y in 0..80_u32 {
        for x in 0..80_u32 {
            let slack = i64::from(y) - i64::from(x);
            let inside = (20..60).contains(&x) && (20..60).contains(&y);
            let red = image.pixel(x, y).unwrap()[0];
            if inside && slack > 0 {
                assert!(red > 100, "{x} {y} is {red}");
            } else if !inside || slack < 0 {
                assert_eq!(red, 0, "{x} {y}");
            } else {
                assert!((30..200).contains(&red), "{x} {y} is {red}: antialiased");
            }
        }
    }
}

#[test]
fn the_nearer_surface_hides_the_other_in_either_order() {
    let wide = |z: f32| {
        [
            Vec3::new(-2.0, -2.0, z),
            Vec3::new(2.0, -2.0, z),
            Vec3::new(0.0, 2.0, z),
        ]
    };
    let (near, far) = (wide(0.01), wide(0.0));
    let red = surface(&near, &[Vec3::Z; 3], RED);
    let blue = surface(&far, &[Vec3::Z; 3], BLUE);
    let image = draw(&[red, blue]);
    assert_eq!(image, draw(&[blue, red]));
    let [r, _, b] = image.pixel(40, 40).unwrap();
    assert!(r > b);
}

#[test]
fn attributes_are_perspective_correct() {
    // A strip that recedes from 3 m to 15 m: halfway along it is at 9 m, far above the middle of
    // its picture.
    let vertices = [
        Vec3::new(-0.5, -0.7, 1.0),
        Vec3::new(0.5, -0.7, 1.0),
        Vec3::new(0.5, 0.7, -11.0),
        Vec3::new(-0.5, 0.7, -11.0),
    ];
    let faces = [[0, 1, 2], [0, 2, 3]];
    let gradient = [[0.0; 3], [0.0; 3], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let normals = vertex_normals(&vertices, &faces).unwrap();
    let colour = Colouring::PerVertex(&gradient);
    let strip = Surface {
        vertices: &vertices,
        faces: &faces,
        normals: &normals,
        colour,
    };
    let full = Surface {
        colour: Colouring::Solid([0.0, 1.0, 0.0]),
        ..strip
    };
    let middle = camera().project(Vec3::new(0.0, 0.0, -5.0), 80, 80).unwrap();
    let green = |image: &Image| {
        let code = f32::from(image.pixel(40, middle.y as u32).unwrap()[1]) / 255.0;
        ((code + 0.055) / 1.055).powf(2.4)
    };
    let ratio = green(&draw(&[strip])) / green(&draw(&[full]));
    assert!((ratio - 0.5).abs() < 0.06, "{ratio}");
}

#[test]
fn back_faces_are_visible_and_darker() {
    let front = [
        Vec3::new(-1.0, -1.0, 0.0),
        Vec3::new(1.0, -1.0, 0.0),
        Vec3::new(0.0, 1.0, 0.0),
    ];
    let back = [front[0], front[2], front[1]];
    let normals = [Vec3::Z; 3];
    let lit = draw(&[surface(&front, &normals, RED)]).pixel(40, 40).unwrap();
    let lining = draw(&[surface(&back, &normals, RED)]).pixel(40, 40).unwrap();
    assert!(lining[0] > 60 && lining[0] < lit[0], "{lining:?} {lit:?}");
}

#[test]
fn the_sign_and_length_of_normals_do_not_matter() {
    let (vertices, faces) = sphere(12, 24);
    let normals = vertex_normals(&vertices, &faces).unwrap();
    let flipped: Vec<Vec3> = normals.iter().map(|&normal| normal * -4.0).collect();
    let colour = Colouring::Solid(RED);
    let ball = Surface {
        vertices: &vertices,
        faces: &faces,
        normals: &normals,
        colour,
    };
    assert_eq!(
        draw(&[ball]),
        draw(&[Surface {
            normals: &flipped,
            ..ball
        }])
    );
}

#[test]
fn vertex_normals_point_out_of_a_counter_clockwise_sphere() {
    let (vertices, faces) = sphere(24, 48);
    let normals = vertex_normals(&vertices, &faces).unwrap();
    // The vertices of a pole are not shared: each belongs to a single face, whose normal is
    // oblique.
    let inner = 48..vertices.len() - 48;
    for (vertex, normal) in vertices[inner.clone()].iter().zip(&normals[inner]) {
        assert!(vertex.normalize().dot(*normal) > 0.99, "{vertex} {normal}");
    }
}

#[test]
fn faces_through_the_camera_are_clipped() {
    let vertices = [
        Vec3::new(-3.0, -1.0, -2.0),
        Vec3::new(3.0, -1.0, -2.0),
        Vec3::new(0.0, -1.0, 50.0),
    ];
    let image = draw(&[surface(&vertices, &[Vec3::Y; 3], RED)]);
    assert_eq!(image.pixel(40, 10), Some([0; 3]));
    assert!(image.pixel(40, 79).unwrap()[0] > 100);
}

#[test]
fn faces_with_a_non_finite_vertex_are_skipped() {
    let good = [
        Vec3::new(-1.0, -1.0, 0.0),
        Vec3::new(1.0, -1.0, 0.0),
        Vec3::new(0.0, 1.0, 0.0),
    ];
    let mut vertices = good.to_vec();
    vertices.extend([Vec3::NAN, Vec3::splat(f32::INFINITY)]);
    let faces = [[0, 1, 2], [0, 1, 3], [1, 2, 4], [3, 4, 0]];
    let colour = Colouring::Solid(RED);
    let normals = [Vec3::Z; 5];
    let broken = Surface {
        vertices: &vertices,
        faces: &faces,
        normals: &normals,
        colour,
    };
    assert_eq!(draw(&[broken]), draw(&[surface(&good, &[Vec3::Z; 3], RED)]));
    assert!(
        vertex_normals(&vertices, &faces)
            .unwrap()
            .iter()
            .all(|n| n.is_finite())
    );
}

#[test]
fn invalid_input_is_refused() {
    let vertices = [Vec3::ZERO; 3];
    let scene_error = |surface: Surface| {
        render(&Scene::new(&[surface]), &camera(), 8, 8)
            .map(|_| ())
            .unwrap_err()
    };
    let short = surface(&vertices, &[Vec3::Z; 2], RED);
    assert!(matches!(
        scene_error(short),
        RasterError::Length {
            expected: 3,
            found: 2,
            ..
        }
    ));
    let good = surface(&vertices, &[Vec3::Z; 3], RED);
    let pale = Surface {
        colour: Colouring::PerVertex(&[RED]),
        ..good
    };
    assert!(matches!(
        scene_error(pale),
        RasterError::Length {
            expected: 3,
            found: 1,
            ..
        }
    ));
    let beyond = Surface {
        faces: &[[0, 1, 2], [0, 3, 1]],
        ..good
    };
    let found = scene_error(beyond);
    assert!(matches!(
        found,
        RasterError::FaceIndex {
            face: 1,
            index: 3,
            vertices: 3
        }
    ));
    for (width, height) in [(0, 8), (8, 0), (u32::MAX, 8)] {
        let refused = render(&Scene::new(&[]), &camera(), width, height);
        assert!(matches!(refused, Err(RasterError::ImageSize { .. })));
    }
}

#[test]
fn the_ground_shows_a_shadow_under_the_mesh_only() {
    let (mut vertices, faces) = sphere(16, 32);
    vertices.iter_mut().for_each(|vertex| vertex.y += 1.5);
    let normals = vertex_normals(&vertices, &faces).unwrap();
    let colour = Colouring::Solid(RED);
    let ball = Surface {
        vertices: &vertices,
        faces: &faces,
        normals: &normals,
        colour,
    };
    let eye = Vec3::new(0.0, 6.0, 8.0);
    let camera = Camera::look_at(eye, Vec3::new(0.0, 0.8, 0.0), 0.8).unwrap();
    let background = [[0.8; 3]; 2];
    let scene = Scene {
        surfaces: &[ball],
        ground: Ground::Height(0.0),
        background,
    };
    let image = render(&scene, &camera, 200, 200).unwrap();
    let red_at = |point: Vec3| {
        let pixel = camera.project(point, 200, 200).unwrap();
        image.pixel(pixel.x as u32, pixel.y as u32).unwrap()[0]
    };
    let under = red_at(Vec3::new(0.05, 0.0, 0.3));
    let away = red_at(Vec3::new(2.25, 0.0, 1.75));
    assert!(under + 20 < away, "{under} {away}");
    assert_eq!(image.pixel(2, 2), Some([204; 3]));
}

#[test]
fn the_pixels_do_not_depend_on_the_number_of_threads() {
    let (vertices, faces) = sphere(40, 80);
    let normals = vertex_normals(&vertices, &faces).unwrap();
    let colour = Colouring::Solid(BLUE);
    let ball = [Surface {
        vertices: &vertices,
        faces: &faces,
        normals: &normals,
        colour,
    }];
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| render(&Scene::new(&ball), &camera(), 157, 93).unwrap())
    };
    let one = with_threads(1);
    assert_eq!(one, with_threads(2));
    assert_eq!(one, with_threads(7));
}

#[test]
fn a_saved_png_holds_the_pixels_and_leaves_no_other_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let mut image = Image::filled(5, 3, [10, 20, 30]).unwrap();
    image.fill_rect(1, 1, 2, 1, [200, 100, 50]);
    image.save_png(&path).unwrap();
    image.save_png(&path).unwrap();
    let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!(
        (info.width, info.height, info.color_type),
        (5, 3, png::ColorType::Rgb)
    );
    assert_eq!(bytes, image.pixels().as_flattened());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_failed_save_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing").join("picture.png");
    let found = Image::filled(1, 1, [0; 3]).unwrap().save_png(&path).unwrap_err();
    assert!(matches!(&found, RasterError::Write { path: named, .. } if *named == path));
    assert!(found.to_string().contains("picture.png"));
    let nameless = Image::filled(1, 1, [0; 3]).unwrap().save_png("/");
    assert!(matches!(nameless, Err(RasterError::Write { .. })));
}

#[test]
fn text_is_drawn_in_cells_and_cut_at_the_border() {
    let mut image = Image::filled(24, 16, [255; 3]).unwrap();
    image.draw_text(0, 0, 1, [0; 3], "I-\nL");
    assert_eq!(image.pixel(2, 3), Some([0; 3]));
    assert_eq!(image.pixel(6, 3), Some([0; 3]));
    assert_eq!(image.pixel(0, 8), Some([0; 3]));
    assert_eq!(image.pixel(0, 0), Some([255; 3]));
    for (x, y, scale) in [
        (-3, -3, 2),
        (20, 14, 5),
        (i32::MAX, 0, 1),
        (0, i32::MIN, u32::MAX),
    ] {
        image.draw_text(x, y, scale, [0; 3], "cut at the border \u{1f455}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Any bit patterns as positions and normals give an image of the right size.
    #[test]
    fn no_position_panics(bits in prop::collection::vec(any::<[u32; 3]>(), 6), mild in any::<bool>()) {
        let point = |bits: &[u32; 3]| {
            let scale = if mild { 1e-9 } else { 1.0 };
            Vec3::from(bits.map(|b| if mild { b as f32 * scale } else { f32::from_bits(b) }))
        };
        let vertices: Vec<Vec3> = bits.iter().map(point).collect();
        let faces = [[0, 1, 2], [3, 4, 5], [0, 2, 4], [1, 1, 5]];
        let colour = Colouring::Solid(RED);
        let surface = Surface { vertices: &vertices, faces: &faces, normals: &vertices, colour };
        let image = render(&Scene::new(&[surface]), &camera(), 16, 16).unwrap();
        prop_assert_eq!(image.pixels().len(), 256);
    }
}
