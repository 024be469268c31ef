// What is left of the displacement of a garment that was given, see `StartMemory` of unic-core, and
// the residuals of the replay, which are scaled by it. One workgroup.

// Number of the prior's principal components.
override COMPONENTS: u32;
// Starts in `vectors` of the coefficients, of those without the replay's, of those in the frame
// that the garment was given in, of the replay's, and of excursion, share and factor.
override COEFFICIENTS: u32;
override MOVED: u32;
override GIVEN: u32;
override RESIDUALS: u32;
override MEMORY: u32;
// Excursion within which the garment stays, metres; 0 for none.
override WITHIN: f32;
// Factor of one tick without it.
override FADE: f32;
// Excursion of a garment that was not given, metres.
override NEVER_GIVEN: f32;
// Least share that is told from none.
override LEAST_SHARE: f32;

// Mean square lengths of the components.
@group(0) @binding(0) var<storage, read> sizes: array<f32>;
@group(0) @binding(1) var<storage, read_write> vectors: array<f32>;

const THREADS = 64u;

var<workgroup> sums: array<f32, THREADS>;
var<workgroup> added_share: f32;

fn remember(excursion: f32, share: f32, factor: f32) {
    vectors[MEMORY] = excursion;
    vectors[MEMORY + 1u] = share;
    vectors[MEMORY + 2u] = factor;
}

// Coefficients are those that the motion moves until here, and have the residual afterwards.
fn add_residual(t: u32) {
    if (t == 0u) {
        let share = vectors[MEMORY + 1u];
        added_share = 1.0 - share * share;
    }
    workgroupBarrier();
    for (var k = t; k < COMPONENTS; k += THREADS) {
        let moved = vectors[COEFFICIENTS + k];
        vectors[MOVED + k] = moved;
        vectors[COEFFICIENTS + k] = moved + vectors[RESIDUALS + k] * added_share;
    }
}

fn count_from_here(t: u32) {
    for (var k = t; k < COMPONENTS; k += THREADS) {
        vectors[GIVEN + k] = vectors[COEFFICIENTS + k];
    }
}

// Start of a garment whose positions were given.
@compute @workgroup_size(64)
fn begin_given(@builtin(local_invocation_index) t: u32) {
    count_from_here(t);
    if (t == 0u) {
        remember(0.0, 1.0, 1.0);
    }
    add_residual(t);
}

// Start at the mean shape, which fades.
@compute @workgroup_size(64)
fn begin_at_mean(@builtin(local_invocation_index) t: u32) {
    count_from_here(t);
    if (t == 0u) {
        remember(NEVER_GIVEN, 0.0, 1.0);
    }
    add_residual(t);
}

// Frame 0 once its velocities are known.
@compute @workgroup_size(64)
fn count_again(@builtin(local_invocation_index) t: u32) {
    count_from_here(t);
    add_residual(t);
}

// Frame of a restored state.
@compute @workgroup_size(64)
fn keep(@builtin(local_invocation_index) t: u32) {
    add_residual(t);
}

// Positions are given in the current frame, and end the residual.
@compute @workgroup_size(64)
fn give(@builtin(local_invocation_index) t: u32) {
    for (var k = t; k < COMPONENTS; k += THREADS) {
        let moved = vectors[MOVED + k];
        vectors[COEFFICIENTS + k] = moved;
        vectors[GIVEN + k] = moved;
    }
    if (t == 0u) {
        remember(0.0, 1.0, 1.0);
    }
}

// Advance by one tick.
@compute @workgroup_size(64)
fn advance(@builtin(local_invocation_index) t: u32) {
    var sum = 0.0;
    for (var k = t; k < COMPONENTS; k += THREADS) {
        let a = vectors[COEFFICIENTS + k] - vectors[GIVEN + k];
        sum += sizes[k] * a * a;
    }
    sums[t] = sum;
    for (var half = THREADS / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if (t < half) {
            sums[t] += sums[t + half];
        }
    }
    if (t == 0u) {
        let before = vectors[MEMORY + 1u];
        let faded = FADE * before;
        var excursion = vectors[MEMORY];
        var stays = 0.0;
        if (WITHIN > 0.0) {
            excursion = max(excursion, sqrt(sums[0]));
            let ratio = excursion / WITHIN;
            // Large squares would overflow.
            stays = select(exp(-ratio * ratio), 0.0, ratio > 10.0);
        }
        // A share that is gone does not come back, and what else is in the state fades.
        if (before < LEAST_SHARE || stays <= faded) {
            remember(excursion, select(faded, 0.0, faded < LEAST_SHARE), FADE);
        } else {
            let share = min(stays, before);
            remember(excursion, share, share / before);
        }
    }
    add_residual(t);
}
