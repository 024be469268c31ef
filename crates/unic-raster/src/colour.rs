use std::sync::LazyLock;

use glam::Vec3;

/// Control points of the heat colour map at equal distances, sRGB.
///
/// The map resembles matplotlib's inferno (dark violet, magenta, orange, pale yellow) and is
/// approximately perceptually uniform: lightness rises by nearly equal steps from L* = 22 to 92.
/// The dark end is lighter than inferno's, so that folds of an accurate garment stay visible.
const HEAT_MAP: [[f32; 3]; 6] = [
    [0.24, 0.17, 0.47],
    [0.47, 0.23, 0.58],
    [0.74, 0.30, 0.52],
    [0.93, 0.45, 0.38],
    [0.99, 0.68, 0.38],
    [0.98, 0.92, 0.62],
];

/// Colour of values that are not finite: grey, which the heat colour map does not contain.
const NOT_FINITE: [f32; 3] = [0.5, 0.5, 0.5];

/// sRGB colour of the heat colour map at `ratio`, which is clamped to 0..1; grey if it is NaN.
pub fn heat_colour(ratio: f32) -> [f32; 3] {
    if ratio.is_nan() {
        return NOT_FINITE;
    }
    let last = HEAT_MAP.len() - 1;
    let position = ratio.clamp(0.0, 1.0) * last as f32;
    let below = (position as usize).min(last - 1);
    let (low, high) = (Vec3::from(HEAT_MAP[below]), Vec3::from(HEAT_MAP[below + 1]));
    low.lerp(high, position - below as f32).to_array()
}

/// sRGB colours of errors in metres, one per error.
///
/// 0 m gets the dark end of the heat colour map, `max_m` metres and more the light end, and errors
/// that are not finite get grey. If `max_m` is not positive, every positive error gets the light
/// end.
pub fn heat_colours(errors_m: &[f32], max_m: f32) -> Vec<[f32; 3]> {
    // The lower bound avoids dividing by zero, and replaces a NaN too.
    let scale = 1.0 / max_m.max(f32::MIN_POSITIVE);
    let ratio = |error: f32| {
        if error.is_finite() {
            error.max(0.0) * scale
        } else {
            f32::NAN
        }
    };
    errors_m.iter().map(|&error| heat_colour(ratio(error))).collect()
}

/// Linear light of an sRGB colour (IEC 61966-2-1), clamped to 0..1. NaN becomes 0.
pub fn linear_from_srgb(colour: [f32; 3]) -> Vec3 {
    Vec3::from(colour.map(|encoded| {
        // The comparison is false for NaN, which `clamp` would pass on.
        let encoded = if encoded > 0.0 { encoded.min(1.0) } else { 0.0 };
        if encoded <= 0.040_45 {
            encoded / 12.92
        } else {
            ((encoded + 0.055) / 1.055).powf(2.4)
        }
    }))
}

/// Number of steps of the encoding table.
///
/// The steepest part of the curve rises by 0.2 codes a step, so that the error of the table is
/// below that of rounding.
const ENCODING_STEPS: usize = 16_384;

/// 8-bit sRGB codes of evenly spaced linear values from 0 to 1. A table is faster than a power for
/// every channel of every pixel.
static ENCODING: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let encode = |step: usize| {
        let linear = step as f32 / ENCODING_STEPS as f32;
        let encoded = if linear <= 0.003_130_8 {
            linear * 12.92
        } else {
            1.055 * linear.powf(1.0 / 2.4) - 0.055
        };
        (encoded * 255.0).round() as u8
    };
    (0..=ENCODING_STEPS).map(encode).collect()
});

/// 8-bit sRGB code of linear light, clamped to 0..1.
pub(crate) fn srgb_from_linear(linear: Vec3) -> [u8; 3] {
    let scaled = linear.clamp(Vec3::ZERO, Vec3::ONE) * ENCODING_STEPS as f32 + 0.5;
    // A float-to-integer cast saturates and maps NaN to 0, so the index stays inside the table.
    scaled
        .to_array()
        .map(|value| ENCODING[(value as usize).min(ENCODING_STEPS)])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE 1976 lightness L* of an sRGB colour, from its relative luminance (Rec. 709).
    fn lightness(colour: [f32; 3]) -> f32 {
        let luminance = linear_from_srgb(colour).dot(Vec3::new(0.2126, 0.7152, 0.0722));
        116.0 * luminance.cbrt() - 16.0
    }

    #[test]
    fn heat_map_lightness_rises_nearly_evenly() {
        let levels: Vec<f32> = (0..HEAT_MAP.len())
            .map(|i| lightness(heat_colour(i as f32 / 5.0)))
            .collect();
        for pair in levels.windows(2) {
            assert!((8.0..20.0).contains(&(pair[1] - pair[0])), "{levels:?}");
        }
    }

    #[test]
    fn heat_colours_clamp_and_mark_non_finite_errors() {
        let colours = heat_colours(&[0.0, 0.02, 1.0, -1.0, f32::NAN, f32::INFINITY], 0.02);
        assert_eq!(colours[0], HEAT_MAP[0]);
        assert_eq!(colours[1], colours[2]);
        assert_eq!(colours[3], colours[0]);
        assert_eq!(colours[4], NOT_FINITE);
        assert_eq!(colours[5], NOT_FINITE);
    }

    #[test]
    fn every_srgb_code_survives_the_round_trip() {
        for code in 0..=255_u8 {
            let linear = linear_from_srgb([f32::from(code) / 255.0; 3]);
            assert_eq!(srgb_from_linear(linear), [code; 3]);
        }
    }
}
