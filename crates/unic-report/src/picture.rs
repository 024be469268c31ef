use base64::{Engine, engine::general_purpose::STANDARD};
use maud::{Markup, html};

/// An encoded picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Encoding of the bytes.
    pub format: PictureFormat,
    /// Contents of the picture file.
    pub bytes: Vec<u8>,
    /// Width, pixels. Browsers reserve the place of a picture before they decode it.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
}

/// Encoding of a picture that every browser reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// Small files with losses, for moving pictures.
    Jpeg,
    /// Exact files, for drawings and flat colours.
    Png,
}

impl PictureFormat {
    fn media_type(self) -> &'static str {
        match self {
            Self::Jpeg => "image/jpeg",
            Self::Png => "image/png",
        }
    }
}

impl Picture {
    /// `img` element with the picture as a data URI; `alt` describes the picture.
    pub(crate) fn img(&self, alt: &str) -> Markup {
        html! { img src=(self.data_uri()) width=(self.width) height=(self.height) alt=(alt); }
    }

    pub(crate) fn data_uri(&self) -> String {
        let mut uri = format!("data:{};base64,", self.format.media_type());
        STANDARD.encode_string(&self.bytes, &mut uri);
        uri
    }

    /// Number of bytes of the picture in base64.
    pub(crate) fn encoded_len(&self) -> usize {
        // Base64 writes every three bytes, or a rest of them, as four characters.
        self.bytes.len().div_ceil(3).saturating_mul(4)
    }
}
