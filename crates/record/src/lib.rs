//! Laboratory records: reader of tables and universal files, records of horn tip, vibrometer and hydrophone, published
//! features.
//!
//! ```text
//! file ─ text ─ dialect ─ columns ─ even grid ─ sign, baseline ─ [integration] ─ t = 0 at the trigger, less the vibrometer's delay ─ Record
//! ```
//!
//! Everything that was assumed on the way is written down in [`Record::assumptions`]; everything that looks wrong but can be
//! read in [`Record::warnings`]. What cannot be read is refused with the line and the column
//! ([`MeasurementError`]).

mod baseline;
mod binary;
mod choice;
mod clock;
mod column;
mod continuation;
mod decimal;
mod dialect;
mod encoding;
mod error;
mod estimate;
mod header;
mod horn_drive;
mod line;
mod mask;
mod names;
mod noise;
mod notes;
mod onset;
mod options;
mod place;
mod preamble;
mod quantisation;
mod read;
mod reading;
mod record;
mod remedy;
mod response;
pub mod run_log;
mod samples;
mod sampling;
mod scale;
mod sensor;
mod separated;
mod shell;
mod table;
mod time_column;
mod toml_error;
mod universal;

pub use choice::Choice;
pub use decimal::DecimalSign;
pub use dialect::Delimiter;
pub use error::MeasurementError;
pub use estimate::Remainder;
pub use granchain_signal::{hexadecimal, read_back, sha256};
pub use header::drive_frequency_line;
pub use horn_drive::{Beginning, Ending, HornDrive};
pub use mask::{MaskError, MaskReason, Masked, Masking};
pub use noise::NoiseSource;
pub use options::{Baseline, Missing, ReadOptions, RecordKind};
pub use place::{Place, line_of};
pub use read::{horn_column, horn_column_of, inspect_record, read_head, read_record, read_record_bytes};
pub use reading::{BenchReadings, BenchReadingsError, Reading, ReadingError};
pub use record::{Record, RecordedQuantity};
pub use sampling::SAMPLING_TOLERANCE;
pub use scale::{Sensitivity, SensitivityError};
pub use sensor::{SensorRecord, read_sensor, read_sensor_bytes};
pub use shell::{shell_line, shell_word};
pub use toml_error::{key_at, plain_message};
pub use universal::{ByteOrder, Precision, Samples, TimeResponse, UniversalError, UniversalForm};
