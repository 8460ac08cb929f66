//! The onboard program: see `biplane_onboard::cli`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(biplane_onboard::cli::run(std::env::args_os()))
}
