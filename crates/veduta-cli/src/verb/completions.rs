//! `veduta completions`: what a shell needs to complete verbs and options.

use crate::exit::Failure;
use crate::talk::print_bytes;
use clap::{Args, Command};
use clap_complete::Shell;

/// Write completions for a shell to stdout
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Completions {
    /// The shell
    shell: Shell,
}

const EXAMPLES: &str = "\
Examples:
  For bash, for good (other shells have folders of their own):
      veduta completions bash > veduta.bash
";

impl Completions {
    pub fn run(&self, command: &mut Command) -> Result<(), Failure> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, command, "veduta", &mut text);
        print_bytes(&text)
    }
}
