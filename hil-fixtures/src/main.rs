//! The mock rig's program: see `biplane_mock::cli`.

use std::process::ExitCode;

fn main() -> ExitCode {
    biplane_mock::cli::main()
}
