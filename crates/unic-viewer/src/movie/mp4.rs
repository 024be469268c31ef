//! H.264 video in MP4 files.

use super::{MovieError, target::TargetFile, yuv::Planes};
use openh264::{
    OpenH264API, Timestamp,
    encoder::{
        Complexity, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, QpRange, RateControlMode,
        TransferCharacteristics, VuiConfig,
    },
};
use shiguredo_mp4::{
    TrackKind,
    bitstream::h264::{
        H264NalUnitType, H264SampleEntryConfig, LengthSize, build_avc1_box_from_annexb,
        parse_annexb_nal_units,
    },
    boxes::SampleEntry,
    mux::{Mp4FileMuxer, Mp4FileMuxerOptions, Sample},
};
use std::{
    io::{Seek, SeekFrom, Write},
    num::NonZeroU32,
    ops::RangeInclusive,
    path::{Path, PathBuf},
};
use unic_raster::Image;

/// Quantisation of the encoder, 0 to 51. At 18, luma has a signal-to-noise ratio of 50 dB.
const QUANTISATION: u8 = 18;

/// Lengths of the shorter side that the encoder takes, pixels.
const SHORTER_SIDE: RangeInclusive<u32> = 16..=2_160;

/// Longest side that the encoder takes, pixels.
const LONGEST_SIDE: u32 = 3_840;

/// Time between pictures that decode alone, to which a player can jump, in seconds.
const KEY_SECONDS: f32 = 2.0;

/// Ticks of the file's clock per picture, for rates with three decimals.
const PICTURE_TICKS: u32 = 1_000;

/// Bytes left free for the index at the begin of the file, enough for some 3,000 pictures. A longer
/// index goes to the end, and a web page plays the movie only when it is loaded.
const INDEX_BYTES: usize = 16_384;

/// Bytes of the lengths in front of the units of a picture.
const LENGTH: LengthSize = LengthSize::FourBytes;

/// Writer of an MP4 file.
pub(super) struct Mp4Writer {
    path: PathBuf,
    file: TargetFile,
    encoder: Encoder,
    muxer: Mp4FileMuxer,
    planes: Planes,
    /// Ticks of the file's clock per second.
    timescale: NonZeroU32,
    /// Number of pictures.
    pictures: u64,
    /// End of the file, bytes.
    end: u64,
}

