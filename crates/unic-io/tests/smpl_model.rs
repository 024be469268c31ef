//! Contract: a body model of SMPL is read as a character from an npz and from pickles of Python 2 and 3,
//! with arrays of numpy, of chumpy and of scipy, in C and in Fortran's order. The files are written by
//! numpy and Python; chumpy and scipy are stood in for by classes of their names and states.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use glam::Vec3;
use std::{fs, path::Path, process::Command};
use unic_core::skeleton::SMPL_PARENTS;
use unic_io::{import_character, inspect, read_character};

/// Writes models of 30 vertices, and their joints.
const PYTHON: &str = r#"
import pickle, sys, types, numpy as np
folder = sys.argv[1]

def kind(module, name):
    parts = module.split('.')
    for i in range(len(parts)):
        sys.modules.setdefault('.'.join(parts[:i + 1]), types.ModuleType('.'.join(parts[:i + 1])))
    made = type(name, (object,), {'__module__': module})
    setattr(sys.modules[module], name, made)
    return made

def filled(made, **state):
    thing = made.__new__(made)
    thing.__dict__.update(state)
    return thing

def sparse(matrix, by_rows):
    lines = matrix if by_rows else matrix.T
    entries = [np.flatnonzero(line) for line in lines]
    return filled(kind('scipy.sparse.csc', 'csc_matrix') if not by_rows else kind('scipy.sparse.csr', 'csr_matrix'),
        data=np.concatenate([line[at] for line, at in zip(lines, entries)]),
        indices=np.concatenate(entries).astype('i4'),
        indptr=np.cumsum([0] + [len(at) for at in entries]).astype('i4'), _shape=matrix.shape, maxprint=50)

random = np.random.default_rng(1)
count = 30
template = random.normal(size=(count, 3))
regressor = random.random((24, count)) * (random.random((24, count)) < 0.3)
weights = np.zeros((count, 24)); weights[np.arange(count), np.arange(count) % 24] = 1
parents = np.array(eval(sys.argv[2]))
tree = np.stack([np.where(parents < 0, 2**32 - 1, parents), np.arange(24)])
faces = np.stack([np.arange(count - 2), np.arange(count - 2) + 1, np.arange(count - 2) + 2], 1)
data = {'v_template': template, 'f': faces.astype('u4'), 'weights': weights, 'J_regressor': regressor,
    'kintree_table': tree, 'posedirs': np.zeros((count, 3, 207)), 'bs_type': 'lrotmin'}
np.save(f'{folder}/joints.npy', (regressor @ template).astype('f4'))
np.save(f'{folder}/template.npy', template.astype('f4'))
np.savez(f'{folder}/model.npz', **{**data, 'kintree_table': tree.astype('i8')})
Ch = kind('chumpy.ch', 'Ch')
for protocol in [2, 3, 4, 5]:
    for name, change in [
        ('plain', {}),
        ('chumpy', {'v_template': filled(Ch, x=template, _dirty_vars=set()), 'weights': filled(Ch, x=weights)}),
        ('columns', {'J_regressor': sparse(regressor, False)}),
        ('rows', {'J_regressor': sparse(regressor, True)}),
        ('fortran', {'v_template': np.asfortranarray(template), 'weights': np.asfortranarray(weights)}),
    ]:
        with open(f'{folder}/{name}{protocol}.pkl', 'wb') as file:
            pickle.dump({**data, **change}, file, protocol=protocol)
for name, change in [('joints', {'weights': np.ones((count, 52)) / 52}), ('shape', {'v_template': template.T}), ('none', None)]:
    with open(f'{folder}/bad_{name}.pkl', 'wb') as file:
        pickle.dump({**data, **change} if change else {'poses': weights}, file, protocol=2)
"#;

/// Positions (N, 3) that numpy has written, as little-endian f32 behind a header of 128 bytes.
fn positions(path: &Path) -> Vec<Vec3> {
    let bytes = fs::read(path).unwrap();
    let floats = bytes[128..]
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()));
    let floats: Vec<f32> = floats.collect();
    floats.chunks_exact(3).map(Vec3::from_slice).collect()
}

#[test]
fn models_are_characters_in_every_form() {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let has = Command::new(&python).args(["-c", "import numpy"]).output();
    if !has.is_ok_and(|o| o.status.success()) {
        eprintln!("skipped: {python} has no package numpy");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let status = Command::new(&python)
        .args(["-c", PYTHON])
        .arg(folder)
        .arg(format!("{SMPL_PARENTS:?}"))
        .status();
    assert!(status.unwrap().success());
    let [joints, template] = ["joints.npy", "template.npy"].map(|name| positions(&folder.join(name)));
    let mut files = vec![folder.join("model.npz")];
    for protocol in 2..=5 {
        let names = ["plain", "chumpy", "columns", "rows", "fortran"];
        files.extend(names.map(|name| folder.join(format!("{name}{protocol}.pkl"))));
    }
    for path in &files {
        let import = import_character(path, &Default::default()).unwrap();
        assert!(import.notes[0].contains("correctives"), "{:?}", import.notes);
        let character = import.character;
        assert_eq!(character.body.vertices, template, "{}", path.display());
        let far = (character.skeleton.joints().iter().zip(&joints)).map(|(a, b)| a.distance(*b));
        assert!(far.fold(0.0, f32::max) < 1e-5, "{}", path.display());
        assert_eq!(character.skeleton.to_parts().parents, SMPL_PARENTS);
        assert_eq!(character.body.faces[27], [27, 28, 29]);
        assert!(inspect(path).unwrap().facts.len() > 3);
    }
    for (name, words) in [
        ("bad_joints.pkl", "with weights of shape [30, 24], found [30, 52]"),
        ("bad_shape.pkl", "with v_template of shape [3, 3], found [3, 30]"),
        ("bad_none.pkl", "found no array v_template"),
    ] {
        let error = read_character(&folder.join(name)).unwrap_err().to_string();
        assert!(error.ends_with(words), "{error}");
    }
}

/// Truncated and changed pickles are refused or read, but never crash.
#[test]
fn damaged_pickles_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.pkl");
    for bytes in [
        &b""[..],
        b"\x80\x02}.",
        b"\x80\x02}q\x00(U\x0av_templateK\x01u.",
        b"\x80\x04\x95",
    ] {
        fs::write(&path, bytes).unwrap();
        let error = read_character(&path).unwrap_err().to_string();
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
