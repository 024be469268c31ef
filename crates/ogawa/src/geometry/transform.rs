//! Transforms of objects.

use super::{TRANSFORM, XFORM};
use crate::{
    archive::{Archive, ObjectId, Samples},
    error::{Error, Result},
};
use std::io::{Read, Seek};

/// Affine transform: rows of a matrix that multiplies column vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform(pub [[f64; 4]; 4]);

impl Transform {
    /// Transform that changes nothing.
    pub const IDENTITY: Self = Self([
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);

    /// Transform of a point.
    pub fn point(&self, point: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = point.map(f64::from);
        let [a, b, c, _] = self.0;
        [a, b, c].map(|[i, j, k, offset]| (i * x + j * y + k * z + offset) as f32)
    }

    /// Transform that applies `first` and then `self`.
    pub fn after(&self, first: &Self) -> Self {
        let product = |row: [f64; 4], column: usize| (0..4).map(|k| row[k] * first.0[k][column]).sum();
        Self(
            self.0
                .map(|row| std::array::from_fn(|column| product(row, column))),
        )
    }

    fn translation([x, y, z]: [f64; 3]) -> Self {
        let mut matrix = Self::IDENTITY.0;
        (matrix[0][3], matrix[1][3], matrix[2][3]) = (x, y, z);
        Self(matrix)
    }

    fn scale([x, y, z]: [f64; 3]) -> Self {
        let mut matrix = Self::IDENTITY.0;
        (matrix[0][0], matrix[1][1], matrix[2][2]) = (x, y, z);
        Self(matrix)
    }

    /// Rotation about an axis of any length; none about an axis of length 0.
    fn rotation(axis: [f64; 3], degrees: f64) -> Self {
        let length = axis.iter().map(|v| v * v).sum::<f64>().sqrt();
        if length == 0.0 {
            return Self::IDENTITY;
        }
        let [x, y, z] = axis.map(|v| v / length);
        let (sin, cos) = degrees.to_radians().sin_cos();
        let rest = 1.0 - cos;
        Self([
            [
                x * x * rest + cos,
                x * y * rest - z * sin,
                x * z * rest + y * sin,
                0.0,
            ],
            [
                x * y * rest + z * sin,
                y * y * rest + cos,
                y * z * rest - x * sin,
                0.0,
            ],
            [
                x * z * rest - y * sin,
                y * z * rest + x * sin,
                z * z * rest + cos,
                0.0,
            ],
            [0.0, 0.0, 0.0, 1.0],
        ])
    }
}

/// Step of a transform; its number is in the upper four bits of a byte of `.ops`.
#[derive(Clone, Copy)]
enum Operation {
    Scale,
    Translate,
    Rotate,
    Matrix,
    RotateX,
    RotateY,
    RotateZ,
}

impl Operation {
    fn decode(code: u8) -> Option<Self> {
        Some(match code >> 4 {
            0 => Self::Scale,
            1 => Self::Translate,
            2 => Self::Rotate,
            3 => Self::Matrix,
            4 => Self::RotateX,
            5 => Self::RotateY,
            6 => Self::RotateZ,
            _ => return None,
        })
    }

    /// Transform of the first values, and the values behind them. None if there are too few.
    fn apply(self, values: &[f64]) -> Option<(Transform, &[f64])> {
        Some(match self {
            Self::Scale => {
                let (scale, rest) = values.split_first_chunk::<3>()?;
                (Transform::scale(*scale), rest)
            }
            Self::Translate => {
                let (offset, rest) = values.split_first_chunk::<3>()?;
                (Transform::translation(*offset), rest)
            }
            Self::Rotate => {
                let ([x, y, z, degrees], rest) = values.split_first_chunk::<4>()?;
                (Transform::rotation([*x, *y, *z], *degrees), rest)
            }
            Self::Matrix => {
                let (matrix, rest) = values.split_first_chunk::<16>()?;
                // Files multiply row vectors.
                let transposed = |row, column| matrix[4 * column + row];
                let rows = std::array::from_fn(|row| std::array::from_fn(|column| transposed(row, column)));
                (Transform(rows), rest)
            }
            Self::RotateX => turn([1.0, 0.0, 0.0], values)?,
            Self::RotateY => turn([0.0, 1.0, 0.0], values)?,
            Self::RotateZ => turn([0.0, 0.0, 1.0], values)?,
        })
    }
}

fn turn(axis: [f64; 3], values: &[f64]) -> Option<(Transform, &[f64])> {
    let (degrees, rest) = values.split_first()?;
    Some((Transform::rotation(axis, *degrees), rest))
}

/// Transform of one object, and whether those of its ancestors apply as well.
struct Local {
    parent_from_object: Transform,
    inherits: bool,
}

impl<R: Read + Seek> Archive<R> {
    /// Transform from an object to the world at a time in seconds: that of the object if it has one,
    /// and those of its ancestors. The sample nearest to the time counts.
    ///
    /// # Errors
    /// A damaged transform, or a failure to read.
    pub fn world_from_object(&mut self, object: ObjectId, time: f64) -> Result<Transform> {
        let mut world = Transform::IDENTITY;
        let chain: Vec<ObjectId> = self.ancestry(object).collect();
        for id in chain {
            let Some(local) = self.local(id, time)? else {
                continue;
            };
            world = local.parent_from_object.after(&world);
            if !local.inherits {
                break;
            }
        }
        Ok(world)
    }

