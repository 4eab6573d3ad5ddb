//! The `veduta` command: arguments -> settings -> library calls -> messages.
//!
//! A file for each verb, in `verb/`. Data goes to stdout, talk to stderr; how it ends is in `exit`.

mod excerpt;
mod exit;
mod preview;
mod talk;
mod values;
mod verb;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, CommandFactory, Parser, Subcommand};
use exit::{Code, Ending, Failure};
use std::num::NonZeroUsize;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::process::ExitCode;
use std::thread::available_parallelism;
use talk::{ProgressStyle, Talk, say_error};
use veduta_io::PictureFormat;

/// Pictures of 3D scenes with exactly antialiased edges.
#[derive(Debug, Parser)]
#[command(
    name = "veduta",
    version,
    arg_required_else_help = true,
    after_help = EXIT_CODES,
    after_long_help = format!("{EXAMPLES}\n{EXIT_CODES}"),
)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
    #[command(flatten)]
    common: Common,
}

const EXAMPLES: &str = "\
Examples:
      veduta examples river
      veduta render river.glb --preview=blocks
      veduta render river.glb -o river.png
      veduta info river.glb
      veduta help render
";

const EXIT_CODES: &str = "\
Exit codes: 0 fine, 1 a check failed or pictures differ, 2 usage, 3 something named is missing, 4 bad \
    input, 5 not supported, 6 input/output, 70 a fault of veduta itself, 130 interrupted.";

/// What all verbs understand.
#[derive(Debug, Args)]
#[command(next_help_heading = "Common options")]
struct Common {
    /// Tell what was done as JSON on stdout
    #[arg(long, global = true)]
    json: bool,
    /// Number of threads; as many as processors by default. Results do not depend on it, and more than a
    /// few for each processor are not started
    #[arg(long, global = true, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// How to show progress on stderr
    #[arg(
        long,
        global = true,
        value_name = "STYLE",
        default_value = "auto",
        hide_default_value = true
    )]
    progress: ProgressStyle,
    /// Replace files that exist; pictures are always replaced
    #[arg(long, global = true)]
    force: bool,
    /// No warnings
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Say how long each step takes
    #[arg(short, long, global = true)]
    verbose: bool,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Render(Box<verb::render::Render>),
    Shade(Box<verb::shade::Shade>),
    Composite(Box<verb::composite::Composite>),
    Dome(Box<verb::dome::Dome>),
    Frames(Box<verb::frames::Frames>),
    Info(Box<verb::info::Info>),
    Check(verb::check::Check),
    Diff(verb::diff::Diff),
    Examples(verb::examples::Examples),
    Completions(verb::completions::Completions),
    Man(verb::man::Man),
    Schema(verb::schema::Schema),
}

fn main() -> ExitCode {
    set_panic_message();
    // Partial output is removed on SIGINT, SIGTERM and SIGHUP. Without the handler the files would stay; not having it
    // is no reason not to work.
    let _ = ctrlc::set_handler(|| {
        veduta_io::remove_unfinished();
        std::process::exit(Code::Interrupted as i32);
    });
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            eprint!("{}", error.render());
            return ExitCode::from(Code::Usage as u8);
        }
        Err(error) if error.use_stderr() => {
            eprint!("veduta: {}", with_tip(error).render());
            return ExitCode::from(Code::Usage as u8);
        }
        // Help or version were asked for.
        Err(text) => {
            return end(talk::print(&text.render().to_string()).map(|()| Ending::Fine));
        }
    };
    match panic::catch_unwind(AssertUnwindSafe(|| run(arguments))) {
        Ok(result) => end(result),
        // The hook has told it already.
        Err(_) => ExitCode::from(Code::Internal as u8),
    }
}

/// The error, with a tip where a word too many shows what was meant.
fn with_tip(mut error: clap::Error) -> clap::Error {
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidArg) else {
        return error;
    };
    let tip = if error.kind() != ErrorKind::UnknownArgument {
        None
    } else if PictureFormat::of(Path::new(word)).is_ok() {
        Some(format!("the picture to write is named by -o: -o {word}"))
    } else if word.starts_with('-') && word.parse::<f64>().is_ok() {
        Some(format!(
            "a value below 0 is joined to its option by =: --option={word}"
        ))
    } else if word.parse::<f64>().is_ok() {
        Some("coordinates are one word: 1,2,3".to_owned())
    } else {
        None
    };
    if let Some(tip) = tip {
        let tips = ContextValue::StyledStrs(vec![tip.into()]);
        error.insert(ContextKind::Suggested, tips);
    }
    error
}

/// The most threads that are started for each processor.
const THREADS_PER_PROCESSOR: usize = 8;

fn run(arguments: Arguments) -> Result<Ending, Failure> {
    let common = &arguments.common;
    if let Some(threads) = common.threads {
        // Those that wait for work take as much time as those that have some.
        let most = THREADS_PER_PROCESSOR * available_parallelism().map_or(1, NonZeroUsize::get);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.get().min(most));
        let started = pool.build_global();
        started.map_err(|error| Failure::new(Code::InputOutput, format!("threads: {error}")))?;
    }
    let mut talk = Talk::new(common.quiet, common.verbose, common.progress);
    let fine = |()| Ending::Fine;
    match &arguments.verb {
        Verb::Render(render) => render.run(common.force, common.json, &mut talk).map(fine),
        Verb::Shade(shade) => shade.run(common.json, &mut talk).map(fine),
        Verb::Composite(composite) => composite
            .run(common.force, common.json, &mut talk)
            .map(fine),
        Verb::Dome(dome) => dome.run(common.json, &mut talk).map(fine),
        Verb::Frames(frames) => frames.run(common.force, common.json, &mut talk).map(fine),
        Verb::Info(info) => info.run(common.json, &mut talk).map(fine),
        Verb::Check(check) => check.run(common.json, &mut talk),
        Verb::Diff(diff) => diff.run(common.json, &mut talk),
        Verb::Examples(examples) => examples.run(common, &mut talk).map(fine),
        Verb::Completions(completions) => completions.run(&mut Arguments::command()).map(fine),
        Verb::Man(man) => man.run(Arguments::command(), common.force).map(fine),
        Verb::Schema(schema) => schema.run().map(fine),
    }
}

fn end(result: Result<Ending, Failure>) -> ExitCode {
    match result {
        Ok(Ending::Fine) => ExitCode::SUCCESS,
        Ok(Ending::CheckFailed) => ExitCode::from(Code::CheckFailed as u8),
        Err(failure) => {
            say_error(&failure);
            ExitCode::from(failure.code as u8)
        }
    }
}

/// A panic is a fault of ours: says so, and asks for a report, instead of the raw message.
fn set_panic_message() {
    panic::set_hook(Box::new(|panic| {
        let place = panic
            .location()
            .map_or_else(String::new, |place| format!(" at {place}"));
        let payload = panic.payload();
        let message = payload
            .downcast_ref::<&str>()
            .copied()
            .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
            .unwrap_or("no message");
        say_error(format_args!(
            "internal error{place}: {message}; this is a fault of veduta: please report it, with \
             the command line and the input, at {}/issues",
            env!("CARGO_PKG_REPOSITORY")
        ));
    }));
}
