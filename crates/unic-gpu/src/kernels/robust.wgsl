// Robust intersection handling: a vertex is pushed out of the closest triangle of the parts that
// may push it, along the shortest way, to a margin. Deep inside the body it first moves towards its
// skinned position. Constants and cases are those of
// `unic_core::intersection::RobustIntersection::correct_shown` and `unic_core::folds`, whose
// comments give the reasons.

// Number of words of 32 bits in a set of joints.
override WORDS: u32;
// Starts in `tables` of the faces around vertices, and of the sets of joints.
override AROUND: u32;
override PUSHING: u32;
// True for a second push, of the vertices that are marked alone.
override AGAIN: bool = false;
// Share of the margin to which vertices are pushed.
override MARGIN_SHARE: f32 = 1.0;
// True if vertices deep inside the body are drawn towards their skinned positions first.
override RETRACT: bool = false;

// Ratio of height to longest edge below which a triangle is treated as its edges.
const MIN_RELATIVE_HEIGHT = 1e-4;
// Distance to an edge below which the normal replaces the direction to it, metres.
const MIN_DISTANCE = 1e-4;
// Smallest cosine between the push and the normal; below it the point lies beyond a rim.
const MIN_RIM_COSINE = 0.3;
// Largest number of further pushes after the first.
const MAX_ITERATIONS = 4u;
// Height below the margin at which a vertex is not pushed, metres.
const TOLERANCE = 1e-5;
// Largest gap of a fold between parts that face each other, metres.
const FOLD_GAP = 0.006;
// Depths over which retraction sets in, metres.
const MIN_RETRACTED_DEPTH = 0.01;
const FULLY_RETRACTED_DEPTH = 0.02;
// Largest number of steps of a retraction.
const MAX_STEPS = 8u;
// Distance from the margin at which a retracted vertex has arrived, metres.
const ARRIVED = 1e-3;
// Length of the rays through the inside of a body, metres.
const REACH = 0.35;
// Largest cosine between the normals of two parts that face each other.
const FACING_COSINE = -0.5;
// Squared distance to a face that may not push: more than FAR.
const NEVER = 3.3e38;
// Smallest magnitude of a coordinate of a ray's direction.
const MIN_COMPONENT = 1e-30;

struct Face {
    corners: vec3<u32>,
    // Joint that moves the face most.
    joint: u32,
    // Corners by welded vertices: the first vertex at each place in the bind pose.
    welded: vec3<u32>,
    padding: u32,
}

// Corners relative to a point, and the normal whose length is twice the area; zero when degenerate.
struct Triangle {
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    normal: vec3<f32>,
}

// Closest point of a triangle minus the query point, and the part that it lies on: 0 the face, 1 to
// 3 an edge, 4 to 6 a vertex.
struct Hit {
    offset: vec3<f32>,
    feature: u32,
}

// Closest point of the body to a vertex.
struct Contact {
    face: u32,
    feature: u32,
    point: vec3<f32>,
    normal: vec3<f32>,
    height: f32,
}

// Positions of the garment, world space. The places of the normals hold the skinned positions until
// the normals are computed.
@group(0) @binding(9) var<storage, read_write> shown: array<f32>;
@group(0) @binding(14) var<storage, read> faces: array<Face>;
// Faces around welded vertex i are `tables[AROUND + k]` for k from `tables[i]` to `tables[i + 1]`.
// The joints whose parts may push garment vertex i are the bits of WORDS words from PUSHING + WORDS
// i on.
@group(0) @binding(15) var<storage, read> tables: array<u32>;

// `seeds` continues behind the nearest items. Devices promise no more than eight storage buffers a
// kernel, and `push` uses all of them.

// Index in `seeds` of a vertex's mark: 1 for a vertex that was moved, then for one with a plane or
// that sweeps have moved far, see `store_shown`.
fn mark(i: u32) -> u32 {
    return VERTICES + i;
}

// Index in `seeds` of a word that is 1 if any vertex was moved.
fn any_moved() -> u32 {
    return 2u * VERTICES;
}

// Number of words about a vertex.
const PUSHED_WORDS = 7u;

// Index in `seeds` of what a first push leaves about a vertex.
fn pushed_at(i: u32) -> u32 {
    return 2u * VERTICES + 1u + PUSHED_WORDS * i;
}

// Cloth that was below the margin.
struct PushedCloth {
    // Depth below the margin, metres; zero for a vertex that has stayed.
    depth: f32,
    // Face that it was next to, and the weights of its first two corners at the closest point: before
    // the push, or after it where the vertex was drawn to its skinned position.
    face: u32,
    weights: vec2<f32>,
    // Displacement, metres; zero for a vertex that was drawn to its skinned position first.
    by: vec3<f32>,
}

