//! Bytes of protobuf messages: the few kinds of fields that an ONNX file has.
//!
//! A message is a sequence of fields. A field is a key, which holds its number and its kind, and a
//! value. Readers accept fields in any order; the order here is that of their numbers.

/// Kind of a field's value, the lowest three bits of its key.
#[derive(Clone, Copy)]
enum WireType {
    /// Integer of variable length.
    Varint = 0,
    /// Length and that many bytes: text, numbers without gaps, or another message.
    Bytes = 2,
}

/// Protobuf message that grows field by field.
#[derive(Clone, Debug, Default)]
pub(crate) struct Message(Vec<u8>);

impl Message {
    /// Appends an integer. Negative ones take ten bytes.
    pub(crate) fn int(&mut self, field: u32, value: i64) {
        self.key(field, WireType::Varint);
        // Two's complement, as protobuf's `int64` is.
        push_varint(&mut self.0, value as u64);
    }

    /// Appends a text.
    pub(crate) fn text(&mut self, field: u32, text: &str) {
        self.bytes(field, text.as_bytes());
    }

    /// Appends bytes with their length.
    pub(crate) fn bytes(&mut self, field: u32, bytes: &[u8]) {
        self.key(field, WireType::Bytes);
        push_varint(&mut self.0, bytes.len() as u64);
        self.0.extend_from_slice(bytes);
    }

    /// Appends another message.
    pub(crate) fn message(&mut self, field: u32, message: &Message) {
        self.bytes(field, &message.0);
    }

    /// Returns the bytes of the whole message.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    fn key(&mut self, field: u32, kind: WireType) {
        push_varint(&mut self.0, u64::from(field) << 3 | kind as u64);
    }
}

/// Appends an integer in groups of seven bits, the lowest first. All bytes but the last have their
/// highest bit set.
fn push_varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn varint(value: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        push_varint(&mut bytes, value);
        bytes
    }

    #[test]
    fn varints_have_seven_bits_a_byte() {
        assert_eq!(varint(0), [0]);
        assert_eq!(varint(127), [0x7f]);
        assert_eq!(varint(128), [0x80, 0x01]);
        // The example of protobuf's own documentation.
        assert_eq!(varint(150), [0x96, 0x01]);
        assert_eq!(varint(1 << 35), [0x80, 0x80, 0x80, 0x80, 0x80, 0x01]);
        let longest = varint(u64::MAX);
        assert_eq!((longest.len(), longest[9]), (10, 0x01));
    }

    #[test]
    fn fields_are_keys_and_values() {
        let mut inner = Message::default();
        inner.int(1, 150);
        assert_eq!(inner.clone().into_bytes(), [0x08, 0x96, 0x01]);
        let mut outer = Message::default();
        outer.message(3, &inner);
        outer.text(2, "testing");
        outer.int(16, -1);
        let mut expected = vec![0x1a, 3, 0x08, 0x96, 0x01];
        expected.extend([0x12, 7]);
        expected.extend(b"testing");
        // Numbers of fields from 16 on take two bytes.
        expected.extend([0x80, 0x01]);
        expected.extend([0xff; 9]);
        expected.push(0x01);
        assert_eq!(outer.into_bytes(), expected);
    }

    #[test]
    fn the_length_of_bytes_is_a_varint() {
        let mut message = Message::default();
        message.bytes(9, &[7; 300]);
        let bytes = message.into_bytes();
        assert_eq!(bytes[..3], [0x4a, 0xac, 0x02]);
        assert_eq!(bytes[3..], [7; 300]);
    }
}
