//! `granchain-reproduction`: reproduce the source paper.

fn main() -> std::process::ExitCode {
    granchain_reproduction::command::main()
}
