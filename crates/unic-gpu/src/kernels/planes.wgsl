// Planes that keep vertices outside of the body while their edges get their lengths back. The
// kernels follow a push by `robust.wgsl`. Constants and cases are those of
// `unic_core::intersection`.

// Height over the body above which a vertex needs no plane, metres.
const PLANE_REACH = 0.02;

// Planes n · x >= h that vertices near the body stay above: (n, h); zero without a plane.
@group(0) @binding(22) var<storage, read_write> planes: array<vec4<f32>>;

var<workgroup> moved: array<u32, 256>;

// Finds out in one workgroup whether any vertex was moved.
@compute @workgroup_size(256)
fn find_moved(@builtin(local_invocation_index) t: u32) {
    var own = 0u;
    for (var i = t; i < VERTICES; i += 256u) {
        own |= seeds[mark(i)];
    }
    moved[t] = own;
    for (var half = 128u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if (t < half) {
            moved[t] |= moved[t + half];
        }
    }
    if (t == 0u) {
        seeds[any_moved()] = moved[0];
    }
}

// Finds the planes of the vertices near the body at their shown positions, and marks these
// vertices. Vertices that are too low stay where they are.
@compute @workgroup_size(64)
fn find_planes(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    var plane = vec4<f32>();
    let face = seeds[i];
    // Without any moved vertex shown positions stay, and no plane is needed.
    if (seeds[any_moved()] == 1u && face != NO_ITEM) {
        let p = shown_position(i);
        let at = contact(p, face);
        if (abs(at.height) < PLANE_REACH) {
            let height = min(dot(p - at.point, at.normal), tick[HANDLING].x);
            plane = vec4<f32>(at.normal, dot(at.point, at.normal) + height);
        }
    }
    // A point of the body without a normal has no plane.
    let exists = any(plane.xyz != vec3<f32>());
    planes[i] = select(vec4<f32>(), plane, exists);
    seeds[mark(i)] = u32(exists);
}
