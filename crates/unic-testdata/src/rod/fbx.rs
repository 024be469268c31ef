//! FBX 7.4: a tree of nodes with values, as text or as bytes.

use super::{CORNERS, SIDES};
use std::fmt::Write;

/// Value of a node.
#[derive(Clone, Debug)]
pub enum FbxValue {
    /// 32-bit integer.
    Int(i32),
    /// 64-bit integer.
    Long(i64),
    /// Number.
    Double(f64),
    /// Text; names of objects are `Name\0\u{1}Class`.
    Text(String),
    /// List of 32-bit integers.
    Ints(Vec<i32>),
    /// List of 64-bit integers.
    Longs(Vec<i64>),
    /// List of 32-bit numbers.
    Floats(Vec<f32>),
    /// List of numbers.
    Doubles(Vec<f64>),
}

use FbxValue::{Double, Doubles, Floats, Int, Ints, Long, Longs, Text};

/// Node of the tree.
#[derive(Clone, Debug)]
pub struct FbxNode {
    /// Name.
    pub name: &'static str,
    /// Values, in their order.
    pub values: Vec<FbxValue>,
    /// Nodes within it.
    pub children: Vec<FbxNode>,
}

fn node(name: &'static str, values: Vec<FbxValue>, children: Vec<FbxNode>) -> FbxNode {
    FbxNode {
        name,
        values,
        children,
    }
}

fn text(text: &str) -> FbxValue {
    Text(text.to_owned())
}

fn leaf(name: &'static str, value: FbxValue) -> FbxNode {
    node(name, vec![value], Vec::new())
}

fn object(
    name: &'static str,
    id: i64,
    title: &str,
    class: &str,
    kind: &str,
    children: Vec<FbxNode>,
) -> FbxNode {
    let title = format!("{title}\0\u{1}{class}");
    node(name, vec![Long(id), Text(title), text(kind)], children)
}

fn properties(list: Vec<Vec<FbxValue>>) -> FbxNode {
    let list = list.into_iter().map(|values| node("P", values, Vec::new()));
    node("Properties70", Vec::new(), list.collect())
}

fn property(name: &str, kind: &str, label: &str, flags: &str, values: Vec<FbxValue>) -> Vec<FbxValue> {
    [name, kind, label, flags]
        .map(text)
        .into_iter()
        .chain(values)
        .collect()
}

fn int(name: &str, value: i32) -> Vec<FbxValue> {
    property(name, "int", "Integer", "", vec![Int(value)])
}

fn vector(name: &str, [x, y, z]: [f64; 3]) -> Vec<FbxValue> {
    property(name, name, "", "A", vec![Double(x), Double(y), Double(z)])
}

/// Time unit of the format: ticks in a second.
const SECOND: i64 = 46_186_158_000;

/// The rod as a tree.
pub fn rod_fbx() -> Vec<FbxNode> {
    let connections = [
        (11, 0),
        (12, 11),
        (13, 12),
        (14, 0),
        (20, 14),
        (21, 12),
        (22, 13),
        (30, 20),
        (31, 30),
        (32, 30),
        (12, 31),
        (13, 32),
        (41, 40),
        (42, 41),
        (43, 41),
    ];
    let mut links: Vec<FbxNode> = (connections.iter())
        .map(|(from, to)| node("C", vec![text("OO"), Long(*from), Long(*to)], Vec::new()))
        .collect();
    for (from, to, property) in [
        (42, 12, "Lcl Translation"),
        (43, 13, "Lcl Rotation"),
        (44, 42, "d|Y"),
        (45, 43, "d|X"),
    ] {
        links.push(node(
            "C",
            vec![text("OP"), Long(from), Long(to), text(property)],
            Vec::new(),
        ));
    }
    vec![
        node(
            "FBXHeaderExtension",
            Vec::new(),
            vec![leaf("FBXHeaderVersion", Int(1003)), leaf("FBXVersion", Int(7400))],
        ),
        node(
            "GlobalSettings",
            Vec::new(),
            vec![leaf("Version", Int(1000)), settings()],
        ),
        node("Objects", Vec::new(), objects()),
        node("Connections", Vec::new(), links),
    ]
}

