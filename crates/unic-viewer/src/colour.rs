use std::sync::LazyLock;

use glam::Vec3;

/// Control points of the heat ramp, sRGB, at equal distances: our own table in the spirit of
/// matplotlib's inferno (dark violet, magenta, orange, pale yellow), an approximation of a
/// perceptually uniform ramp. Lightness rises by nearly equal steps from L* = 22 to 92; the
/// floor is lighter than inferno's, so that folds of an accurate garment stay visible.
const HEAT_RAMP: [[f32; 3]; 6] = [
    [0.24, 0.17, 0.47],
    [0.47, 0.23, 0.58],
    [0.74, 0.30, 0.52],
    [0.93, 0.45, 0.38],
    [0.99, 0.68, 0.38],
    [0.98, 0.92, 0.62],
];

/// Colour of values that are not finite: no part of the ramp is grey.
const NOT_FINITE: [f32; 3] = [0.5, 0.5, 0.5];

/// sRGB colour at `ratio` of the heat ramp; clamped to 0..1, grey if `ratio` is NaN.
pub fn heat_colour(ratio: f32) -> [f32; 3] {
    if ratio.is_nan() {
        return NOT_FINITE;
    }
    let last = HEAT_RAMP.len() - 1;
    let position = ratio.clamp(0.0, 1.0) * last as f32;
    let below = (position as usize).min(last - 1);
    let (low, high) = (Vec3::from(HEAT_RAMP[below]), Vec3::from(HEAT_RAMP[below + 1]));
    low.lerp(high, position - below as f32).to_array()
}

/// One sRGB colour an error: 0 m is the dark end of the ramp, `max_m` metres and more the light
/// end, grey what is not finite. The ramp is an own approximation of a perceptually uniform one.
/// If `max_m` is not positive, every positive error has the colour of the light end.
pub fn heat_colours(errors_m: &[f32], max_m: f32) -> Vec<[f32; 3]> {
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

/// Linear light of an sRGB colour in 0..1 (IEC 61966-2-1). NaN becomes 0.
pub(crate) fn linear_from_srgb(colour: [f32; 3]) -> Vec3 {
    Vec3::from(colour.map(|encoded| {
        let encoded = if encoded > 0.0 { encoded.min(1.0) } else { 0.0 };
        if encoded <= 0.040_45 {
            encoded / 12.92
        } else {
            ((encoded + 0.055) / 1.055).powf(2.4)
        }
    }))
}

/// Steps of the encoding table. The steepest part of the curve rises by 0.2 codes a step, so the
/// table errs by less than a rounding.
const ENCODING_STEPS: usize = 16_384;

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
    fn heat_ramp_lightness_rises_nearly_evenly() {
        let ramp: Vec<f32> = (0..HEAT_RAMP.len())
            .map(|i| lightness(heat_colour(i as f32 / 5.0)))
            .collect();
        for pair in ramp.windows(2) {
            assert!((8.0..20.0).contains(&(pair[1] - pair[0])), "{ramp:?}");
        }
    }

    #[test]
    fn heat_colours_clamp_and_mark_what_is_not_finite() {
        let colours = heat_colours(&[0.0, 0.02, 1.0, -1.0, f32::NAN, f32::INFINITY], 0.02);
        assert_eq!(colours[0], HEAT_RAMP[0]);
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
