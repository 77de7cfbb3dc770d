//! `calibrate …` is `granchain calibrate …`, nothing more.

fn main() -> std::process::ExitCode {
    granchain::cli::run_as_subcommand("calibrate")
}
