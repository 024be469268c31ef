//! Values of any precision as the types of this crate.

use glam::{DMat4, DQuat, DVec3, Vec3};
use openusd::sdf::Value;

/// Converts a number of any type: text files do not state that of metadata.
pub(super) fn number(value: Value) -> Option<f64> {
    Some(match value {
        Value::Double(x) => x,
        Value::Float(x) => x.into(),
        Value::Half(x) => x.into(),
        Value::Int(x) => x.into(),
        Value::Uint(x) => x.into(),
        Value::Int64(x) => x as f64,
        Value::Uint64(x) => x as f64,
        _ => return None,
    })
}

pub(super) fn token(value: Value) -> Option<String> {
    match value {
        Value::Token(token) => Some(token.as_str().to_owned()),
        Value::String(text) => Some(text),
        _ => None,
    }
}

pub(super) fn tokens(value: Value) -> Option<Vec<String>> {
    match value {
        Value::TokenVec(tokens) => Some(tokens.iter().map(|token| token.as_str().to_owned()).collect()),
        Value::StringVec(texts) => Some(texts),
        _ => None,
    }
}

pub(super) fn integers(value: Value) -> Option<Vec<i32>> {
    match value {
        Value::IntVec(numbers) => Some(numbers),
        // An empty list has no type of its own in text files.
        Value::ValueVec(list) if list.is_empty() => Some(Vec::new()),
        _ => None,
    }
}

pub(super) fn floats(value: Value) -> Option<Vec<f32>> {
    match value {
        Value::FloatVec(numbers) => Some(numbers),
        Value::DoubleVec(numbers) => Some(numbers.into_iter().map(|x| x as f32).collect()),
        Value::HalfVec(numbers) => Some(numbers.into_iter().map(f32::from).collect()),
        _ => None,
    }
}

pub(super) fn vector(value: Value) -> Option<DVec3> {
    Some(match value {
        Value::Vec3d(v) => DVec3::from_array(v.into()),
        Value::Vec3f(v) => Vec3::from_array(v.into()).as_dvec3(),
        Value::Vec3h(v) => DVec3::new(v.x.into(), v.y.into(), v.z.into()),
        _ => return None,
    })
}

pub(super) fn vectors(value: Value) -> Option<Vec<Vec3>> {
    Some(match value {
        Value::Vec3fVec(list) => list.into_iter().map(|v| Vec3::from_array(v.into())).collect(),
        Value::Vec3dVec(list) => (list.into_iter())
            .map(|v| DVec3::from_array(v.into()).as_vec3())
            .collect(),
        Value::Vec3hVec(list) => (list.into_iter())
            .map(|v| Vec3::new(v.x.into(), v.y.into(), v.z.into()))
            .collect(),
        _ => return None,
    })
}

/// Converts w, x, y, z. A quaternion of length zero is no rotation.
fn quaternion(w: f64, x: f64, y: f64, z: f64) -> DQuat {
    let rotation = DQuat::from_xyzw(x, y, z, w);
    match rotation.length_squared() > f64::from(f32::MIN_POSITIVE) {
        true => rotation.normalize(),
        false => DQuat::IDENTITY,
    }
}

pub(super) fn rotation(value: Value) -> Option<DQuat> {
    Some(match value {
        Value::Quatf(q) => quaternion(q.w.into(), q.x.into(), q.y.into(), q.z.into()),
        Value::Quatd(q) => quaternion(q.w, q.x, q.y, q.z),
        Value::Quath(q) => quaternion(q.w.into(), q.x.into(), q.y.into(), q.z.into()),
        _ => return None,
    })
}

pub(super) fn rotations(value: Value) -> Option<Vec<DQuat>> {
    let of = |list: Vec<Value>| list.into_iter().map(rotation).collect();
    match value {
        Value::QuatfVec(list) => of(list.into_iter().map(Value::Quatf).collect()),
        Value::QuatdVec(list) => of(list.into_iter().map(Value::Quatd).collect()),
        Value::QuathVec(list) => of(list.into_iter().map(Value::Quath).collect()),
        _ => None,
    }
}

/// Converts a matrix. The format multiplies rows by matrices; its rows are columns here.
pub(super) fn matrix(value: Value) -> Option<DMat4> {
    match value {
        Value::Matrix4d(m) => Some(DMat4::from_cols_array(&m.0)),
        _ => None,
    }
}

pub(super) fn matrices(value: Value) -> Option<Vec<DMat4>> {
    match value {
        Value::Matrix4dVec(list) => Some(list.iter().map(|m| DMat4::from_cols_array(&m.0)).collect()),
        _ => None,
    }
}
