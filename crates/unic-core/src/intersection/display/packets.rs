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
    /// Of contacts by a rule that moves to the margin.
    pub(super) fn new(contacts: &[Contact], margin_m: f32) -> Self {
        let heights = contacts.iter().map(|contact| height(contact, margin_m));
        Self {
            least_m: heights.fold(f32::INFINITY, |a, b| if b < a { b } else { a }),
            is_corrected: contacts.iter().any(|contact| contact.moved.is_some()),
            is_moving: false,
        }
    }
}

/// Height over the body once a contact has moved, metres.
pub(super) fn height(contact: &Contact, margin_m: f32) -> f32 {
    match contact {
        Contact { moved: Some(_), .. } => margin_m,
        contact => contact.height_m,
    }
}
