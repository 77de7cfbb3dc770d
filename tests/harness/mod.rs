//! The program as a test runs it.

use std::{
    path::Path,
    process::{Command, Output},
};

/// The project's folder.
pub const PROJECT: &str = env!("CARGO_MANIFEST_DIR");

/// Exit code, standard output and standard error of a run in a folder.
pub fn granchain(folder: impl AsRef<Path>, arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    let output = command.args(arguments).current_dir(folder).output().unwrap();
    (code(&output), stdout(&output), stderr(&output))
}

/// Exit code.
pub fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

/// Standard output.
pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Standard error.
pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}
