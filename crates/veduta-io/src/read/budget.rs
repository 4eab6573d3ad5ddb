use super::error::Problem;
use super::files::ReadFiles;

/// The input read so far, and how much memory it can justify.
///
/// A few bytes of JSON can ask for any number of vertices, and a thousand primitives can share one
/// accessor, so every table is charged here before it is made.
#[derive(Debug)]
pub(crate) struct Budget {
    input: u64,
    spent: u64,
    /// What was read.
    pub files: ReadFiles,
}

/// Bytes that any file may ask for, however small.
const FREE: u64 = 64 << 20;

/// Bytes that one byte of input may become. An index of one byte becomes at most a corner of 4
/// bytes and a vertex of 56, so smaller would refuse honest files; larger would let small files
/// fill the machine.
const PER_INPUT_BYTE: u64 = 64;

impl Budget {
    pub fn new() -> Self {
        Self {
            input: 0,
            spent: 0,
            files: ReadFiles::default(),
        }
    }

    /// Says that `bytes` of input have been read.
    pub fn add_input(&mut self, bytes: usize) {
        self.input = self.input.saturating_add(bytes as u64);
    }

    /// Bytes that may still be asked for.
    #[cfg(feature = "draco")]
    pub fn left(&self) -> u64 {
        self.allowed().saturating_sub(self.spent)
    }

    /// What is said where `asked` bytes are not to be had.
    pub fn refusal(&self, asked: u64) -> Problem {
        let input = self.input;
        Problem::TooLarge { asked, input }
    }

    fn allowed(&self) -> u64 {
        FREE.saturating_add(self.input.saturating_mul(PER_INPUT_BYTE))
    }

    /// Takes `rows` rows of `row_bytes` bytes from the budget.
    ///
    /// # Errors
    /// [`Problem::TooLarge`] when they are not to be had.
    pub fn charge(&mut self, rows: u64, row_bytes: usize) -> Result<(), Problem> {
        let asked = rows.saturating_mul(row_bytes as u64);
        let spent = self.spent.saturating_add(asked);
        if spent > self.allowed() {
            return Err(self.refusal(asked));
        }
        self.spent = spent;
        Ok(())
    }
}
