use crate::exit::Failure;
use crate::talk::print;
use clap::{Args, ValueEnum};
use veduta_io::{scene_file_schema, views_file_schema};

/// Print the JSON Schema of scene files, or of files of views
///
/// Editors complete and check files with it.
/// With the first line `#:schema scene.schema.json` a scene file says where its schema is.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Schema {
    /// Of which files: scene files, or the files of views that veduta dome reads
    #[arg(default_value = "scene", hide_default_value = true)]
    kind: Kind,
}

/// What files a schema is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    Scene,
    Views,
}

const EXAMPLES: &str = "\
Examples:
  For an editor:
      veduta schema > scene.schema.json
      veduta schema views > views.schema.json
";

impl Schema {
    pub fn run(&self) -> Result<(), Failure> {
        let schema = match self.kind {
            Kind::Scene => scene_file_schema(),
            Kind::Views => views_file_schema(),
        };
        print(&format!("{schema:#}\n"))
    }
}
