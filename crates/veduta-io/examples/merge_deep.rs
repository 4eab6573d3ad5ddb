//! Merges deep OpenEXR files of one frame, and lays the result flat:
//! `merge_deep [--flat=FLAT.exr] A.exr B.exr … OUT.exr`.

use std::io::BufWriter;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use veduta_io::deep_exr::{DeepWriter, merge, read_deep};
use veduta_io::write_picture;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("merge_deep: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let (mut places, mut flat): (Vec<PathBuf>, _) = (Vec::new(), None);
    for argument in std::env::args_os().skip(1) {
        match argument
            .to_str()
            .and_then(|text| text.strip_prefix("--flat="))
        {
            Some(place) => flat = Some(PathBuf::from(place)),
            None => places.push(argument.into()),
        }
    }
    let Some((out, inputs)) = places.split_last().filter(|(_, inputs)| !inputs.is_empty()) else {
        return Err("usage: merge_deep [--flat=FLAT.exr] A.exr … OUT.exr".into());
    };
    let begin = Instant::now();
    let images = inputs.iter().map(|place| read_deep(place));
    let images: Vec<_> = images.collect::<Result<_, _>>()?;
    println!("read      {:?}", begin.elapsed());

    let begin = Instant::now();
    let merged = merge(&images.iter().collect::<Vec<_>>())?;
    println!("merged    {:?}", begin.elapsed());

    let begin = Instant::now();
    let file = BufWriter::new(std::fs::File::create(out)?);
    let mut writer = DeepWriter::new(file, merged.header.clone())?;
    writer.write(&merged.pixels)?;
    writer.finish()?;
    println!("written   {:?}", begin.elapsed());

    if let Some(place) = flat {
        let begin = Instant::now();
        let picture = merged.flatten()?;
        println!("laid flat {:?}", begin.elapsed());
        write_picture(&place, &picture, &Default::default())?;
    }
    Ok(())
}
