//! A finished movie shows the pictures that were pushed, at their times; an unfinished one is not
//! there.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{collections::BTreeSet, fs, io::BufReader, path::Path};
use unic_raster::Image;
use unic_viewer::{EarlierFrames, MovieError, MovieFormat, MovieWriter};

const SIZE: [u32; 2] = [64, 36];

/// Ball-like square that moves in front of a soft gradient.
fn picture(index: usize, [width, height]: [u32; 2]) -> Image {
    let mut image = Image::filled(width, height, [0; 3]).unwrap();
    for row in 0..height {
        let shade = 160 + (70 * row / height) as u8;
        image.fill_rect(0, row as i32, width, 1, [shade - 20, shade - 10, shade]);
    }
    // On even rows and columns, since an MP4 has colours at half the resolution.
    image.fill_rect(2 * index as i32, height as i32 / 8 * 2, 16, 16, [200, 80, 50]);
    image
}

fn write(path: &Path, format: MovieFormat, fps: f32, size: [u32; 2], count: usize) {
    let mut movie = MovieWriter::create(path, format, fps, size).unwrap();
    for index in 0..count {
        movie.push(&picture(index, size)).unwrap();
    }
    assert_eq!(movie.pictures(), count);
    assert!(movie.temporary_path().exists());
    movie.finish().unwrap();
}

/// Writes a movie of [`SIZE`] whose format is that of its path.
fn write_by_path(path: &Path, fps: f32, count: usize) {
    write(path, MovieFormat::from_path(path).unwrap(), fps, SIZE, count);
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect()
}

fn set<const N: usize>(names: [&str; N]) -> BTreeSet<String> {
    names.map(String::from).into()
}

fn read_png(path: &Path) -> Vec<u8> {
    let file = BufReader::new(fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes
}

#[test]
fn a_gif_shows_every_picture_for_its_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing/dance.gif");
    write_by_path(&path, 30.0, 24);
    assert_eq!(names(path.parent().unwrap()), set(["dance.gif"]));

    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options
        .read_info(BufReader::new(fs::File::open(&path).unwrap()))
        .unwrap();
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
    let mut shown = Image::filled(SIZE[0], SIZE[1], [0; 3]).unwrap();
    let (mut index, mut hundredths) = (0, 0);
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        for (i, &[r, g, b, a]) in frame.buffer.as_chunks().0.iter().enumerate() {
            let [x, y] = [
                i as u16 % frame.width + frame.left,
                i as u16 / frame.width + frame.top,
            ];
            if a > 0 {
                shown.fill_rect(x.into(), y.into(), 1, 1, [r, g, b]);
            }
        }
        hundredths += u32::from(frame.delay);
        assert_eq!(hundredths, ((index + 1) as f64 * 100.0 / 30.0).round() as u32);
        let expected = picture(index, SIZE);
        let (found, expected) = (shown.pixels().as_flattened(), expected.pixels().as_flattened());
        assert!(
            found.iter().zip(expected).all(|(a, b)| a.abs_diff(*b) <= 2),
            "picture {index}"
        );
        index += 1;
    }
    assert_eq!(index, 24);
}

#[test]
fn a_folder_holds_the_exact_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing/dance");
    write_by_path(&path, 25.0, 3);
    assert_eq!(names(path.parent().unwrap()), set(["dance"]));
    let frames = ["frame_00000.png", "frame_00001.png", "frame_00002.png"];
    assert_eq!(names(&path), set(frames));
    for (index, frame) in frames.iter().enumerate() {
        let expected = picture(index, SIZE);
        assert_eq!(read_png(&path.join(frame)), expected.pixels().as_flattened());
    }
}

#[test]
fn earlier_frames_are_refused_or_replaced_and_other_files_stay() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dance");
    fs::create_dir(&path).unwrap();
    fs::write(path.join("notes.txt"), "keep").unwrap();
    fs::write(path.join("frame_1.png"), "no frame of a movie").unwrap();
    write_by_path(&path, 25.0, 3);
    let error = MovieWriter::create(&path, MovieFormat::from_path(&path).unwrap(), 25.0, SIZE);
    let Err(MovieError::FramesExist { found, .. }) = error else {
        panic!("not refused");
    };
    assert_eq!(found, "frame_00000.png");

    let replace = MovieFormat::Frames(EarlierFrames::Replace);
    // An unfinished movie leaves the earlier one.
    let mut unfinished = MovieWriter::create(&path, replace, 25.0, SIZE).unwrap();
    unfinished.push(&picture(9, SIZE)).unwrap();
    drop(unfinished);
    let others = ["notes.txt", "frame_1.png"];
    let before = ["frame_00000.png", "frame_00001.png", "frame_00002.png"];
    assert_eq!(names(&path), &set(others) | &set(before));

    write(&path, replace, 25.0, SIZE, 2);
    assert_eq!(
        names(&path),
        &set(others) | &set(["frame_00000.png", "frame_00001.png"])
    );
}

