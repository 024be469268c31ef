//! Summary of the contacts of a packet, by which passes skip packets.

use crate::intersection::Contact;

/// Summary of the contacts of a packet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PacketSummary {
    /// Smallest height over the body in the packet, metres.
    pub(super) min_height_m: f32,
    /// True if the body or a collider pushes any vertex of the packet.
    pub(super) is_corrected: bool,
    /// True if any vertex of the packet moves, pushed or with its neighbours.
    pub(super) is_moving: bool,
}

impl PacketSummary {
    /// Summarises the contacts of a packet, and stores the height of each vertex after its
    /// correction, metres. A corrected vertex is at the margin or above it.
    pub(super) fn new(contacts: &[Contact], margin_m: f32, heights: &mut [f32]) -> Self {
        let mut summary = Self {
            min_height_m: f32::INFINITY,
            is_corrected: false,
            is_moving: false,
        };
        for (contact, height) in contacts.iter().zip(heights) {
            let is_corrected = contact.corrected.is_some();
            *height = if is_corrected { margin_m } else { contact.height_m };
            summary.is_corrected |= is_corrected;
            // A selection instead of `f32::min`, so that the loop compiles to vector instructions.
            summary.min_height_m = if *height < summary.min_height_m {
                *height
            } else {
                summary.min_height_m
            };
        }
        summary
    }
}
