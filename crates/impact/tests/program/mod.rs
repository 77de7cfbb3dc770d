//! The program as a test runs it.

use std::{path::Path, process::Command};

/// Exit code, standard output and standard error of a run in a folder.
pub fn granchain_impact(folder: impl AsRef<Path>, arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain-impact"));
    let output = command.args(arguments).current_dir(folder).output().unwrap();
    let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (output.status.code().unwrap(), out, err)
}
