use crate::exit::Failure;
use crate::talk::print;
use clap::Args;
use veduta_io::scene_file_schema;

/// Print the JSON Schema of scene files, with which editors complete and check them
///
/// Example: veduta schema > scene.schema.json, and as the first line of a scene file:
/// #:schema scene.schema.json
#[derive(Debug, Args)]
pub struct Schema {}

impl Schema {
    pub fn run(&self) -> Result<(), Failure> {
        print(&format!("{:#}\n", scene_file_schema()))
    }
}