    /// Transform of one object; none for an object of another schema.
    fn local(&mut self, id: ObjectId, time: f64) -> Result<Option<Local>> {
        if self.object(id).schema() != XFORM {
            return Ok(None);
        }
        let property = |name: &str| -> Option<Samples> {
            let transform = self.object(id).property(TRANSFORM)?;
            crate::archive::find(transform.properties(), name)?
                .samples()
                .copied()
        };
        let [inherits, ops, vals] = [".inherits", ".ops", ".vals"].map(property);
        let mut flags: Vec<bool> = Vec::new();
        if let Some(samples) = inherits.filter(|samples| samples.count() > 0) {
            let index = self.nearest(&samples, time);
            self.read(&samples, index, &mut flags)?;
        }
        let parent_from_object = match (ops, vals) {
            (Some(ops), Some(vals)) if ops.count() > 0 && vals.count() > 0 => {
                self.compose(id, &ops, &vals, time)?
            }
            _ => Transform::IDENTITY,
        };
        Ok(Some(Local {
            parent_from_object,
            inherits: flags.first().is_none_or(|&flag| flag),
        }))
    }

    fn compose(&mut self, id: ObjectId, ops: &Samples, vals: &Samples, time: f64) -> Result<Transform> {
        let (mut codes, mut values): (Vec<u8>, Vec<f64>) = (Vec::new(), Vec::new());
        let index = self.nearest(ops, time);
        self.read(ops, index, &mut codes)?;
        let index = self.nearest(vals, time);
        self.read(vals, index, &mut values)?;
        let mut transform = Transform::IDENTITY;
        let mut rest = values.as_slice();
        for &code in &codes {
            let step = Operation::decode(code).and_then(|operation| operation.apply(rest));
            let Some((step, behind)) = step else {
                let found = format!("{} for the operations {codes:?}", values.len());
                let expected = "values for each operation from 0 to 6";
                return Err(Error::content(&self.full_name(id), expected, found));
            };
            // The first operation is the last one to move a point.
            transform = transform.after(&step);
            rest = behind;
        }
        Ok(transform)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: [f32; 3], b: [f32; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6)
    }

    #[test]
    fn operations_move_points_as_their_names_say() {
        let moved = |code: u8, values: &[f64]| {
            let operation = Operation::decode(code << 4).unwrap();
            operation.apply(values).unwrap().0.point([1.0, 2.0, 3.0])
        };
        assert!(close(moved(0, &[2.0, 3.0, 4.0]), [2.0, 6.0, 12.0]));
        assert!(close(moved(1, &[2.0, 3.0, 4.0]), [3.0, 5.0, 7.0]));
        assert!(close(moved(2, &[0.0, 0.0, 5.0, 90.0]), [-2.0, 1.0, 3.0]));
        assert!(close(moved(2, &[0.0, 0.0, 0.0, 90.0]), [1.0, 2.0, 3.0]));
        assert!(close(moved(4, &[90.0]), [1.0, -3.0, 2.0]));
        assert!(close(moved(5, &[90.0]), [3.0, 2.0, -1.0]));
        assert!(close(moved(6, &[90.0]), [-2.0, 1.0, 3.0]));
        let mut matrix = [0.0; 16];
        // A row vector times this matrix: x to y, y to z, z to x, and an offset in the last row.
        (matrix[1], matrix[6], matrix[8]) = (1.0, 1.0, 1.0);
        matrix[12..].copy_from_slice(&[10.0, 20.0, 30.0, 1.0]);
        assert!(close(moved(3, &matrix), [13.0, 21.0, 32.0]));
        assert!(Operation::decode(0x70).is_none());
        assert!(Operation::Scale.apply(&[1.0, 2.0]).is_none());
    }

    #[test]
    fn the_later_transform_moves_the_result_of_the_first() {
        let scaled = Transform::scale([2.0; 3]);
        let moved = Transform::translation([1.0, 0.0, 0.0]);
        assert_eq!(moved.after(&scaled).point([1.0, 1.0, 1.0]), [3.0, 2.0, 2.0]);
    }
}
