//! Shell completions and the manual page, made from the same definitions as `--help`.

use super::outlet::Outlet;
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
        &mut Outlet::new(),
    );
    Ok(ExitCode::SUCCESS)
}

/// Prints the manual page to stdout.
pub fn man() -> Result<ExitCode, CliError> {
    clap_mangen::Man::new(Cli::command())
        .render(&mut Outlet::new())
        .map_err(CliError::Stdout)?;
    Ok(ExitCode::SUCCESS)
}
