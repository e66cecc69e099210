//! Shell completions and the manual page, made from the same definitions as `--help`.

use super::{Cli, CliError};
use clap::{Args, CommandFactory};
use std::process::ExitCode;

/// Arguments of `metrolux completions`.
#[derive(Args, Debug)]
pub struct CompletionsArgs {
    /// Shell to complete for
    shell: clap_complete::Shell,
}

/// Prints completions to stdout.
pub fn completions(args: &CompletionsArgs) -> Result<ExitCode, CliError> {
    clap_complete::generate(
        args.shell,
        &mut Cli::command(),
        "metrolux",
        &mut std::io::stdout(),
    );
    Ok(ExitCode::SUCCESS)
}

/// Prints the manual page to stdout.
pub fn man() -> Result<ExitCode, CliError> {
    clap_mangen::Man::new(Cli::command())
        .render(&mut std::io::stdout())
        .map_err(|e| CliError::Internal(format!("cannot print the manual page: {e}")))?;
    Ok(ExitCode::SUCCESS)
}
