//! `veduta man`: the manual's pages, made from the same texts as `--help`.

use super::refuse_to_replace;
use crate::exit::{Code, Failure};
use crate::talk::print_bytes;
use clap::{Args, Command};
use clap_mangen::Man as Page;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Write the manual: a page to stdout, or all pages into a folder
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Man {
    /// The verb whose page is written to stdout; without it that of veduta itself
    #[arg(conflicts_with = "output")]
    verb: Option<String>,
    /// A folder for all pages, which is made if it is not there
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  All pages:
      veduta man -o pages
  One page:
      veduta man render > veduta-render.1
";

impl Man {
    pub fn run(&self, mut command: Command, force: bool) -> Result<(), Failure> {
        // Gives the verbs the options that all have, and the names that they are called by.
        command.build();
        let pages = pages(&command);
        if let Some(folder) = &self.output {
            return write_all(folder, &pages, force);
        }
        let wanted = match &self.verb {
            Some(verb) => format!("veduta-{verb}"),
            None => "veduta".to_owned(),
        };
        let Some((_, page)) = pages.iter().find(|(name, _)| *name == wanted) else {
            let names: Vec<_> = pages
                .iter()
                .filter_map(|(name, _)| name.strip_prefix("veduta-"))
                .collect();
            let message = format!("no verb {:?}; there are {}", self.verb, names.join(", "));
            return Err(Failure::new(Code::Usage, message));
        };
        print_bytes(page)
    }
}

/// The pages' names, without their section, and texts.
fn pages(command: &Command) -> Vec<(String, Vec<u8>)> {
    let page = |name: &str, command: &Command| {
        let mut text = Vec::new();
        let named = command.clone().name(name.to_owned());
        Page::new(named)
            .render(&mut text)
            .expect("memory takes all");
        (name.to_owned(), text)
    };
    let verbs = command
        .get_subcommands()
        .filter(|verb| verb.get_name() != "help")
        .map(|verb| page(&format!("veduta-{}", verb.get_name()), verb));
    [page("veduta", command)].into_iter().chain(verbs).collect()
}

fn write_all(folder: &Path, pages: &[(String, Vec<u8>)], force: bool) -> Result<(), Failure> {
    let fail = |path: &Path, error: io::Error| {
        let message = format!("{}: cannot be written: {error}", path.display());
        Failure::new(Code::InputOutput, message)
    };
    fs::create_dir_all(folder).map_err(|error| fail(folder, error))?;
    let files: Vec<_> = pages
        .iter()
        .map(|(name, text)| (folder.join(format!("{name}.1")), text))
        .collect();
    for (path, _) in &files {
        refuse_to_replace(path, force)?;
    }
    for (path, text) in &files {
        fs::write(path, text).map_err(|error| fail(path, error))?;
    }
    Ok(())
}
