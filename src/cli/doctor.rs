//! `granchain doctor`: what the program finds on this machine.

use std::{fmt, path::Path};

use clap::Args;
use serde::Serialize;

use super::{Outcome, arguments::Session};
use crate::model::vector_unit;

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain doctor --json")]
pub struct Arguments;

#[derive(Debug, Serialize)]
struct Findings {
    version: &'static str,
    /// What does the arithmetic: last digits depend on it.
    processor: String,
    system: String,
    cores: usize,
    /// Threads that a run takes.
    threads: usize,
    cache: Option<CacheFolder>,
    /// What should be put right.
    warnings: Vec<String>,
}

/// The folder of reduced bodies.
#[derive(Debug, Serialize)]
struct CacheFolder {
    folder: String,
    bodies: usize,
    bytes: u64,
    writable: bool,
}

pub fn execute(session: &Session) -> anyhow::Result<Outcome> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let cache = session.cache().map(|cache| kept(cache.folder()));
    let mut warnings = Vec::new();
    match &cache {
        None => {
            warnings.push("reduced bodies are made again by every run: no cache folder, or --cache none".to_owned())
        }
        Some(kept) if !kept.writable => {
            warnings.push(format!("{}: cannot be written; name another with --cache", kept.folder));
        }
        Some(_) => {}
    }
    if cfg!(debug_assertions) {
        warnings.push("built without optimisation: some fifty times slower; build with --release".to_owned());
    }
    let findings = Findings {
        version: env!("CARGO_PKG_VERSION"),
        processor: vector_unit(),
        system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        cores,
        threads: rayon::current_num_threads(),
        cache,
        warnings,
    };
    session.result(&findings, &findings)?;
    Ok(Outcome::Done)
}

/// What is kept in a folder, and whether more can be.
fn kept(folder: &Path) -> CacheFolder {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let sizes: Vec<u64> =
        files.filter_map(|file| file.metadata().ok().filter(|it| it.is_file())).map(|it| it.len()).collect();
    // The folder is made when first needed: then its nearest ancestor decides.
    let nearest = folder.ancestors().find(|path| path.is_dir());
    let writable = nearest.is_some_and(|path| tempfile::tempfile_in(path).is_ok());
    CacheFolder { folder: folder.display().to_string(), bodies: sizes.len(), bytes: sizes.iter().sum(), writable }
}

impl fmt::Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { version, processor, system, cores, threads, cache, warnings } = self;
        writeln!(f, "granchain {version}")?;
        writeln!(f, "  {:<12}{processor}, {system}", "processor")?;
        writeln!(f, "  {:<12}{threads} on {cores} cores", "threads")?;
        match cache {
            Some(CacheFolder { folder, bodies, bytes, .. }) => {
                writeln!(f, "  {:<12}{folder}: {bodies} reduced bodies, {:.1} MB", "cache", 1e-6 * *bytes as f64)?;
            }
            None => writeln!(f, "  {:<12}none", "cache")?,
        }
        for warning in warnings {
            writeln!(f, "warning: {warning}")?;
        }
        Ok(())
    }
}
