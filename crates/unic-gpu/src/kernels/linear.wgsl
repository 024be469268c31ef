// Computes y = f(W x + b) for one vector x. Memory bounds it, so 32 invocations read each row in
// adjacent pieces.

const ROWS = 8u;
const LANES = 32u;

struct Layer {
    // Length of a padded row of W, in vectors of four.
    inputs4: u32,
    outputs: u32,
    // Start of x in `vectors`, in vectors of four.
    input4: u32,
    // Start of y in `vectors`, in numbers.
    output: u32,
    activation: u32,
}

const NONE = 0u;
const ELU = 1u;
// Adds y to the stored numbers.
const ADD = 2u;

@group(0) @binding(0) var<uniform> layer: Layer;
//{weights}
@group(0) @binding(2) var<storage, read> biases: array<f32>;
@group(0) @binding(3) var<storage, read_write> vectors: array<vec4<f32>>;

var<workgroup> sums: array<f32, 256>;

@compute @workgroup_size(256)
fn linear(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let row = group.x * ROWS + t / LANES;
    let lane = t % LANES;
    var sum = vec4<f32>();
    if (row < layer.outputs) {
        for (var i = lane; i < layer.inputs4; i += LANES) {
            sum += weight(row * layer.inputs4 + i) * vectors[layer.input4 + i];
        }
    }
    sums[t] = sum.x + sum.y + sum.z + sum.w;
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if (lane < half) {
            sums[t] += sums[t + half];
        }
    }
    if (lane == 0u && row < layer.outputs) {
        let y = biases[row] + sums[t];
        let at = layer.output + row;
        switch (layer.activation) {
            case ELU: {
                vectors[at / 4u][at % 4u] = select(exp(y) - 1.0, y, y > 0.0);
            }
            case ADD: {
                vectors[at / 4u][at % 4u] += y;
            }
            default: {
                vectors[at / 4u][at % 4u] = y;
            }
        }
    }
}