impl Mp4Writer {
    pub(super) fn create(path: &Path, size: [u32; 2], fps: f32) -> Result<Self, MovieError> {
        check_size(path, size)?;
        let mut file = TargetFile::create(path)?;
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config(fps));
        let options = Mp4FileMuxerOptions {
            reserved_moov_box_size: INDEX_BYTES,
            ..Mp4FileMuxerOptions::default()
        };
        let muxer = Mp4FileMuxer::with_options(options).map_err(MovieError::mp4(path))?;
        let begin = muxer.initial_boxes_bytes();
        file.write_all(begin)
            .map_err(MovieError::io(path, "write the file"))?;
        let ticks = (f64::from(fps) * f64::from(PICTURE_TICKS)).round() as u32;
        Ok(Self {
            path: path.into(),
            file,
            encoder: encoder.map_err(MovieError::mp4(path))?,
            end: begin.len() as u64,
            muxer,
            planes: Planes::new(size),
            timescale: NonZeroU32::new(ticks).unwrap_or(NonZeroU32::MIN),
            pictures: 0,
        })
    }

    pub(super) fn temporary_path(&self) -> &Path {
        self.file.temporary_path()
    }

    pub(super) fn push(&mut self, image: &Image) -> Result<(), MovieError> {
        self.planes.fill(image);
        let milliseconds = self.pictures * 1_000 * u64::from(PICTURE_TICKS) / u64::from(self.timescale.get());
        let encoded = (self.encoder)
            .encode_at(&self.planes, Timestamp::from_millis(milliseconds))
            .map_err(MovieError::mp4(&self.path))?;
        let is_key = encoded.frame_type() == FrameType::IDR;
        let stream = encoded.to_vec();
        let data = self.units(&stream)?;
        let sample_entry = match self.pictures {
            0 => Some(self.sample_entry(&stream)?),
            _ => None,
        };
        self.file
            .write_all(&data)
            .map_err(MovieError::io(&self.path, "write the file"))?;
        let sample = Sample {
            track_kind: TrackKind::Video,
            sample_entry,
            keyframe: is_key,
            timescale: self.timescale,
            duration: PICTURE_TICKS,
            composition_time_offset: None,
            data_offset: self.end,
            data_size: data.len(),
        };
        self.muxer
            .append_sample(&sample)
            .map_err(MovieError::mp4(&self.path))?;
        self.end += data.len() as u64;
        self.pictures += 1;
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<(), MovieError> {
        let index = self.muxer.finalize().map_err(MovieError::mp4(&self.path))?;
        for (offset, bytes) in index.offset_and_bytes_pairs() {
            let begin = self.file.seek(SeekFrom::Start(offset));
            begin
                .and_then(|_| self.file.write_all(bytes))
                .map_err(MovieError::io(&self.path, "write the file"))?;
        }
        self.file.finish()
    }

    /// Units of a picture with their lengths, without the parameters of the stream, which an MP4
    /// has in its index.
    fn units(&self, stream: &[u8]) -> Result<Vec<u8>, MovieError> {
        let units = parse_annexb_nal_units(stream).map_err(MovieError::mp4(&self.path))?;
        let mut data = Vec::with_capacity(stream.len());
        let is_parameter = |kind| matches!(kind, H264NalUnitType::Sps | H264NalUnitType::Pps);
        for unit in units.iter().filter(|unit| !is_parameter(unit.nal_unit_type)) {
            data.extend((unit.data.len() as u32).to_be_bytes());
            data.extend(unit.data);
        }
        Ok(data)
    }

    /// Parameters of the stream, from its first picture.
    fn sample_entry(&self, stream: &[u8]) -> Result<SampleEntry, MovieError> {
        let config = H264SampleEntryConfig { length_size: LENGTH };
        let entry = build_avc1_box_from_annexb(stream, &config);
        Ok(SampleEntry::Avc1(entry.map_err(MovieError::mp4(&self.path))?))
    }
}

/// Checks the size of a movie. The encoder would refuse it at the first picture.
fn check_size(path: &Path, size: [u32; 2]) -> Result<(), MovieError> {
    let [shorter, longer] = [size[0].min(size[1]), size[0].max(size[1])];
    if SHORTER_SIDE.contains(&shorter) && longer <= LONGEST_SIDE {
        return Ok(());
    }
    Err(MovieError::mp4(path)(format!(
        "expected a shorter side of {} to {} pixels and a longer one of at most {LONGEST_SIDE}, \
         found {} x {}",
        SHORTER_SIDE.start(),
        SHORTER_SIDE.end(),
        size[0],
        size[1]
    )))
}

/// Settings of the encoder: the same quality for every picture, and the same bytes on every
/// computer.
fn config(fps: f32) -> EncoderConfig {
    EncoderConfig::new()
        .complexity(Complexity::High)
        // Of the modes that obey the range of quantisation, the one that neither warns nor skips.
        .rate_control_mode(RateControlMode::Bufferbased)
        .qp(QpRange::new(QUANTISATION, QUANTISATION))
        .max_frame_rate(FrameRate::from_hz(fps))
        .skip_frames(false)
        // Slices, and so the bytes, depend on the number of threads.
        .num_threads(1)
        .intra_frame_period(IntraFramePeriod::from_num_frames(
            (fps * KEY_SECONDS).ceil() as u32
        ))
        .vui(VuiConfig::bt709().transfer_characteristics(TransferCharacteristics::Srgb))
}