fn settings() -> FbxNode {
    properties(vec![
        int("UpAxis", 2),
        int("UpAxisSign", 1),
        int("FrontAxis", 1),
        int("FrontAxisSign", -1),
        int("CoordAxis", 0),
        int("CoordAxisSign", 1),
        property("UnitScaleFactor", "double", "Number", "", vec![Double(1.0)]),
        // 14 stands for a rate that the next property states.
        property("TimeMode", "enum", "", "", vec![Int(14)]),
        property("CustomFrameRate", "double", "Number", "", vec![Double(20.0)]),
    ])
}

fn objects() -> Vec<FbxNode> {
    let bone = |id, name, place| {
        let own = properties(vec![vector("Lcl Translation", place)]);
        object(
            "Model",
            id,
            name,
            "Model",
            "LimbNode",
            vec![leaf("Version", Int(232)), own],
        )
    };
    let limb = |id| {
        let kind = leaf("TypeFlags", text("Skeleton"));
        object(
            "NodeAttribute",
            id,
            "bone",
            "NodeAttribute",
            "LimbNode",
            vec![kind],
        )
    };
    let corners = CORNERS.concat();
    // The last corner of a polygon is stored as its complement.
    let sides: Vec<i32> = SIDES.iter().flat_map(|[a, b, c, d]| [*a, *b, *c, !*d]).collect();
    let shape = vec![
        leaf("Vertices", Doubles(corners)),
        leaf("PolygonVertexIndex", Ints(sides)),
    ];
    vec![
        object("Model", 11, "armature", "Model", "Null", Vec::new()),
        bone(12, "hips", [0.0, 0.0, 0.0]),
        bone(13, "chest", [0.0, 0.0, 50.0]),
        object("Model", 14, "body", "Model", "Mesh", Vec::new()),
        object("Geometry", 20, "body", "Geometry", "Mesh", shape),
        limb(21),
        limb(22),
        object("Deformer", 30, "skin", "Deformer", "Skin", Vec::new()),
        cluster(31, [0, 1, 2, 3], 0.0),
        cluster(32, [4, 5, 6, 7], 50.0),
        // Without times of its own: those of the keys hold.
        object("AnimationStack", 40, "bend", "AnimStack", "", Vec::new()),
        object("AnimationLayer", 41, "layer", "AnimLayer", "", Vec::new()),
        object("AnimationCurveNode", 42, "T", "AnimCurveNode", "", Vec::new()),
        object("AnimationCurveNode", 43, "R", "AnimCurveNode", "", Vec::new()),
        curve(44, 100.0),
        curve(45, 1.0_f32.to_degrees()),
    ]
}

/// A joint at a height and the corners that follow it.
fn cluster(id: i64, corners: [i32; 4], height: f64) -> FbxNode {
    let moved = |z: f64| {
        let mut matrix = [0.0; 16];
        [0, 5, 10, 15].into_iter().for_each(|place| matrix[place] = 1.0);
        matrix[14] = z;
        Doubles(matrix.to_vec())
    };
    let children = vec![
        leaf("Indexes", Ints(corners.to_vec())),
        leaf("Weights", Doubles(vec![1.0; 4])),
        leaf("Transform", moved(-height)),
        leaf("TransformLink", moved(height)),
    ];
    object("Deformer", id, "joint", "SubDeformer", "Cluster", children)
}

/// A straight curve from zero to `end` in a second.
fn curve(id: i64, end: f32) -> FbxNode {
    let children = vec![
        leaf("Default", Double(0.0)),
        leaf("KeyVer", Int(4008)),
        leaf("KeyTime", Longs(vec![0, SECOND])),
        leaf("KeyValueFloat", Floats(vec![0.0, end])),
        // Linear keys.
        leaf("KeyAttrFlags", Ints(vec![4])),
        leaf("KeyAttrDataFloat", Floats(vec![0.0; 4])),
        leaf("KeyAttrRefCount", Ints(vec![2])),
    ];
    object("AnimationCurve", id, "", "AnimCurve", "", children)
}

