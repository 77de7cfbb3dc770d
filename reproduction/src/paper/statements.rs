//! Every statement of the source paper that a simulation can be compared with.
//!
//! The one place where they are written in code. The paper prints no line amplitudes and no length of the burst. The words are ours.

use crate::published::{KUWABARA_KONO, LINEAR, MEASURED};
use granchain_signal::feature::Ratio;
use serde::Serialize;

/// The amplitude scales that the paper ran: first, last, step.
pub const SWEPT_ALPHAS: (f64, f64, f64) = (0.3, 1.5, 0.05);

/// Half of the last printed digit of a peak velocity, m/s.
pub const PEAK_HALF_DIGIT: f64 = 0.0005;

/// What a statement is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subject {
    /// The vibrometer measurement on the annulus.
    Measurement,
    /// The paper's finite elements, linear dashpots of 0.3 N·s/m, α = 0.5.
    Linear,
    /// The paper's finite elements, Kuwabara–Kono dashpots of 3.66e3 N·s·m^(-3/2), α = 1.5.
    KuwabaraKono,
    /// The paper's finite elements before the rigid wall.
    Rigid,
    /// The paper's finite elements before disc and water.
    Water,
    /// Companion paper, known by its abstract.
    Companion,
}

/// Content of a statement, in a testable form.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Claim {
    PositivePeak(f64),
    NegativePeak(f64),
    /// These lines are present in the spectrum.
    Present(&'static [Ratio]),
    Absent(&'static [Ratio]),
    /// The velocity is a train of impulses.
    Impulses,
    /// Content up to this frequency, Hz; at what level is not printed.
    ContentUpTo(f64),
    /// Over all swept α this line's ratio to the drive line is largest at this α.
    RatioLargestAt(Ratio, f64),
    /// Over all swept α the positive peak is closest to the measured one at this α.
    PeakClosestAt(f64),
    /// The negative peak is a smaller share of the positive one than in the measurement.
    LessSymmetricThanMeasured,
    /// Both peaks are closer to the measured ones than those of the other damping law.
    CloserThanOtherLaw,
    /// Not testable: a statement without a number, or outside this study, with the reason.
    NotTested(&'static str),
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Statement {
    pub key: &'static str,
    pub subject: Subject,
    pub place: &'static str,
    /// The statement, in our words.
    pub said: &'static str,
    pub claim: Claim,
}

const DRIVE: &[Ratio] = &[Ratio::ONE];
const THIRDS: &[Ratio] = &[Ratio::new(1, 3), Ratio::new(2, 3)];
const THIRD_ULTRAHARMONICS: &[Ratio] = &[Ratio::new(4, 3), Ratio::new(5, 3)];
const HALF: &[Ratio] = &[Ratio::new(1, 2)];

const fn statement(
    key: &'static str,
    subject: Subject,
    place: &'static str,
    said: &'static str,
    claim: Claim,
) -> Statement {
    Statement { key, subject, place, said, claim }
}

/// Every number and every spectral statement that the paper prints of its scenes, in the order of the report.
pub const STATEMENTS: &[Statement] = &[
    statement(
        "linear.positive-peak",
        Subject::Linear,
        "Sec. IV.B",
        "positive peak +296 mm/s",
        Claim::PositivePeak(LINEAR.positive_m_per_s),
    ),
    statement(
        "linear.negative-peak",
        Subject::Linear,
        "Sec. IV.B",
        "negative peak −207 mm/s",
        Claim::NegativePeak(LINEAR.negative_m_per_s),
    ),
    statement("linear.impulses", Subject::Linear, "Sec. IV.B", "a train of impulses", Claim::Impulses),
    statement("linear.drive-line", Subject::Linear, "Sec. IV.B", "content at 73 kHz", Claim::Present(DRIVE)),
    statement("linear.thirds", Subject::Linear, "Sec. IV.B", "lines at 1/3 and 2/3", Claim::Present(THIRDS)),
    statement(
        "linear.ultraharmonics",
        Subject::Linear,
        "Sec. IV.B",
        "ultraharmonics of the thirds",
        Claim::Present(THIRD_ULTRAHARMONICS),
    ),
    statement(
        "linear.best-alpha",
        Subject::Linear,
        "Sec. IV.B",
        "of α = 0.3 … 1.5 the ratio A(f0/3)/A(f0) is largest at 0.5",
        Claim::RatioLargestAt(Ratio::new(1, 3), 0.5),
    ),
    statement(
        "linear.thirds-weaker",
        Subject::Linear,
        "Sec. IV.B",
        "thirds weaker than in the measurement",
        Claim::NotTested("no amplitude of a measured line is printed"),
    ),
    statement(
        "linear.best-law",
        Subject::Linear,
        "Sec. IV.B, V",
        "linear dampers come closest to the measurement",
        Claim::CloserThanOtherLaw,
    ),
    statement(
        "kuwabara-kono.positive-peak",
        Subject::KuwabaraKono,
        "Sec. IV.B",
        "positive peak +214 mm/s",
        Claim::PositivePeak(KUWABARA_KONO.positive_m_per_s),
    ),
    statement(
        "kuwabara-kono.negative-peak",
        Subject::KuwabaraKono,
        "Sec. IV.B",
        "negative peak −71 mm/s",
        Claim::NegativePeak(KUWABARA_KONO.negative_m_per_s),
    ),
    statement("kuwabara-kono.impulses", Subject::KuwabaraKono, "Sec. IV.B", "a train of impulses", Claim::Impulses),
    statement("kuwabara-kono.half", Subject::KuwabaraKono, "Sec. IV.B", "a line at 1/2", Claim::Present(HALF)),
    statement(
        "kuwabara-kono.no-thirds",
        Subject::KuwabaraKono,
        "Sec. IV.B",
        "no lines at 1/3 and 2/3",
        Claim::Absent(THIRDS),
    ),
    statement(
        "kuwabara-kono.best-alpha",
        Subject::KuwabaraKono,
        "Sec. IV.B",
        "of α = 0.3 … 1.5 the positive peak is closest to the measured one at 1.5",
        Claim::PeakClosestAt(1.5),
    ),
    statement(
        "kuwabara-kono.asymmetry",
        Subject::KuwabaraKono,
        "Sec. IV.B",
        "negative peak a much smaller share of the positive one than measured",
        Claim::LessSymmetricThanMeasured,
    ),
    statement(
        "measured.positive-peak",
        Subject::Measurement,
        "Sec. IV.B, Fig. 6a",
        "positive peak +289 mm/s",
        Claim::PositivePeak(MEASURED.positive_m_per_s),
    ),
    statement(
        "measured.negative-peak",
        Subject::Measurement,
        "Sec. IV.B, Fig. 6a",
        "negative peak −247 mm/s",
        Claim::NegativePeak(MEASURED.negative_m_per_s),
    ),
    statement("measured.impulses", Subject::Measurement, "Sec. I, IV.B", "a train of impulses", Claim::Impulses),
    statement(
        "measured.thirds",
        Subject::Measurement,
        "Sec. IV.B, Fig. 6b",
        "lines at 1/3 and 2/3",
        Claim::Present(THIRDS),
    ),
    statement(
        "measured.ultraharmonics",
        Subject::Measurement,
        "Sec. IV.B, Fig. 6b",
        "ultraharmonics of the thirds",
        Claim::Present(THIRD_ULTRAHARMONICS),
    ),
    statement("measured.bandwidth", Subject::Measurement, "Sec. I", "content up to 200 kHz", Claim::ContentUpTo(200e3)),
    statement(
        "rigid.agreement",
        Subject::Rigid,
        "Sec. IV.A, Fig. 5",
        "finite elements and discrete chain agree well",
        Claim::NotTested("no number is printed; ours stand below, before the rigid wall"),
    ),
    statement(
        "water.pressure",
        Subject::Water,
        "Sec. IV.C",
        "14 kPa at the peak, 1 mm into the water",
        Claim::NotTested("the scene before water is no part of this study"),
    ),
    statement(
        "water.content",
        Subject::Water,
        "Sec. IV.C",
        "content up to 0.95 MHz at −21 dB",
        Claim::NotTested("the scene before water is no part of this study"),
    ),
    statement(
        "companion.precompression",
        Subject::Companion,
        "abstract",
        "impulses only at precompressions of order 0.01 N and below",
        Claim::NotTested("see the study precompression"),
    ),
    statement(
        "companion.chain-length",
        Subject::Companion,
        "abstract",
        "impulses for certain numbers of beads of 2 to 10 only; longer chains have more bandwidth",
        Claim::NotTested("see the study chain-length"),
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_statement_has_a_key_of_its_own_and_says_its_number() {
        let mut keys: Vec<_> = STATEMENTS.iter().map(|statement| statement.key).collect();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), STATEMENTS.len());
        for statement in STATEMENTS {
            if let Claim::PositivePeak(value) | Claim::NegativePeak(value) = statement.claim {
                let digits = format!("{:.0} mm/s", (1e3 * value).abs());
                assert!(statement.said.ends_with(&digits), "{}: {digits}", statement.said);
            }
        }
    }
}
