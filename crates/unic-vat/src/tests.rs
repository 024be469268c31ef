use super::*;
use exr::prelude::{ReadChannels, ReadLayers, Vec2 as Texel, read};
use std::{fs::File, io::BufReader};

fn mesh(vertices: usize) -> TriMesh {
    let place = |i: usize| {
        Vec3::new(
            (i % 97) as f32 * 0.01,
            (i / 97) as f32 * 0.01,
            (i % 7) as f32 * 0.1,
        )
    };
    TriMesh::new((0..vertices).map(place).collect(), vec![[0, 1, 2], [1, 2, 3]]).unwrap()
}

/// Position of a vertex in a frame, which is in no other place.
fn place(mesh: &TriMesh, frame: usize, vertex: usize) -> Vec3 {
    mesh.vertices[vertex] + Vec3::new(0.1, -0.2, 0.3) * frame as f32
}

fn written(name: &str, mesh: &TriMesh, frames: usize) -> (tempfile::TempDir, serde_json::Value) {
    let folder = tempfile::tempdir().unwrap();
    let mut vat = VatWriter::create(&folder.path().join(name), mesh, 30.0, frames).unwrap();
    for frame in 0..frames {
        let positions = (0..mesh.vertices.len()).map(|vertex| place(mesh, frame, vertex));
        vat.push(&positions.collect::<Vec<_>>()).unwrap();
    }
    assert!(
        VatPaths::of(&folder.path().join(name))
            .all()
            .iter()
            .all(|path| !path.exists())
    );
    let paths = vat.finish().unwrap();
    assert!(paths.all().iter().all(|path| path.exists()));
    let json = std::fs::read(&paths.description).unwrap();
    (folder, serde_json::from_slice(&json).unwrap())
}

#[test]
fn an_exr_holds_every_position_at_its_texel() {
    // More vertices than a row holds: two rows a frame.
    let mesh = mesh(LARGEST_SIDE + 5);
    let (folder, json) = written("walk.exr", &mesh, 3);
    assert_eq!(
        (&json["rows_a_frame"], &json["width"], &json["height"]),
        (&2.into(), &4099.into(), &6.into())
    );
    let pixels = |Texel(width, height): Texel<usize>, _: &_| vec![vec![[0.0; 3]; width]; height];
    let set = |pixels: &mut Vec<Vec<[f32; 3]>>, Texel(x, y): Texel<usize>, (r, g, b): (f32, f32, f32)| {
        pixels[y][x] = [r, g, b];
    };
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(pixels, set)
        .first_valid_layer()
        .all_attributes()
        .from_file(folder.path().join("walk.exr"))
        .unwrap();
    let pixels = image.layer_data.channel_data.pixels;
    for frame in 0..3 {
        for vertex in [0, 1, 4098, 4099, LARGEST_SIDE + 4] {
            let [x, y] = [vertex % 4099, 2 * frame + vertex / 4099];
            assert_eq!(
                pixels[y][x],
                place(&mesh, frame, vertex).to_array(),
                "{frame} {vertex}"
            );
        }
    }
    // The texel behind the last vertex.
    assert_eq!(pixels[1][4098], [0.0; 3]);
}

#[test]
fn a_png_holds_sixteen_bits_between_the_bounds() {
    let mesh = mesh(50);
    let (folder, json) = written("walk.png", &mesh, 2);
    let vector = |key: &str| {
        let axis = |axis: usize| json[key][axis].as_f64().unwrap() as f32;
        Vec3::new(axis(0), axis(1), axis(2))
    };
    let (minimum, maximum) = (vector("minimum"), vector("maximum"));
    let file = BufReader::new(File::open(folder.path().join("walk.png")).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!(
        (info.width, info.height, info.bit_depth),
        (50, 2, png::BitDepth::Sixteen)
    );
    let word = |i: usize| f32::from(u16::from_be_bytes([bytes[2 * i], bytes[2 * i + 1]])) / 65535.0;
    for frame in 0..2 {
        for vertex in 0..50 {
            let first = 3 * (50 * frame + vertex);
            let unit = Vec3::new(word(first), word(first + 1), word(first + 2));
            let off = minimum + unit * (maximum - minimum) - place(&mesh, frame, vertex);
            assert!(off.abs().max_element() < 1e-5, "{off}");
        }
    }
}

#[test]
fn texels_are_the_centres_of_the_first_frame() {
    let layout = Layout::new("a.exr".as_ref(), LARGEST_SIDE + 5, 3).unwrap();
    for vertex in [0, 4098, 4099] {
        let texel = layout.texel(vertex);
        let place = [texel.x * 4099.0, texel.y * 6.0].map(|p| p.floor() as usize);
        assert_eq!(layout.value(place[0], place[1]), Some(vertex));
        assert!((texel.x * 4099.0).fract() > 0.4 && (texel.x * 4099.0).fract() < 0.6);
    }
}

#[test]
fn refusals_name_the_file() {
    let refusal = |path: &str, mesh: &TriMesh, frames: usize| {
        let error = VatWriter::create(path.as_ref(), mesh, 30.0, frames).unwrap_err();
        error.to_string()
    };
    let expected = "walk.jpg: expected the ending .exr or .png, found .jpg";
    assert_eq!(refusal("walk.jpg", &mesh(4), 1), expected);
    let expected = "a.exr: expected 1 to 8192 frames of 4 vertices in a texture, found 0";
    assert_eq!(refusal("a.exr", &mesh(4), 0), expected);
    let expected = "a.exr: expected 1 to 4096 frames of 8197 vertices in a texture, found 4097";
    assert_eq!(refusal("a.exr", &mesh(LARGEST_SIDE + 5), 4097), expected);
    assert!(refusal("a.exr", &TriMesh::default(), 1).contains("found none"));
    let mesh = mesh(4);
    let mut vat = VatWriter::create("a.exr".as_ref(), &mesh, 30.0, 1).unwrap();
    assert!(vat.push(&[Vec3::X]).is_err());
    assert!(vat.push(&[Vec3::X, Vec3::NAN, Vec3::X, Vec3::X]).is_err());
    vat.push(&mesh.vertices).unwrap();
    assert!(
        vat.push(&mesh.vertices)
            .unwrap_err()
            .to_string()
            .ends_with("found a further one")
    );
    let vat = VatWriter::create("a.exr".as_ref(), &mesh, 30.0, 1).unwrap();
    assert_eq!(
        vat.finish().unwrap_err().to_string(),
        "a.exr: expected 1 frames, found 0"
    );
}
