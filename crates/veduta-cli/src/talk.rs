//! What the command says while it works: to stderr, since stdout is for data.

use crate::exit::{Code, Failure};
use clap::ValueEnum;
use std::borrow::Cow;
use std::io::{self, IsTerminal, Write};
use std::time::Instant;

/// How progress is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ProgressStyle {
    /// A line that changes, where there is a terminal.
    #[default]
    Auto,
    /// A line that changes.
    Bar,
    /// A line of JSON for each step.
    Json,
    /// Nothing.
    None,
}

/// Speaks with the user.
#[derive(Debug)]
pub struct Talk {
    quiet: bool,
    verbose: bool,
    style: ProgressStyle,
    step: Option<(Cow<'static, str>, Instant)>,
    warnings: Vec<String>,
}

impl Talk {
    pub fn new(quiet: bool, verbose: bool, progress: ProgressStyle) -> Self {
        let style = match progress {
            ProgressStyle::Auto if !quiet && io::stderr().is_terminal() => ProgressStyle::Bar,
            ProgressStyle::Auto => ProgressStyle::None,
            style => style,
        };
        Self {
            quiet,
            verbose,
            style,
            step: None,
            warnings: Vec::new(),
        }
    }

    /// Says that a step begins, and the one before it is done.
    pub fn begin(&mut self, step: impl Into<Cow<'static, str>>) {
        self.end();
        let step = step.into();
        match self.style {
            ProgressStyle::Bar => say(format_args!("\r\x1b[2Kveduta: {step} …")),
            ProgressStyle::Json => {
                say(format_args!(
                    "{}\n",
                    serde_json::json!({ "step": step, "done": false })
                ));
            }
            ProgressStyle::Auto | ProgressStyle::None => {}
        }
        self.step = Some((step, Instant::now()));
    }

    /// Says that `done` of `count` parts of the current step are done.
    pub fn part(&mut self, done: usize, count: usize) {
        let Some((step, _)) = &self.step else {
            return;
        };
        match self.style {
            ProgressStyle::Bar => {
                let percent = 100 * done / count.max(1);
                say(format_args!("\r\x1b[2Kveduta: {step} … {percent} %"));
            }
            ProgressStyle::Json => {
                let line = serde_json::json!({ "step": step, "done": false, "part": done, "parts": count });
                say(format_args!("{line}\n"));
            }
            ProgressStyle::Auto | ProgressStyle::None => {}
        }
    }

    /// Says that the current step is done.
    pub fn end(&mut self) {
        let Some((step, start)) = self.step.take() else {
            return;
        };
        let seconds = start.elapsed().as_secs_f64();
        match self.style {
            ProgressStyle::Bar => say(format_args!("\r\x1b[2K")),
            ProgressStyle::Json => {
                let line = serde_json::json!({ "step": step, "done": true, "seconds": seconds });
                say(format_args!("{line}\n"));
            }
            ProgressStyle::Auto | ProgressStyle::None => {}
        }
        if self.verbose {
            say(format_args!("veduta: {step}: {seconds:.3} s\n"));
        }
    }

    /// Warns, and remembers it for [`Talk::warnings`].
    pub fn warn(&mut self, message: String) {
        self.clear_line();
        if !self.quiet {
            say(format_args!("veduta: warning: {message}\n"));
        }
        self.warnings.push(message);
    }

    /// Warns; if `strict`, fails with `code` instead.
    pub fn warn_or_fail(
        &mut self,
        message: String,
        strict: bool,
        code: Code,
    ) -> Result<(), Failure> {
        if strict {
            let message = format!("{message} (an error because of --strict)");
            return Err(Failure::new(code, message));
        }
        self.warn(message);
        Ok(())
    }

    /// The same for what may be found in each of many pictures, and is told once.
    pub fn warn_once_or_fail(
        &mut self,
        message: String,
        strict: bool,
        code: Code,
    ) -> Result<(), Failure> {
        if !strict && self.warnings.contains(&message) {
            return Ok(());
        }
        self.warn_or_fail(message, strict, code)
    }

    /// Tells a detail, if the user wants details.
    pub fn detail(&mut self, message: std::fmt::Arguments<'_>) {
        self.clear_line();
        if self.verbose {
            say(format_args!("veduta: {message}\n"));
        }
    }

    /// Whether only what was asked for is said.
    pub fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// All warnings so far.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn clear_line(&self) {
        if self.style == ProgressStyle::Bar && self.step.is_some() {
            say(format_args!("\r\x1b[2K"));
        }
    }
}

impl Drop for Talk {
    /// Leaves no half line behind when a step fails.
    fn drop(&mut self) {
        self.clear_line();
    }
}

/// To stderr; that nobody listens there is no reason to fail.
fn say(text: std::fmt::Arguments<'_>) {
    let _ = io::stderr().write_fmt(text);
}

/// Says why the command fails.
pub fn say_error(message: impl std::fmt::Display) {
    say(format_args!("veduta: error: {message}\n"));
}

/// Writes data to stdout.
pub fn print(text: &str) -> Result<(), Failure> {
    print_bytes(text.as_bytes())
}

/// Writes data to stdout.
pub fn print_bytes(bytes: &[u8]) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(bytes).and_then(|()| stdout.flush()) {
        Ok(()) => Ok(()),
        // Who reads has read enough: `veduta info … | head`.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(Failure::new(Code::InputOutput, format!("stdout: {error}"))),
    }
}

/// A number with its thousands set apart.
pub fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// A number of things of that name: `1 face`, `2,000 faces`.
pub fn counted(number: usize, name: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{} {name}{plural}", grouped(number))
}

/// A name from a file, for a terminal: control characters, which could move its cursor or worse, are
/// shown as escapes.
pub fn plain(name: &str) -> String {
    name.chars()
        .flat_map(|c| {
            let escaped = c.is_control().then(|| c.escape_default());
            let kept = escaped.is_none().then_some(c);
            escaped.into_iter().flatten().chain(kept)
        })
        .collect()
}
