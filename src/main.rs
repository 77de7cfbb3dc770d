//! `granchain`: parse, run, print the error chain, set the exit code.

fn main() -> std::process::ExitCode {
    granchain::cli::run()
}
