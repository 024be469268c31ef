//! What is known of the packets of a garment.

use crate::intersection::Contact;

/// What the contacts of a packet say together.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Summary {
    /// The least height over the body in it, metres.
    pub(super) least_m: f32,
    /// Does the body, or a prop, push anything in it?
    pub(super) is_corrected: bool,
    /// Does anything in it move, also with others?
    pub(super) is_moving: bool,
}

impl Summary {
    /// Of contacts by a rule that moves to the margin; fills in their heights once they have moved, metres.
    pub(super) fn new(contacts: &[Contact], margin_m: f32, heights: &mut [f32]) -> Self {
        let mut summary = Self {
            least_m: f32::INFINITY,
            is_corrected: false,
            is_moving: false,
        };
        for (contact, height) in contacts.iter().zip(heights) {
            let is_corrected = contact.moved.is_some();
            *height = if is_corrected { margin_m } else { contact.height_m };
            summary.is_corrected |= is_corrected;
            summary.least_m = if *height < summary.least_m {
                *height
            } else {
                summary.least_m
            };
        }
        summary
    }
}
