// Computes the latent vector: the largest logit of every channel, or the one-hot code of its
// category.

override CHANNELS: u32;
override CATEGORIES: u32;
// True for a code that is one at the picked category and zero at the others, false for the picked
// logit.
override ONE_HOT: bool = false;
// Starts of logits and latent vector in `vectors`.
override LOGITS: u32;
override LATENT: u32;

@group(0) @binding(0) var<storage, read_write> vectors: array<f32>;

@compute @workgroup_size(64)
fn pick(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= CHANNELS) {
        return;
    }
    let first = id.x * CATEGORIES;
    var best = 0u;
    for (var k = 1u; k < CATEGORIES; k++) {
        if (vectors[LOGITS + first + k] > vectors[LOGITS + first + best]) {
            best = k;
        }
    }
    if (ONE_HOT) {
        for (var k = 0u; k < CATEGORIES; k++) {
            vectors[LATENT + first + k] = select(0.0, 1.0, k == best);
        }
    } else {
        vectors[LATENT + id.x] = vectors[LOGITS + first + best];
    }
}
