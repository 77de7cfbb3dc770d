//! Any bytes as a file that the program reads back or is handed: one byte says of which kind, then the file.

#![no_main]

#[path = "../../kept/mod.rs"]
mod kept;

use std::path::PathBuf;

use libfuzzer_sys::fuzz_target;

/// The same for every case of a process.
fn place() -> PathBuf {
    std::env::temp_dir().join(format!("granchain-fuzz-{}", std::process::id()))
}

fuzz_target!(|bytes: &[u8]| {
    let [kind, bytes @ ..] = bytes else { return };
    match kind % 2 {
        0 => kept::plan(&place(), bytes),
        _ => kept::log(&place(), bytes.split(|byte| *byte == b'\n')),
    }
});