#[test]
fn an_unfinished_movie_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut paths = vec!["dance.gif", "dance"];
    if cfg!(feature = "mp4") {
        paths.push("dance.mp4");
    }
    for path in paths {
        let path = folder.path().join(path);
        let create =
            || MovieWriter::create(&path, MovieFormat::from_path(&path).unwrap(), 25.0, SIZE).unwrap();
        let mut movie = create();
        movie.push(&picture(0, SIZE)).unwrap();
        assert!(!path.exists());
        drop(movie);
        let empty = create().finish().unwrap_err();
        assert!(matches!(empty, MovieError::NoPictures { .. }), "{empty}");
        assert_eq!(names(folder.path()), set([]), "{}", path.display());
    }
}

#[test]
fn a_file_replaces_the_earlier_one_only_when_it_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dance.gif");
    write_by_path(&path, 25.0, 2);
    let before = fs::read(&path).unwrap();
    drop(MovieWriter::create(&path, MovieFormat::Gif, 25.0, SIZE).unwrap());
    assert_eq!(fs::read(&path).unwrap(), before);
    write_by_path(&path, 25.0, 3);
    assert_ne!(fs::read(&path).unwrap(), before);
}

#[test]
fn mistakes_are_told_before_the_first_picture() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file.gif");
    fs::write(&file, "").unwrap();
    let refused = |path: &Path, format, fps, size| {
        let created = MovieWriter::create(path, format, fps, size);
        created.err().expect("refused").to_string()
    };
    let message = refused(folder.path(), MovieFormat::Gif, 25.0, SIZE);
    assert!(message.ends_with("expected a file, found a folder"), "{message}");
    let frames = MovieFormat::Frames(EarlierFrames::Refuse);
    let message = refused(&file, frames, 25.0, SIZE);
    assert!(
        message.ends_with("file.gif: expected a folder, found a file"),
        "{message}"
    );
    for fps in [0.0, f32::NAN, 1e9] {
        let message = refused(&file, MovieFormat::Gif, fps, SIZE);
        assert!(message.contains("0.1 to 1000 frames per second"), "{message}");
    }
    let message = refused(&file, MovieFormat::Gif, 25.0, [0, 8]);
    assert!(
        message.contains("file.gif: an image of 0 x 8 pixels"),
        "{message}"
    );
    let message = refused(&file.join("dance.gif"), MovieFormat::Gif, 25.0, SIZE);
    assert!(
        message.contains("file.gif: cannot create the folder: "),
        "{message}"
    );
    assert_eq!(names(folder.path()), set(["file.gif"]));
}

#[test]
fn a_picture_of_another_size_is_not_added() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dance.gif");
    let mut movie = MovieWriter::create(&path, MovieFormat::Gif, 25.0, SIZE).unwrap();
    movie.push(&picture(0, SIZE)).unwrap();
    let error = movie.push(&picture(1, [32, 18])).unwrap_err().to_string();
    let expected = "dance.gif: expected pictures of 64 x 36 pixels, found 32 x 18 in picture 1";
    assert!(error.ends_with(expected), "{error}");
    movie.push(&picture(1, SIZE)).unwrap();
    movie.finish().unwrap();
    let decoder = gif::DecodeOptions::new().read_info(fs::File::open(&path).unwrap());
    assert_eq!(decoder.unwrap().into_iter().count(), 2);
}

#[cfg(feature = "mp4")]
mod mp4 {
    use super::*;
    use openh264::{decoder::Decoder, formats::YUVSource};
    use shiguredo_mp4::{
        bitstream::h264::{LengthSize, length_prefixed_to_annexb},
        boxes::SampleEntry,
        demux::{Input, Mp4FileDemuxer},
    };

    /// Movie as a player reads it.
    struct Played {
        /// Width and height in the index of the file, pixels.
        size: [u32; 2],
        /// Duration of each picture, seconds.
        durations: Vec<f64>,
        /// Indices of the pictures that decode alone.
        keys: Vec<usize>,
        pictures: Vec<Vec<[u8; 3]>>,
    }

