use crate::exit::Failure;
use crate::talk::print;
use clap::Args;
use veduta_io::scene_file_schema;

/// Print the JSON Schema of scene files, with which editors complete and check them
///
/// With the first line `#:schema scene.schema.json` a scene file says where its schema is.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Schema {}

const EXAMPLES: &str = "\
Examples:
  For an editor:
      veduta schema > scene.schema.json
";

impl Schema {
    pub fn run(&self) -> Result<(), Failure> {
        print(&format!("{:#}\n", scene_file_schema()))
    }
}
