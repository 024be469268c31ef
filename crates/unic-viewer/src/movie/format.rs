use super::MovieError;
use std::path::{self, Path};

/// Format of a movie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MovieFormat {
    /// A GIF that repeats for ever: for web pages, at most 50 pictures per second.
    Gif,
    /// H.264 video in an MP4 file, with the feature `mp4`. An odd width or height gets one more
    /// column or row, equal to the last. The larger side has at most 3840 pixels, the smaller 2160.
    Mp4,
    /// A folder of `frame_00000.png`, `frame_00001.png`, ...: without loss.
    Frames(EarlierFrames),
}

/// Treatment of frames that are in the folder of a movie already.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EarlierFrames {
    /// The movie is refused.
    #[default]
    Refuse,
    /// They are removed when the movie is complete. Other files stay.
    Replace,
}

impl MovieFormat {
    /// Format by the end of a path: `.gif`, `.mp4`, or a folder of frames that refuses earlier ones.
    ///
    /// A folder has no extension, or a slash at the end.
    ///
    /// # Errors
    /// - [`MovieError::Extension`] for another extension.
    /// - [`MovieError::WithoutMp4`] for an MP4 without the feature `mp4`.
    pub fn from_path(path: impl AsRef<Path>) -> Result<Self, MovieError> {
        let path = path.as_ref();
        let is_folder = path.to_string_lossy().ends_with(path::is_separator);
        let extension = path.extension().filter(|_| !is_folder);
        let Some(extension) = extension.map(|extension| extension.to_string_lossy().to_lowercase()) else {
            return Ok(Self::Frames(EarlierFrames::Refuse));
        };
        match extension.as_str() {
            "gif" => Ok(Self::Gif),
            "mp4" if cfg!(feature = "mp4") => Ok(Self::Mp4),
            "mp4" => Err(MovieError::WithoutMp4 { path: path.into() }),
            _ => Err(MovieError::Extension {
                path: path.into(),
                found: extension,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_the_path_is_the_format() {
        let format = |path: &str| MovieFormat::from_path(path);
        assert_eq!(format("a/dance.GIF").unwrap(), MovieFormat::Gif);
        for folder in ["dance", "a.b/dance", "dance.mp4/", "./"] {
            let expected = MovieFormat::Frames(EarlierFrames::Refuse);
            assert_eq!(format(folder).unwrap(), expected, "{folder}");
        }
        assert_eq!(
            format("dance.webm").unwrap_err().to_string(),
            "dance.webm: expected a movie (.gif, .mp4) or a folder of frames \
             (no extension, or a / at the end), found .webm"
        );
    }

    #[test]
    #[cfg(feature = "mp4")]
    fn mp4_is_known() {
        assert_eq!(MovieFormat::from_path("dance.mp4").unwrap(), MovieFormat::Mp4);
    }

    #[test]
    #[cfg(not(feature = "mp4"))]
    fn mp4_without_its_feature_names_the_alternative() {
        let error = MovieFormat::from_path("dance.mp4").unwrap_err();
        assert_eq!(
            error.to_string(),
            "dance.mp4: .mp4 needs a build with the feature `mp4`; write a folder of frames, and run \
             `ffmpeg -framerate FPS -i FOLDER/frame_%05d.png -pix_fmt yuv420p dance.mp4`"
        );
    }
}
