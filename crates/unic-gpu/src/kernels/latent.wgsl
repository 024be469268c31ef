// The largest logit of every channel.

override CHANNELS: u32;
override CATEGORIES: u32;
// Where they are in `vectors`.
override LOGITS: u32;
override LATENT: u32;

@group(0) @binding(0) var<storage, read_write> vectors: array<f32>;

@compute @workgroup_size(64)
fn pick(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= CHANNELS) {
        return;
    }
    var largest = vectors[LOGITS + id.x * CATEGORIES];
    for (var k = 1u; k < CATEGORIES; k++) {
        largest = max(largest, vectors[LOGITS + id.x * CATEGORIES + k]);
    }
    vectors[LATENT + id.x] = largest;
}
