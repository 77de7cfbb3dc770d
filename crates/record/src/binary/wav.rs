//! WAV: samples as parts of full scale.

use std::path::Path;

use hound::{SampleFormat, WavReader};

use super::{super::ReadOptions, Channel, Contents};

/// Values are parts of full scale: state what full scale means with `--scale` or `--unit`.
pub(super) fn read(_: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let refused = |error: hound::Error| {
        format!("WAV file: expected samples, found: {error}; export it again as PCM or 32-bit float")
    };
    let mut reader = WavReader::new(bytes).map_err(refused)?;
    let spec = reader.spec();
    let width = usize::from(spec.channels.max(1));
    let mut channels: Vec<Channel> = (1..=width)
        .map(|number| Channel {
            name: format!("channel {number}"),
            grid: Some((0.0, 1.0 / f64::from(spec.sample_rate.max(1)))),
            ..Channel::default()
        })
        .collect();
    let full = f64::from(1u32 << (spec.bits_per_sample.clamp(1, 32) - 1));
    let samples: Box<dyn Iterator<Item = Result<f64, hound::Error>>> = match spec.sample_format {
        SampleFormat::Float => Box::new(reader.samples::<f32>().map(|sample| sample.map(f64::from))),
        SampleFormat::Int => Box::new(reader.samples::<i32>().map(move |sample| sample.map(|it| f64::from(it) / full))),
    };
    for (index, sample) in samples.enumerate() {
        channels[index % width].values.push(sample.map_err(refused)?);
    }
    Ok(Contents {
        written: format!("WAV, {} bits", spec.bits_per_sample),
        channels,
        comments: Vec::new(),
        assumptions: vec!["values are parts of full scale, as a WAV file states no unit".into()],
    })
}
