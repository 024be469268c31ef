use base64::{Engine, engine::general_purpose::STANDARD};
use maud::{Markup, html};

/// An encoded picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// How the bytes are encoded.
    pub format: PictureFormat,
    /// A whole file.
    pub bytes: Vec<u8>,
    /// Pixels, so that the page keeps the place free.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

/// An encoding that every browser reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// Small, with losses: moving pictures.
    Jpeg,
    /// Exact: drawings and flat colours.
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
    /// An `img` that holds the picture itself, with what it shows in words.
    pub(crate) fn img(&self, alt: &str) -> Markup {
        html! { img src=(self.data_uri()) width=(self.width) height=(self.height) alt=(alt); }
    }

    pub(crate) fn data_uri(&self) -> String {
        let mut uri = format!("data:{};base64,", self.format.media_type());
        STANDARD.encode_string(&self.bytes, &mut uri);
        uri
    }

    /// Bytes of the data URI, nearly: what a page grows by.
    pub(crate) fn encoded_len(&self) -> usize {
        self.bytes.len().div_ceil(3).saturating_mul(4)
    }
}
