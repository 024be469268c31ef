//! A procedural human, garments and motion.

pub mod garments;
pub mod human;
pub mod motion;
