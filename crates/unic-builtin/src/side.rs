//! Left and right of a character.

/// The character's left or right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// The character's left: +X in the bind pose.
    Left,
    /// The character's right: −X in the bind pose.
    Right,
}

impl Side {
    /// Both sides, left first.
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    /// Sign of x on this side: +1 for left, −1 for right.
    pub fn sign(self) -> f32 {
        match self {
            Side::Left => 1.0,
            Side::Right => -1.0,
        }
    }

    /// Returns the opposite side.
    pub fn other(self) -> Self {
        match self {
            Side::Left => Side::Right,
            Side::Right => Side::Left,
        }
    }

    /// Index into arrays of both sides, and offset of a joint from its left twin in SMPL's order.
    pub(crate) fn index(self) -> usize {
        self as usize
    }
}