fn store_pushed(i: u32, cloth: PushedCloth) {
    if (!AGAIN) {
        let at = pushed_at(i);
        seeds[at] = bitcast<u32>(cloth.depth);
        seeds[at + 1u] = cloth.face;
        seeds[at + 2u] = bitcast<u32>(cloth.by.x);
        seeds[at + 3u] = bitcast<u32>(cloth.by.y);
        seeds[at + 4u] = bitcast<u32>(cloth.by.z);
        seeds[at + 5u] = bitcast<u32>(cloth.weights.x);
        seeds[at + 6u] = bitcast<u32>(cloth.weights.y);
    }
}

fn pushed_cloth(i: u32) -> PushedCloth {
    let at = pushed_at(i);
    let by = vec3<u32>(seeds[at + 2u], seeds[at + 3u], seeds[at + 4u]);
    let weights = bitcast<vec2<f32>>(vec2<u32>(seeds[at + 5u], seeds[at + 6u]));
    return PushedCloth(bitcast<f32>(seeds[at]), seeds[at + 1u], weights, bitcast<vec3<f32>>(by));
}

// Garment vertex of this invocation.
var<private> pushed_vertex: u32;

// Returns whether a body face may push the vertex.
fn may_push(face: u32) -> bool {
    let joint = faces[face].joint;
    return ((tables[PUSHING + pushed_vertex * WORDS + joint / 32u] >> (joint % 32u)) & 1u) == 1u;
}

fn triangle(face: u32, p: vec3<f32>) -> Triangle {
    let corners = faces[face].corners;
    let a = body_vertex(corners.x) - p;
    let b = body_vertex(corners.y) - p;
    let c = body_vertex(corners.z) - p;
    let normal = cross(b - a, c - a);
    let longest = MIN_RELATIVE_HEIGHT * max(squared(b - a), max(squared(c - b), squared(a - c)));
    let is_sound = squared(normal) > longest * longest;
    return Triangle(a, b, c, select(vec3<f32>(), normal, is_sound));
}

fn nearer(a: Hit, b: Hit) -> Hit {
    if (squared(b.offset) < squared(a.offset)) {
        return b;
    }
    return a;
}

fn closest_on_edge(a: vec3<f32>, b: vec3<f32>, edge: u32) -> Hit {
    let along = b - a;
    let size = squared(along);
    let t = select(0.0, -dot(a, along) / size, size > 0.0);
    if (t <= 0.0) {
        return Hit(a, 4u + edge);
    }
    if (t >= 1.0) {
        return Hit(b, 4u + (edge + 1u) % 3u);
    }
    return Hit(a + along * t, 1u + edge);
}

fn closest_of(t: Triangle) -> Hit {
    let size = squared(t.normal);
    var beyond = vec3<bool>(true);
    if (size > 1e-37) {
        let v = dot(t.a, cross(t.normal, t.c - t.a)) / size;
        let w = dot(t.a, cross(t.b - t.a, t.normal)) / size;
        beyond = vec3<bool>((w < 0.0), (v + w > 1.0), (v < 0.0));
        if (!any(beyond)) {
            return Hit(t.normal * (dot(t.a, t.normal) / size), 0u);
        }
    }
    var hit = Hit(vec3<f32>(1e18), 0u);
    if (beyond.x) {
        hit = nearer(hit, closest_on_edge(t.a, t.b, 0u));
    }
    if (beyond.y) {
        hit = nearer(hit, closest_on_edge(t.b, t.c, 1u));
    }
    if (beyond.z) {
        hit = nearer(hit, closest_on_edge(t.c, t.a, 2u));
    }
    return hit;
}

fn to_item(face: u32, p: vec3<f32>) -> f32 {
    if (!may_push(face)) {
        return NEVER;
    }
    return squared(closest_of(triangle(face, p)).offset);
}

fn unit_or_zero(v: vec3<f32>) -> vec3<f32> {
    let size = length(v);
    return select(vec3<f32>(), v / size, size > 0.0);
}

fn face_normal(face: u32) -> vec3<f32> {
    return unit_or_zero(triangle(face, body_vertex(faces[face].corners.x)).normal);
}

// Angle of a face at one of its welded vertices, radians.
fn angle_at(face: u32, vertex: u32) -> f32 {
    let at = faces[face];
    let k = select(select(2u, 1u, at.welded.y == vertex), 0u, at.welded.x == vertex);
    let corner = body_vertex(at.corners[k]);
    let u = body_vertex(at.corners[(k + 1u) % 3u]) - corner;
    let v = body_vertex(at.corners[(k + 2u) % 3u]) - corner;
    return atan2(length(cross(u, v)), dot(u, v));
}

