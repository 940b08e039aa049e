//! `warpcheck completions` and `warpcheck man`: what a shell and `man` want to know, from the same description as the arguments.

use super::{Cli, common};
use anyhow::{Context, Result};
use clap::{Args, CommandFactory};
use clap_complete::Shell;
use std::process::ExitCode;

#[derive(Args)]
pub struct Arguments {
    /// bash, elvish, fish, powershell or zsh
    shell: Shell,
}

#[derive(Args)]
pub struct ManArguments {
    /// The command; all of warpcheck if none is named
    command: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "warpcheck", &mut text);
    common::print(&String::from_utf8(text).context("completions are text")?)?;
    Ok(ExitCode::SUCCESS)
}

pub fn man(arguments: &ManArguments) -> Result<ExitCode> {
    let mut all = Cli::command();
    all.build();
    let command = match &arguments.command {
        None => all,
        Some(name) => {
            all.find_subcommand(name).with_context(|| format!("there is no command `{name}`"))?.clone()
        }
    };
    let mut text = Vec::new();
    clap_mangen::Man::new(command).render(&mut text).context("can't make the page")?;
    common::print(&String::from_utf8(text).context("a manual page is text")?)?;
    Ok(ExitCode::SUCCESS)
}
