//! A body model of SMPL as a pickle of Python, of protocol 3.

use unic_core::skeleton::SMPL_PARENTS;

/// Number of vertices of the model.
const VERTICES: usize = 12;

/// Returns a model of twelve vertices with the arrays that a character is made of.
pub(crate) fn smpl_pickle() -> Vec<u8> {
    let joints = SMPL_PARENTS.len();
    let places: Vec<f64> = (0..3 * VERTICES).map(|i| (0.7 * i as f64).sin()).collect();
    let one_joint: Vec<f64> = (0..VERTICES * joints)
        .map(|i| f64::from(u8::from(i % joints == (i / joints) % joints)))
        .collect();
    let regressor: Vec<f64> = (0..joints * VERTICES)
        .map(|i| f64::from(u8::from(i % VERTICES == (i / VERTICES) % VERTICES)))
        .collect();
    let faces: Vec<u32> = (0..VERTICES as u32 - 2).flat_map(|v| [v, v + 1, v + 2]).collect();
    let parents = SMPL_PARENTS.iter().map(|&parent| parent as u32);
    let tree: Vec<u32> = parents.chain(0..joints as u32).collect();
    // A dictionary that its entries are set in.
    let mut bytes = b"\x80\x03}(".to_vec();
    let floats = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let integers = |values: &[u32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    for (name, dtype, shape, data) in [
        ("v_template", "f8", [VERTICES, 3], floats(&places)),
        ("weights", "f8", [VERTICES, joints], floats(&one_joint)),
        ("J_regressor", "f8", [joints, VERTICES], floats(&regressor)),
        ("f", "u4", [VERTICES - 2, 3], integers(&faces)),
        ("kintree_table", "u4", [2, joints], integers(&tree)),
    ] {
        text(&mut bytes, name);
        array(&mut bytes, dtype, shape, &data);
    }
    bytes.extend(b"u.");
    bytes
}

fn text(bytes: &mut Vec<u8>, text: &str) {
    bytes.push(b'X');
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(text.as_bytes());
}

/// Appends an array as numpy pickles one.
fn array(bytes: &mut Vec<u8>, dtype: &str, shape: [usize; 2], data: &[u8]) {
    bytes.extend(b"cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\0\x85C\x01b\x87R(K\x01");
    for size in shape {
        bytes.extend([b'K', size as u8]);
    }
    bytes.extend(b"\x86cnumpy\ndtype\n");
    text(bytes, dtype);
    bytes.extend(b"K\0K\x01\x87R(K\x03");
    text(bytes, "<");
    bytes.extend(b"NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\0tb\x89B");
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes.extend(b"tb");
}
