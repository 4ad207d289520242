//! The command `probepath`: it translates what was typed, and decides nothing.

mod cli;
mod commands;
mod screen;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    let screen = screen::Screen::new(cli.json);
    match commands::perform(cli.command.unwrap_or_default(), &screen) {
        Ok(document) => screen.document(&document),
        Err(error) => screen.failure(&*error),
    }
}
