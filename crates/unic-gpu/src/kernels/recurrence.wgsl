// Recurrence of oscillators h, complex numbers that are driven by u. Vectors hold all real parts
// before all imaginary parts.

override OSCILLATORS: u32;
// Starts of u and h in `vectors`.
override DRIVE: u32;
override MEMORY: u32;

@group(0) @binding(0) var<storage, read> poles: array<vec2<f32>>;
@group(0) @binding(1) var<storage, read_write> vectors: array<f32>;

fn drive(k: u32) -> vec2<f32> {
    return vec2<f32>(vectors[DRIVE + k], vectors[DRIVE + OSCILLATORS + k]);
}

fn store(k: u32, h: vec2<f32>) {
    vectors[MEMORY + k] = h.x;
    vectors[MEMORY + OSCILLATORS + k] = h.y;
}

// Steady state of a motion that has always been the same: h = u / (1 - pole).
@compute @workgroup_size(64)
fn start_steady(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = id.x;
    if (k >= OSCILLATORS) {
        return;
    }
    let u = drive(k);
    let a = vec2<f32>(1.0 - poles[k].x, -poles[k].y);
    store(k, vec2<f32>(u.x * a.x + u.y * a.y, u.y * a.x - u.x * a.y) / dot(a, a));
}

// Advance by one tick: h = pole h + u.
@compute @workgroup_size(64)
fn advance(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = id.x;
    if (k >= OSCILLATORS) {
        return;
    }
    let pole = poles[k];
    let h = vec2<f32>(vectors[MEMORY + k], vectors[MEMORY + OSCILLATORS + k]);
    store(k, vec2<f32>(pole.x * h.x - pole.y * h.y, pole.x * h.y + pole.y * h.x) + drive(k));
}