// Angle-weighted pseudonormal of a face, edge or vertex.
fn pseudonormal(face: u32, feature: u32) -> vec3<f32> {
    if (feature == 0u) {
        return face_normal(face);
    }
    let welded = faces[face].welded;
    let is_edge = feature < 4u;
    let k = select(feature - 4u, feature - 1u, is_edge);
    let vertex = welded[k];
    let other = welded[(k + 1u) % 3u];
    var sum = vec3<f32>();
    for (var row = tables[vertex]; row < tables[vertex + 1u]; row++) {
        let around = tables[AROUND + row];
        if (!is_edge) {
            sum += face_normal(around) * angle_at(around, vertex);
        } else if (any(faces[around].welded == vec3<u32>(other))) {
            sum += face_normal(around);
        }
    }
    return unit_or_zero(sum);
}

fn contact(p: vec3<f32>, face: u32) -> Contact {
    let hit = closest_of(triangle(face, p));
    let normal = pseudonormal(face, hit.feature);
    let distance = length(hit.offset);
    let height = select(distance, -distance, dot(hit.offset, normal) > 0.0);
    return Contact(face, hit.feature, p + hit.offset, normal, height);
}

// Weights of the first two corners of the face at a contact's point; a third each on a face without
// an area.
fn corner_weights(at: Contact) -> vec2<f32> {
    let t = triangle(at.face, at.point);
    let size = squared(t.normal);
    if (size == 0.0) {
        return vec2<f32>(1.0 / 3.0);
    }
    let areas = vec2<f32>(dot(t.normal, cross(t.b, t.c)), dot(t.normal, cross(t.c, t.a)));
    return clamp(areas / size, vec2<f32>(), vec2<f32>(1.0));
}

// Push by a contact, and the position to which it leads.
struct Push {
    exists: bool,
    to: vec3<f32>,
}

fn push_out(at: Contact, p: vec3<f32>, margin: f32) -> Push {
    if (at.height > margin - TOLERANCE) {
        return Push(false, p);
    }
    var direction = at.normal;
    if (at.feature != 0u && abs(at.height) >= MIN_DISTANCE) {
        direction = (p - at.point) / at.height;
    }
    let is_under = dot(direction, at.normal) > MIN_RIM_COSINE;
    return Push(is_under, at.point + direction * margin);
}

// Distance along a ray at which it hits a face, and the cosine with its normal: negative from
// outside. The distance is FAR for a miss.
fn crossing(face: u32, origin: vec3<f32>, direction: vec3<f32>) -> vec2<f32> {
    let t = triangle(face, origin);
    let along = dot(direction, t.normal);
    let sides = vec3<f32>(
        dot(direction, cross(t.a, t.b)),
        dot(direction, cross(t.b, t.c)),
        dot(direction, cross(t.c, t.a)),
    );
    let is_through = all(sides >= vec3<f32>()) || all(sides <= vec3<f32>());
    let distance = dot(t.a, t.normal) / along;
    if (!is_through || along == 0.0 || !(distance >= 0.0)) {
        return vec2<f32>(FAR, 0.0);
    }
    return vec2<f32>(distance, along / length(t.normal));
}

fn entry(node: u32, origin: vec3<f32>, inverse: vec3<f32>) -> f32 {
    let a = (boxes[2u * node].xyz - origin) * inverse;
    let b = (boxes[2u * node + 1u].xyz - origin) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    let enter = max(max(near.x, near.y), max(near.z, 0.0));
    let leave = min(far.x, min(far.y, far.z));
    return select(FAR, enter, enter <= leave);
}

// Returns whether a welded vertex lies in a fold between parts that may push: the first face that a
// ray along its normal hits decides.
fn is_vertex_folded(vertex: u32) -> bool {
    var origin = vec3<f32>();
    var normal = vec3<f32>();
    for (var row = tables[vertex]; row < tables[vertex + 1u]; row++) {
        let face = faces[tables[AROUND + row]];
        let k = select(select(2u, 1u, face.welded.y == vertex), 0u, face.welded.x == vertex);
        origin = body_vertex(face.corners[k]);
        normal += triangle(tables[AROUND + row], origin).normal;
    }
    let direction = unit_or_zero(normal);
    if (squared(direction) == 0.0) {
        return false;
    }
    let inverse = 1.0 / select(direction, vec3<f32>(MIN_COMPONENT), abs(direction) < vec3<f32>(MIN_COMPONENT));
    var first = vec2<f32>(REACH, 0.0);
    var nodes: array<u32, STACK>;
    nodes[0] = 0u;
    var height = 1u;
    while (height > 0u) {
        height--;
        let node = nodes[height];
        if (entry(node, origin, inverse) > first.x) {
            continue;
        }
        if (node < FIRST_LEAF) {
            for (var k = 1u; k <= 4u; k++) {
                nodes[height] = 4u * node + k;
                height++;
            }
            continue;
        }
        for (var k = 0u; k < CAPACITY; k++) {
            let face = items[(node - FIRST_LEAF) * CAPACITY + k];
            if (face == NO_ITEM || any(faces[face].welded == vec3<u32>(vertex))) {
                continue;
            }
            let found = crossing(face, origin, direction);
            if (found.x < first.x && may_push(face)) {
                first = found;
            }
        }
    }
    return first.y > 0.0 || (first.y < FACING_COSINE && first.x <= FOLD_GAP);
}

