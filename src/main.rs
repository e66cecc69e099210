//! The `metrolux` command.

fn main() -> std::process::ExitCode {
    metrolux::cli::main()
}
