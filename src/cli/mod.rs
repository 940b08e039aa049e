//! The command line: one file a command, each arguments, call, report, exit code.

mod agree;
mod calibrate;
mod check;
mod common;
mod completions;
mod converge;
mod everything;
mod faults;
mod histogram;
mod plan;
mod render;
mod stress;
mod verify;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Find out whether Monte Carlo samplers are right, and how good they are.
///
/// Without a command: verifies every sampler that ships, and makes a report.
#[derive(Parser)]
#[command(name = "warpcheck", version, max_term_width = 100, after_help = AFTER_HELP)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Check samplers: all that ship, or those named (a family like `phong`, or `phong/50`)
    Verify(verify::Arguments),
    /// Check a sampler that is not in Rust: its samples from a file or a pipe, or the program itself
    Check(Box<check::Arguments>),
    /// Measure how often right samplers fail, beside how often they may
    Calibrate(calibrate::Arguments),
    /// Run the battery on broken samplers, each beside its correct twin
    Faults(faults::Arguments),
    /// Give samplers inputs that break f32, and tell what happened beside what should
    Stress(stress::Arguments),
    /// Draw samples of a map or of a shipped sampler and write their histogram
    Histogram(histogram::Arguments),
    /// Render a scene with one strategy, or all of them as a contact sheet
    Render(render::Arguments),
    /// Measure the error of strategies against run time
    Converge(converge::Arguments),
    /// Find out whether strategies agree with one another and with a reference
    Agree(agree::Arguments),
    /// Show what a scene needs and what is left out, and why
    Plan(plan::Arguments),
    /// Print what a shell needs to complete commands and options
    #[command(hide = true)]
    Completions(completions::Arguments),
    /// Print the manual page, of a command if one is named
    #[command(hide = true)]
    Man(completions::ManArguments),
}

const AFTER_HELP: &str = "\
Examples:
  warpcheck                                       verify all that ships: warpcheck-out/index.html
  warpcheck verify environment --samples 10M      the environment maps only, with more samples
  warpcheck verify phong --report out             a family; a page for the browser, out/index.html
  warpcheck verify --list                         what there is
  warpcheck check --sampler 'python3 mine.py'     a sampler that is not in Rust (docs/protocol.md)
  warpcheck check dirs.npy --domain sphere        samples x,y,z,pdf from NumPy
  warpcheck calibrate --runs 1k                   false alarms of right samplers, measured
  warpcheck faults --list                         mistakes, most of them made in public
  warpcheck faults                                what catches them, and after how many samples
  warpcheck stress environment                    what maps of odd sizes and enormous range do
  warpcheck histogram data/env/noon_grass_512.hdr --samples 1M,10M,100M
  warpcheck histogram triangle/low-distortion     a shipped sampler on its own domain
  warpcheck render data/scene/veach_a3.toml --strategy mis:0.5 --spp 64
  warpcheck render data/scene/veach_a3.toml --sheet
  warpcheck converge data/scene/veach_a3.toml     error against run time, strategy by strategy
  warpcheck agree data/scene/cornell.toml         do the strategies estimate the same picture?
  warpcheck render data/scene/cornell.toml --error 0.02 --film
  warpcheck plan data/scene/cornell.toml          what the scene needs, and what is left out

Exit codes: 0 pass, 1 fail, 2 bad input, 3 inconclusive, 130 Ctrl-C (what was done is kept).
Also: warpcheck completions SHELL, warpcheck man [COMMAND].
Counts take the suffixes k, M and G. Same seed, same bits, on any number of threads.";

/// Runs the program.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(told) if !told.use_stderr() => told.exit(), // --help, --version
        Err(error) => {
            eprintln!("warpcheck: {} (--help explains)", sentence(&error.to_string()));
            return ExitCode::from(2);
        }
    };
    let result = match cli.command {
        None => everything::run(),
        Some(Command::Verify(arguments)) => verify::run(&arguments),
        Some(Command::Check(arguments)) => check::run(&arguments),
        Some(Command::Calibrate(arguments)) => calibrate::run(&arguments),
        Some(Command::Faults(arguments)) => faults::run(&arguments),
        Some(Command::Stress(arguments)) => stress::run(&arguments),
        Some(Command::Histogram(arguments)) => histogram::run(&arguments),
        Some(Command::Render(arguments)) => render::run(&arguments),
        Some(Command::Converge(arguments)) => converge::run(&arguments),
        Some(Command::Agree(arguments)) => agree::run(&arguments),
        Some(Command::Plan(arguments)) => plan::run(&arguments),
        Some(Command::Completions(arguments)) => completions::run(&arguments),
        Some(Command::Man(arguments)) => completions::man(&arguments),
    };
    result.unwrap_or_else(|error| {
        eprintln!("warpcheck: {}", common::sentence(&error));
        ExitCode::from(2)
    })
}

/// What is wrong with the arguments, without the reminder of the usage, in one line.
fn sentence(error: &str) -> String {
    let said = |paragraph: &&str| !["Usage:", "For more"].iter().any(|s| paragraph.starts_with(s));
    let words = |paragraph: &str| paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
    let error = error.strip_prefix("error: ").unwrap_or(error);
    error.split("\n\n").filter(said).map(words).collect::<Vec<_>>().join("; ")
}
