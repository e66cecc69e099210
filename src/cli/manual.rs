//! Shell completions and the manual pages, made from the same definitions as `--help`.

use super::outlet::Outlet;
use super::{Cli, CliError};
use crate::output::write_atomic;
use clap::{Args, CommandFactory};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `metrolux completions`.
#[derive(Args, Debug)]
pub struct CompletionsArgs {
    /// Shell to complete for
    shell: clap_complete::Shell,
}

/// Prints completions to stdout.
pub fn completions(args: &CompletionsArgs) -> Result<ExitCode, CliError> {
    // The generator panics where it cannot write.
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "metrolux", &mut text);
    Outlet::new().write_all(&text).map_err(CliError::Stdout)?;
    Ok(ExitCode::SUCCESS)
}

/// Arguments of `metrolux man`.
#[derive(Args, Debug)]
pub struct ManArgs {
    /// Command whose page to print, such as render or job slurm; without one, the page of metrolux itself
    command: Vec<String>,
    /// Write the pages of all commands into this folder
    #[arg(short, long, value_name = "DIR", conflicts_with = "command")]
    output: Option<PathBuf>,
}

/// Prints a manual page to stdout, or writes all of them.
pub fn man(args: &ManArgs) -> Result<ExitCode, CliError> {
    let mut all = Cli::command().disable_help_subcommand(true);
    all.build();
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder).map_err(|e| CliError::not_writable(folder, e))?;
        pages(&all, folder)?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut command = &all;
    for name in &args.command {
        command = command.find_subcommand(name).ok_or_else(|| {
            let all: Vec<&str> = command.get_subcommands().map(|c| c.get_name()).collect();
            let expected = match all.is_empty() {
                true => "nothing more".into(),
                false => format!("one of {}", all.join(", ")),
            };
            CliError::Usage(format!(
                "no such command: found {name}, expected {expected}"
            ))
        })?;
    }
    let page = clap_mangen::Man::new(command.clone());
    page.render(&mut Outlet::new()).map_err(CliError::Stdout)?;
    Ok(ExitCode::SUCCESS)
}

/// Writes the pages of a command and of those below it.
fn pages(command: &clap::Command, folder: &Path) -> Result<(), CliError> {
    let page = clap_mangen::Man::new(command.clone());
    let mut text = Vec::new();
    page.render(&mut text).expect("memory takes everything");
    write_atomic(&folder.join(page.get_filename()), &text)?;
    let mut below = command.get_subcommands().filter(|c| !c.is_hide_set());
    below.try_for_each(|c| pages(c, folder))
}
