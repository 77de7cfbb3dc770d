//! The program, run in the project's folder.

use std::process::Command;

/// Standard output, standard error and exit code of a subcommand.
pub fn granchain(subcommand: &str, arguments: &[&str]) -> (String, String, i32) {
    let output = Command::new(env!("CARGO_BIN_EXE_granchain"))
        .arg(subcommand)
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (text(output.stdout), text(output.stderr), output.status.code().unwrap())
}