fn is_folded(face: u32) -> bool {
    let welded = faces[face].welded;
    return is_vertex_folded(welded.x) && is_vertex_folded(welded.y) && is_vertex_folded(welded.z);
}

fn shown_position(i: u32) -> vec3<f32> {
    return vec3<f32>(shown[6u * i], shown[6u * i + 1u], shown[6u * i + 2u]);
}

fn skinned_position(i: u32) -> vec3<f32> {
    return vec3<f32>(shown[6u * i + 3u], shown[6u * i + 4u], shown[6u * i + 5u]);
}

// Moves a vertex. `face` is the nearest one, to which planes belong.
fn show(i: u32, face: u32, p: vec3<f32>) {
    seeds[i] = face;
    seeds[mark(i)] = 1u;
    shown[6u * i] = p.x;
    shown[6u * i + 1u] = p.y;
    shown[6u * i + 2u] = p.z;
}

// Position of a vertex deep inside the body on its way to its skinned position, at the skin;
// `around` is its contact.
fn retracted(p: vec3<f32>, around: Contact, margin: f32) -> vec3<f32> {
    let way = skinned_position(pushed_vertex) - p;
    let size = length(way);
    let share = smoothstep(MIN_RETRACTED_DEPTH, FULLY_RETRACTED_DEPTH, -around.height);
    if (share == 0.0 || !(size > 0.0) || is_folded(around.face)) {
        return p;
    }
    var travelled = 0.0;
    var at = around;
    for (var step = 0u; step < MAX_STEPS; step++) {
        travelled = min(travelled + margin - at.height, size);
        if (travelled == size) {
            break;
        }
        let place = p + way * (travelled / size);
        let face = nearest(place, at.face);
        if (face == NO_ITEM) {
            return p;
        }
        at = contact(place, face);
        if (at.height > margin - ARRIVED) {
            break;
        }
    }
    return p + way * (share * travelled / size);
}

@compute @workgroup_size(64)
fn push(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    if (AGAIN && seeds[mark(i)] == 0u) {
        return;
    }
    pushed_vertex = i;
    seeds[mark(i)] = 0u;
    var cloth = PushedCloth(0.0, NO_ITEM, vec2<f32>(), vec3<f32>());
    store_pushed(i, cloth);
    let margin = tick[HANDLING].x * MARGIN_SHARE;
    var p = shown_position(i);
    var face = nearest(p, seeds[i]);
    seeds[i] = face;
    if (face == NO_ITEM) {
        return;
    }
    var around = contact(p, face);
    if (RETRACT && around.height < -MIN_RETRACTED_DEPTH) {
        let drawn = retracted(p, around, margin);
        if (any(drawn != p)) {
            cloth.depth = margin - around.height;
            p = drawn;
            face = nearest(p, face);
            if (face == NO_ITEM) {
                return;
            }
            around = contact(p, face);
            show(i, face, p);
            cloth.face = face;
            cloth.weights = corner_weights(around);
            store_pushed(i, cloth);
        }
    }
    var out = push_out(around, p, margin);
    if (!out.exists || is_folded(face)) {
        return;
    }
    let start = p;
    let is_retracted = cloth.depth > 0.0;
    cloth.face = face;
    // In a crease a push out of one side leads into the other. The last one goes halfway: between
    // sides that are close, the middle is outside both.
    p = out.to;
    for (var iteration = 1u; iteration <= MAX_ITERATIONS; iteration++) {
        face = nearest(p, face);
        if (face == NO_ITEM) {
            break;
        }
        out = push_out(contact(p, face), p, margin);
        if (!out.exists) {
            break;
        }
        p = select(0.5 * (p + out.to), out.to, iteration < MAX_ITERATIONS);
    }
    show(i, face, p);
    if (is_retracted && face != NO_ITEM) {
        cloth.face = face;
        cloth.weights = corner_weights(contact(p, face));
    } else if (!is_retracted) {
        cloth.by = p - start;
        cloth.weights = corner_weights(around);
        cloth.depth = min(length(cloth.by), margin - around.height);
    }
    store_pushed(i, cloth);
}
