//! Leg and foot.

use super::{Anatomy, Segment};

/// Sections of the calf: distance from the knee, half width, depths to the front and to the back,
/// metres.
const CALF: [[f32; 4]; 7] = [
    [0.000, 0.044, 0.045, 0.040],
    [0.060, 0.049, 0.044, 0.053],
    [0.130, 0.053, 0.043, 0.064],
    [0.200, 0.050, 0.040, 0.056],
    [0.290, 0.038, 0.034, 0.041],
    [0.370, 0.031, 0.031, 0.034],
    [0.405, 0.032, 0.034, 0.036],
];

const HIP: [f32; 3] = [0.092, 0.885, 0.0];
const KNEE: [f32; 3] = [0.094, 0.484, 0.004];
const ANKLE: [f32; 3] = [0.100, 0.077, -0.026];

impl Anatomy {
    pub(super) fn leg(&mut self) {
        let hip = self.proportions.girths.hip;
        // Only the upper part of the thigh follows the girth of the hips.
        let thigh = [
            [0.000, 0.074 * hip, 0.080 * hip, 0.080 * hip],
            [0.080, 0.076 * hip, 0.084 * hip, 0.082 * hip],
            [0.180, 0.071 * hip, 0.079 * hip, 0.072 * hip],
            [0.280, 0.062, 0.068, 0.060],
            [0.350, 0.052, 0.055, 0.050],
            [0.400, 0.044, 0.046, 0.042],
        ];
        let seg = Segment::Leg;
        self.limb(seg, 0.05, [HIP, KNEE], &thigh);
        self.limb(seg, 0.03, [KNEE, ANKLE], &CALF);
        // The kneecap.
        self.ellipsoid(seg, 0.02, [0.094, 0.487, 0.036], [0.026, 0.034, 0.013], 0.0);
    }

    pub(super) fn foot(&mut self) {
        let seg = Segment::Leg;
        self.ellipsoid(seg, 0.020, [0.100, 0.036, -0.050], [0.033, 0.040, 0.034], 0.0);
        let instep = [[0.101, 0.070, -0.014], [0.112, 0.030, 0.085]];
        self.cone(seg, 0.030, instep, [0.034, 0.025]);
        let sole = [[0.100, 0.024, -0.040], [0.121, 0.020, 0.085]];
        self.cone(seg, 0.020, sole, [0.030, 0.026]);
        self.ellipsoid(seg, 0.020, [0.113, 0.022, 0.100], [0.045, 0.024, 0.048], 0.0);
        self.ellipsoid(seg, 0.018, [0.108, 0.019, 0.150], [0.037, 0.018, 0.034], 0.0);
        // The ankle bones.
        self.ellipsoid(seg, 0.015, [0.100, 0.084, -0.022], [0.039, 0.018, 0.020], 0.0);
    }
}
