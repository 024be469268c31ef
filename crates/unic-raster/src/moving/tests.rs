//! A decoded GIF shows the images that were written, each at its time.

use super::*;

/// Frame as a viewer shows it.
struct Shown {
    pixels: Vec<[u8; 3]>,
    /// Number of pixels that the frame draws.
    drawn: usize,
    /// Hundredths of a second.
    delay: u16,
}

/// Plays a GIF.
fn play(bytes: &[u8]) -> Vec<Shown> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let width = usize::from(decoder.width());
    let mut pixels = vec![[0; 3]; width * usize::from(decoder.height())];
    let mut frames = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let corner = usize::from(frame.top) * width + usize::from(frame.left);
        let across = usize::from(frame.width);
        let mut drawn = 0;
        for (i, &[r, g, b, a]) in frame.buffer.as_chunks().0.iter().enumerate() {
            if a > 0 {
                pixels[corner + i / across * width + i % across] = [r, g, b];
                drawn += 1;
            }
        }
        frames.push(Shown {
            pixels: pixels.clone(),
            drawn,
            delay: frame.delay,
        });
    }
    frames
}

fn greatest_difference(shown: &Shown, image: &Image) -> u8 {
    let pairs = shown.pixels.iter().zip(image.pixels());
    pairs.map(|(&a, &b)| difference(a, b)).max().unwrap()
}

/// Blue square that moves by `step` pixels per image, in front of a grey wall.
fn moving_square(count: i32, step: i32) -> Vec<Image> {
    let image = |i| {
        let mut image = Image::filled(40, 20, [230, 230, 235]).unwrap();
        image.fill_rect(step * i, 4, 8, 8, [40, 90, 200]);
        image
    };
    (0..count).map(image).collect()
}

/// Images with many more colours than a palette, of which every pixel changes.
fn colourful(count: usize) -> Vec<Image> {
    let image = |k: usize| {
        let mut image = Image::filled(64, 48, [0; 3]).unwrap();
        for (i, pixel) in image.pixels_mut().iter_mut().enumerate() {
            let (x, y) = (i % 64, i / 64);
            *pixel = [3 * x + k, 4 * y + 2 * k, x + 2 * y + 3 * k].map(|value| value as u8);
        }
        image
    };
    (0..count).map(image).collect()
}

#[test]
fn only_changed_pixels_are_drawn() {
    let images = moving_square(4, 8);
    let frames = play(&encode_gif(&images, 15.0).unwrap());
    for (frame, image) in frames.iter().zip(&images) {
        assert_eq!(greatest_difference(frame, image), 0);
    }
    let drawn: Vec<usize> = frames.iter().map(|frame| frame.drawn).collect();
    // The first image in full, then the square's old place and its new one.
    assert_eq!(drawn, [800, 128, 128, 128]);
}

#[test]
fn an_image_equal_to_the_one_before_takes_its_time_and_no_pixels() {
    let images = moving_square(3, 0);
    let frames = play(&encode_gif(&images, 10.0).unwrap());
    assert_eq!(frames.iter().map(|frame| frame.drawn).sum::<usize>(), 800);
    assert!(frames.iter().all(|frame| frame.delay == 10));
    assert_eq!(greatest_difference(&frames[2], &images[2]), 0);
}

#[test]
fn many_colours_are_close_and_pictures_at_rest_get_closer_without_flicker() {
    let mut images = colourful(4);
    images.extend(vec![images[3].clone(); 30]);
    let frames = play(&encode_gif(&images, 20.0).unwrap());
    let squares = |frame: &Shown, image: &Image| {
        let pairs = frame.pixels.iter().zip(image.pixels());
        pairs.map(|(&a, &b)| squared_distance(a, b)).collect::<Vec<_>>()
    };
    for (frame, image) in frames.iter().zip(&images) {
        let mean = squares(frame, image).iter().sum::<i32>() as f32 / frame.pixels.len() as f32;
        assert!(mean < 150.0, "mean squared error {mean}");
    }
    for (k, frame) in frames.iter().enumerate().skip(4) {
        let (before, now) = (squares(&frames[k - 1], &images[3]), squares(frame, &images[3]));
        let changed = (0..now.len()).filter(|&i| frames[k - 1].pixels[i] != frame.pixels[i]);
        changed.for_each(|i| assert!(now[i] < before[i], "pixel {i} of frame {k}"));
    }
    assert!(greatest_difference(&frames[33], &images[33]) <= RESTING_TOLERANCE);
}

#[test]
fn delays_alternate_so_that_every_image_appears_at_its_time() {
    for (fps, count, expected) in [
        (20.0, 160, 800_u64),
        (15.0, 4, 27),
        (30.0, 90, 300),
        (29.97, 300, 1001),
        (50.0, 100, 200),
    ] {
        let frames = play(&encode_gif(&moving_square(count, 0), fps).unwrap());
        assert_eq!(frames.len(), count as usize);
        let mut time = 0;
        for (i, frame) in frames.iter().enumerate() {
            assert_eq!(time, (i as f64 * 100.0 / f64::from(fps)).round() as u64);
            time += u64::from(frame.delay);
        }
        assert_eq!(time, expected, "{fps} frames per second");
    }
}

#[test]
fn above_fifty_images_per_second_some_are_left_out() {
    let images = moving_square(60, 1);
    let frames = play(&encode_gif(&images, 60.0).unwrap());
    assert_eq!(
        frames.iter().map(|frame| u64::from(frame.delay)).sum::<u64>(),
        100
    );
    assert!(frames.iter().all(|frame| frame.delay >= 2));
    // The fourth frame appears after 0.07 s, when the fifth image is due.
    assert_eq!(greatest_difference(&frames[3], &images[4]), 0);
}

#[test]
fn bytes_do_not_depend_on_the_run() {
    let images = colourful(3);
    assert_eq!(
        encode_gif(&images, 20.0).unwrap(),
        encode_gif(&images, 20.0).unwrap()
    );
}

#[test]
fn images_of_different_sizes_empty_lists_and_strange_rates_are_refused() {
    let image = |side| Image::filled(side, 8, [0; 3]).unwrap();
    let error = encode_gif(&[image(8), image(9)], 10.0).unwrap_err();
    assert_eq!(
        error.to_string(),
        "a moving picture of 8 x 8 pixels: found an image of 9 x 8"
    );
    assert!(matches!(encode_gif(&[], 10.0), Err(RasterError::NoImages)));
    for fps in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let error = encode_gif(&[image(8)], fps).unwrap_err();
        assert!(matches!(error, RasterError::FrameRate { .. }), "{fps}");
    }
}