/// Writes a tree as text.
pub fn fbx_text(nodes: &[FbxNode]) -> String {
    let mut out = String::from("; FBX 7.4.0 project file\n");
    nodes.iter().for_each(|node| write_text(node, &mut out));
    out
}

fn write_text(node: &FbxNode, out: &mut String) {
    let values: Vec<String> = node.values.iter().map(value_text).collect();
    write!(out, "{}: {}", node.name, values.join(", ")).unwrap();
    if node.children.is_empty() && !node.values.is_empty() {
        out.push('\n');
        return;
    }
    out.push_str(" {\n");
    node.children.iter().for_each(|child| write_text(child, out));
    out.push_str("}\n");
}

fn value_text(value: &FbxValue) -> String {
    fn list<T: ToString>(values: &[T]) -> String {
        let words: Vec<String> = values.iter().map(T::to_string).collect();
        format!("*{} {{\na: {}\n}}", values.len(), words.join(","))
    }
    match value {
        Int(x) => x.to_string(),
        Long(x) => x.to_string(),
        Double(x) => x.to_string(),
        // Text files put the class first.
        Text(text) => match text.split_once("\0\u{1}") {
            Some((name, class)) => format!("\"{class}::{name}\""),
            None => format!("\"{text}\""),
        },
        Ints(list_of) => list(list_of),
        Longs(list_of) => list(list_of),
        Floats(list_of) => list(list_of),
        Doubles(list_of) => list(list_of),
    }
}

/// Writes a tree as bytes.
pub fn fbx_binary(nodes: &[FbxNode]) -> Vec<u8> {
    let mut out = b"Kaydara FBX Binary  \0\x1a\0".to_vec();
    out.extend(7400_u32.to_le_bytes());
    nodes.iter().for_each(|node| write_binary(node, &mut out));
    out.extend([0; 13]);
    out
}

fn write_binary(node: &FbxNode, out: &mut Vec<u8>) {
    let start = out.len();
    out.extend([0; 12]);
    out.push(node.name.len() as u8);
    out.extend(node.name.as_bytes());
    let values = out.len();
    node.values.iter().for_each(|value| value_bytes(value, out));
    let length = out.len() - values;
    if !node.children.is_empty() {
        node.children.iter().for_each(|child| write_binary(child, out));
        // A record of zeros ends a list of nodes.
        out.extend([0; 13]);
    }
    for (place, number) in [out.len(), node.values.len(), length].into_iter().enumerate() {
        let at = start + 4 * place;
        out[at..at + 4].copy_from_slice(&(number as u32).to_le_bytes());
    }
}

fn value_bytes(value: &FbxValue, out: &mut Vec<u8>) {
    fn list<const N: usize>(letter: u8, numbers: impl ExactSizeIterator<Item = [u8; N]>, out: &mut Vec<u8>) {
        out.push(letter);
        let count = numbers.len();
        // Number of elements, no compression, number of bytes.
        for number in [count, 0, N * count] {
            out.extend((number as u32).to_le_bytes());
        }
        numbers.for_each(|bytes| out.extend(bytes));
    }
    match value {
        Int(x) => out.extend([b"I", &x.to_le_bytes()[..]].concat()),
        Long(x) => out.extend([b"L", &x.to_le_bytes()[..]].concat()),
        Double(x) => out.extend([b"D", &x.to_le_bytes()[..]].concat()),
        Text(text) => {
            out.push(b'S');
            out.extend((text.len() as u32).to_le_bytes());
            out.extend(text.as_bytes());
        }
        Ints(values) => list(b'i', values.iter().map(|x| x.to_le_bytes()), out),
        Longs(values) => list(b'l', values.iter().map(|x| x.to_le_bytes()), out),
        Floats(values) => list(b'f', values.iter().map(|x| x.to_le_bytes()), out),
        Doubles(values) => list(b'd', values.iter().map(|x| x.to_le_bytes()), out),
    }
}
