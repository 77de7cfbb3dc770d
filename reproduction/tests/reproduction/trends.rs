//! The studies of chain length and precompression, on the chain.

use granchain::feature::Ratio;
use granchain_calibration::predict::Bodies;
use granchain_calibration::predict::replicates::Unwatched;
use granchain_reproduction::chain_length::{BEADS, ChainLengths};
use granchain_reproduction::divided::Divided;
use granchain_reproduction::page::chain_length::ChainLengthReport;
use granchain_reproduction::page::precompression::PrecompressionReport;
use granchain_reproduction::portrait::Trait;
use granchain_reproduction::precompression::{FORCES, Precompressions};
use granchain_reproduction::trend::{SPECTRUM_POINTS, SPECTRUM_SPAN, Study, TrendPlan, Varied};

const PLAN: TrendPlan = TrendPlan { replicates: 2, seed: 1 };

fn on_chain<T: Send>(threads: usize, run: impl FnOnce(&[String]) -> T + Send) -> T {
    let overrides = ["model.kind=chain".to_owned()];
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| run(&overrides))
}

fn all<V: Varied>(overrides: &[String]) -> Vec<V> {
    Study::new(PLAN, overrides, Bodies::new(None)).unwrap().run(&Unwatched).unwrap()
}

#[test]
fn chains_of_all_lengths_are_run_and_six_beads_have_the_lines_of_their_law() {
    let run = |threads| on_chain(threads, all::<ChainLengths>);
    let laws = run(2);
    for law in &laws {
        assert_eq!(law.points.iter().map(|point| point.value as usize).collect::<Vec<_>>(), BEADS.collect::<Vec<_>>());
        assert!(law.points.iter().all(|point| point.failed == 0));
    }
    assert!(laws[0].with_line(Ratio::new(1, 3)).contains(&6));
    assert!(laws[1].with_line(Ratio::new(1, 2)).contains(&6));
    assert!(!laws[1].with_line(Ratio::new(1, 3)).contains(&6));
    // The band that holds f0 carries the drive line.
    let point = &laws[1].points[4];
    let band = (SPECTRUM_POINTS as f64 / SPECTRUM_SPAN) as usize;
    let drive = point.moments.get(Trait::DriveLine).unwrap().mean;
    assert!((point.spectrum_m_per_s[band] / drive - 1.0).abs() < 0.02, "{} {drive}", point.spectrum_m_per_s[band]);

    let report = ChainLengthReport {
        program: "granchain".into(),
        model: "chain",
        plan: PLAN,
        laws: laws.clone(),
        drive_frequency: 73e3,
        command_line: "granchain-reproduction chain-length".into(),
    };
    let files = report.files().unwrap();
    let other = ChainLengthReport { laws: run(1), ..report };
    assert!(files == other.files().unwrap());
}

#[test]
fn a_pressed_chain_loses_its_impulses_and_moves_less() {
    let laws = on_chain(2, all::<Precompressions>);
    for law in &laws {
        assert_eq!(law.points.iter().map(|point| point.value).collect::<Vec<_>>(), FORCES);
        let crest = |index: usize| law.points[index].moments.get(Trait::Crest).unwrap().mean;
        assert!(law.points[0].moments.is_impulsive(), "{} {}", law.law.name, crest(0));
        assert!(crest(FORCES.len() - 1) < crest(0), "{}", law.law.name);
    }
    let report = PrecompressionReport {
        program: "granchain".into(),
        model: "chain",
        plan: PLAN,
        laws,
        command_line: "granchain-reproduction precompression".into(),
    };
    let files = report.files().unwrap();
    let page = files.iter().find(|(name, _)| name.ends_with("report.html")).unwrap();
    assert!(String::from_utf8_lossy(&page.1).contains("companion"));
}