    fn play(path: &Path) -> Played {
        let bytes = fs::read(path).unwrap();
        let mut demuxer = Mp4FileDemuxer::new();
        while demuxer.required_input().is_some() {
            demuxer.handle_input(Input {
                position: 0,
                data: &bytes,
            });
        }
        let mut decoder = Decoder::new().unwrap();
        let mut played = Played {
            size: [0; 2],
            durations: Vec::new(),
            keys: Vec::new(),
            pictures: Vec::new(),
        };
        while let Some(sample) = demuxer.next_sample().unwrap() {
            let mut stream = Vec::new();
            if let Some(SampleEntry::Avc1(entry)) = sample.sample_entry {
                played.size = [entry.visual.width.into(), entry.visual.height.into()];
                let avcc = &entry.avcc_box;
                for unit in avcc.sps_list.iter().chain(&avcc.pps_list) {
                    stream.extend([0, 0, 0, 1]);
                    stream.extend(unit);
                }
            }
            let data = &bytes[sample.data_offset as usize..][..sample.data_size];
            stream.extend(length_prefixed_to_annexb(data, LengthSize::FourBytes).unwrap());
            if sample.keyframe {
                played.keys.push(played.durations.len());
            }
            let timescale = f64::from(sample.track.timescale.get());
            played.durations.push(f64::from(sample.duration) / timescale);
            if let Some(yuv) = decoder.decode(&stream).unwrap() {
                played.pictures.push(rgb(&yuv));
            }
        }
        let rest = decoder.flush_remaining().unwrap();
        played.pictures.extend(rest.iter().map(rgb));
        played
    }

    /// Colours of BT.709 in limited range.
    fn rgb(yuv: &impl YUVSource) -> Vec<[u8; 3]> {
        let ((width, height), strides) = (yuv.dimensions(), yuv.strides());
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let luma = (f32::from(yuv.y()[y * strides.0 + x]) - 16.0) / 219.0;
                let chroma = |plane: &[u8]| (f32::from(plane[y / 2 * strides.1 + x / 2]) - 128.0) / 224.0;
                let [red, blue] = [luma + 1.5748 * chroma(yuv.v()), luma + 1.8556 * chroma(yuv.u())];
                let green = (luma - 0.2126 * red - 0.0722 * blue) / 0.7152;
                pixels.push([red, green, blue].map(|value| (255.0 * value).round() as u8));
            }
        }
        pixels
    }

    #[test]
    fn an_mp4_shows_every_picture_for_its_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dance.mp4");
        write_by_path(&path, 29.97, 70);
        assert_eq!(names(folder.path()), set(["dance.mp4"]));
        let played = play(&path);
        assert_eq!(played.size, SIZE);
        assert_eq!(played.pictures.len(), 70);
        assert!(
            played
                .durations
                .iter()
                .all(|seconds| (seconds * 29.97 - 1.0).abs() < 1e-9)
        );
        assert_eq!(played.keys, [0, 60]);
        for (index, found) in played.pictures.iter().enumerate() {
            let expected = picture(index, SIZE);
            let pairs = found.as_flattened().iter().zip(expected.pixels().as_flattened());
            let total: f32 = pairs.map(|(a, b)| f32::from(a.abs_diff(*b))).sum();
            let mean = total / (3 * found.len()) as f32;
            assert!(mean < 2.0, "mean difference {mean} in picture {index}");
        }
        // A wall's colour, away from edges.
        let (found, expected) = (played.pictures[0][60], picture(0, SIZE).pixels()[60]);
        assert!(
            (0..3).all(|channel| found[channel].abs_diff(expected[channel]) <= 2),
            "{found:?}"
        );
    }

    #[test]
    fn an_odd_size_gets_one_more_column_and_row() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dance.mp4");
        write(&path, MovieFormat::Mp4, 25.0, [63, 35], 3);
        let played = play(&path);
        assert_eq!((played.size, played.pictures.len()), ([64, 36], 3));
    }

    #[test]
    fn bytes_do_not_depend_on_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let bytes = ["a.mp4", "b.mp4"].map(|name| {
            let path = folder.path().join(name);
            write_by_path(&path, 25.0, 10);
            fs::read(&path).unwrap()
        });
        assert!(bytes[0] == bytes[1]);
    }

    #[test]
    fn a_size_beyond_the_encoder_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dance.mp4");
        for size in [[4_000, 16], [2_400, 2_400], [8, 8]] {
            let error = MovieWriter::create(&path, MovieFormat::Mp4, 25.0, size)
                .err()
                .unwrap();
            assert!(matches!(error, MovieError::Mp4 { .. }), "{error}");
        }
        assert_eq!(names(folder.path()), set([]));
    }
}
