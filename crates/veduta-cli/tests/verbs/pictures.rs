use crate::{FACING, Folder, png};

/// What `diff` says of two pictures.
fn difference(folder: &Folder, a: &str, b: &str, more: &str) -> serde_json::Value {
    folder.json(&format!("diff {a} {b} --tolerance 10 {more}"))
}

#[test]
fn every_format_holds_the_same_picture() {
    let folder = Folder::new();
    let render = format!("render town.obj {FACING} --unlit --background #336699");
    for output in [
        "a.png",
        "b.png --depth 16",
        "c.tif",
        "d.tiff --depth 16",
        "e.tif --depth float",
        "f.webp",
        "g.jpg --quality 100",
        "h.exr",
        "i.exr --depth half --tile 4 --compression piz",
        "j.pfm",
        "k.npy",
    ] {
        folder.told(&format!("{render} -o {output}"));
        let name = output.split(' ').next().expect("a name");
        let found = difference(&folder, "a.png", name, "");
        let largest = found["max"].as_f64().unwrap_or(0.0);
        // Half a step of 8 bits, in light a step at its steepest; a JPEG blurs edges of colour.
        let most = match name {
            "g.jpg" => 0.05,
            _ if found["space"] == "sRGB" => 0.5 / 255.0 + 1e-6,
            _ => 2.3 * 0.5 / 255.0 + 1e-4,
        };
        assert!(largest <= most, "{output}: {found}");
    }
}

#[test]
fn what_is_linear_is_left_as_it_is_unless_asked() {
    let folder = Folder::new();
    // Lit: a picture for a display is exposed and toned, one for further work is not.
    let render = format!("render town.obj {FACING}");
    for (output, exposed) in [
        ("a.png", true),
        ("a.jpg", true),
        ("a.tif", true),
        ("a.webp", true),
        ("a.tif --depth float", false),
        ("a.exr", false),
        ("a.pfm", false),
        ("a.npy", false),
    ] {
        let made = folder.json(&format!("{render} -o {output}"));
        let exposure = made["exposure"].as_f64().expect("an exposure");
        assert_eq!(exposure != 0.0, exposed, "{output}: {exposure}");
    }
    folder.told(&format!("{render} -o once.npy"));
    folder.told(&format!("{render} -o twice.npy --exposure 1"));
    let [once, twice] = ["once.npy", "twice.npy"].map(|name| folder.json(&format!("info {name}")));
    for channel in 0..3 {
        let [once, twice] =
            [&once, &twice].map(|told| told["max"][channel].as_f64().expect("a number"));
        assert_eq!(2.0 * once, twice);
    }
}

#[test]
fn a_jpeg_is_on_white_or_on_the_background() {
    let folder = Folder::new();
    for (background, expected) in [("none", 1.0), ("#000", 0.0)] {
        let render = format!("render town.obj {FACING} --unlit --background {background}");
        folder.told(&format!("{render} -o a.jpg --quality 100"));
        let found = folder.json("info a.jpg");
        // Red and blue leave no pixel of green, so that green comes from the background alone.
        let green = found["mean"][1].as_f64().expect("a number");
        assert!(
            (green - 0.75 * expected).abs() < 0.02,
            "{background}: {green}"
        );
    }
}

#[test]
fn a_picture_as_background_is_scaled_to_the_frame_in_linear_light() {
    let folder = Folder::new();
    let render = format!("render town.obj {FACING} --unlit");
    // A background of one colour, in another size and format.
    let wall = "--eye 0.5,-5,0.5 --look-at 0.5,0,0.5 --parallel 0.1";
    folder.told(&format!(
        "render town.obj {wall} --size 3x5 --unlit -o red.webp"
    ));
    folder.told(&format!("{render} --background red.webp -o a.png"));
    folder.told(&format!("{render} --background #ff0000 -o b.png"));
    assert_eq!(difference(&folder, "a.png", "b.png", "")["differing"], 0);

    // Black and white in turn become half the light, which is more than half of sRGB.
    let mut pfm = b"PF\n16 16\n-1\n".to_vec();
    for index in 0..256 {
        let light = ((index + index / 16) % 2) as f32;
        pfm.extend([light; 3].into_iter().flat_map(f32::to_le_bytes));
    }
    folder.write("checks.pfm", pfm);
    folder.told(&format!("{render} --background checks.pfm -o c.png"));
    let (_, _, pixels) = png(&folder.read("c.png"));
    assert_eq!(pixels[3 * 8 + 1], [188, 188, 188, 255]);

    folder
        .veduta(&format!("{render} --background gone.jpg -o d.png"))
        .assert()
        .code(6);
    folder.write("broken.png", "no picture");
    folder
        .veduta(&format!("{render} --background broken.png -o d.png"))
        .assert()
        .code(4);
    assert!(!folder.path("d.png").exists());
}

/// Outputs that make no sense: exit code 2, and what the message holds.
const SENSELESS: &[(&str, &str)] = &[
    ("", "--output <FILE>"),
    (
        "-o a.png --depth half",
        "a.png: a picture of that format is stored as 8 bits or 16 bits, not as half floats",
    ),
    ("-o a.jpg --depth 16", "stored as 8 bits"),
    ("-o a.exr --depth 8", "stored as floats or half floats"),
    ("-o a.png --quality 50", "--quality is for .jpg"),
    ("-o a.jpg --quality 0", "--quality"),
    (
        "-o a.tif --tile 64",
        "--compression and --tile are for .exr",
    ),
    ("-o a.exr --tile 0", "--tile"),
    ("-o a.png --aov depth", "--aov is for .exr"),
    ("-o a.exr --aov deph", "'depth'"),
    ("-o a.exr --crypto-ranks 4", "--aov"),
    ("-o a.png --format gif", "expected one of png, jpg"),
    ("-o a.webp --size 16385x1", "at most 16384 pixels a side"),
    ("-o - --json", "both write to stdout"),
    ("-o - --preview", "both write to stdout"),
    ("--preview --json", "cannot be used with"),
];

#[test]
fn outputs_that_make_no_sense_are_refused_before_the_work() {
    let folder = Folder::new();
    let before = folder.files();
    for (arguments, message) in SENSELESS {
        let output = folder
            .veduta(&format!("render town.obj {arguments}"))
            .assert()
            .code(2)
            .stdout("");
        let stderr = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
        assert!(stderr.contains(message), "{arguments}: {stderr}");
    }
    assert_eq!(folder.files(), before);
}

#[test]
fn a_format_that_is_told_wins_over_the_suffix() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o picture --format png"));
    assert_eq!(png(&folder.read("picture")).0, 8);
}

#[test]
fn further_channels_lie_beside_the_same_picture() {
    let folder = Folder::new();
    let render = format!("render town.obj {FACING}");
    folder.told(&format!("{render} -o plain.exr"));
    let layers =
        "--aov depth,normal,position,albedo,object,material,face,crypto-object,crypto-material";
    for more in ["", "--depth half --tile 4 --compression piz"] {
        folder.told(&format!("{render} {layers} {more} -o layers.exr"));
        let found = difference(&folder, "plain.exr", "layers.exr", "");
        // No number where nothing differs.
        assert!(found["max"].as_f64().unwrap_or(0.0) < 1e-3, "{found}");
    }
    let told = folder.json("info layers.exr");
    let beside = told["furtherChannels"].as_array().expect("a list");
    assert_eq!(beside.len(), 1 + 3 + 3 + 3 + 3 + 12 + 12, "{told}");
    assert!(
        folder
            .told("info layers.exr")
            .contains("N.X, N.Y, N.Z, P.X")
    );
    let streamed = folder
        .veduta(&format!("{render} {layers} --format exr -o -"))
        .assert()
        .success();
    folder.told(&format!("{render} {layers} -o file.exr"));
    assert!(streamed.get_output().stdout == folder.read("file.exr"));
}

#[test]
fn a_cryptomatte_with_too_few_ranks_is_told() {
    let folder = Folder::new();
    // Three layers of paper, the upper ones smaller, all seen in one pixel.
    let sheet = |name: &str, half: f64, z: f64, first: usize| {
        let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
        let vertices = corners.map(|(x, y)| format!("v {x} {y} {z}\n")).concat();
        let face = [0, 1, 2, 3]
            .map(|corner| format!(" {}", first + corner))
            .concat();
        format!("o {name}\n{vertices}f{face}\n")
    };
    let model = [
        sheet("a", 1.0, 0.0, 1),
        sheet("b", 0.5, 1.0, 5),
        sheet("c", 0.25, 2.0, 9),
    ];
    folder.write("sheets.obj", model.concat());
    let view = "--eye 0,-9,0 --look-at 0,0,0 --parallel 4 --size 1x1";
    let render = format!("render sheets.obj {view} -o a.exr --aov crypto-object");
    let quiet = folder.veduta(&render).assert().success();
    assert!(quiet.get_output().stderr.is_empty());
    let told = folder
        .veduta(&format!("{render} --crypto-ranks 1"))
        .assert()
        .success();
    let stderr = String::from_utf8_lossy(&told.get_output().stderr).into_owned();
    let expected = "a pixel shows up to 3 names, and the Cryptomatte tells the 2 largest; \
        --crypto-ranks 3 tells more";
    assert!(stderr.contains(expected), "{stderr}");
    folder
        .veduta(&format!("{render} --crypto-ranks 2 --strict"))
        .assert()
        .code(5);
}

#[test]
fn a_stored_map_has_the_same_channels() {
    let folder = Folder::new();
    let layers = "--aov depth,object,crypto-object";
    folder.told(&format!("render town.obj {FACING} -o kept.veduta"));
    folder.told(&format!("shade kept.veduta {layers} -o shaded.exr"));
    folder.told(&format!(
        "render town.obj {FACING} {layers} -o rendered.exr"
    ));
    let [shaded, rendered] = ["shaded", "rendered"]
        .map(|name| folder.json(&format!("info {name}.exr"))["furtherChannels"].clone());
    assert_eq!(shaded, rendered);
    assert_eq!(
        difference(&folder, "shaded.exr", "rendered.exr", "")["differing"],
        0
    );
    folder.told(&format!("composite kept.veduta {layers} -o composite.exr"));
    for (arguments, message) in [
        (
            "render town.obj -o a.veduta --aov depth",
            "--aov and --deep are not for .veduta",
        ),
        (
            "composite kept.veduta -o a.veduta --aov depth",
            "--aov is not for .veduta",
        ),
        (
            "shade kept.veduta -o a.exr --aov face --window 0,0,2,2",
            "leave --window out, or ask for --aov crypto-object",
        ),
    ] {
        let refused = folder.veduta(arguments).assert().code(2);
        let stderr = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(stderr.contains(message), "{arguments}: {stderr}");
    }
    folder.told("shade kept.veduta -o a.exr --aov crypto-object --window 0,0,2,2");
}

#[test]
fn vector_pictures_have_a_shape_for_each_surface_in_the_pixels_colour() {
    let folder = Folder::new();
    let render = format!("render town.obj {FACING}");
    folder.told(&format!("{render} -o a.png"));
    let made = folder.json(&format!("{render} -o a.svg --lines silhouette"));
    assert_eq!(
        (&made["shapes"], &made["meanShapes"]),
        (&2.into(), &0.into())
    );
    assert!(made["lines"].as_u64() > Some(0));
    let svg = String::from_utf8(folder.read("a.svg")).expect("text");
    let (width, _, pixels) = png(&folder.read("a.png"));
    // Within the wall, and within the box that stands before its lower left quarter.
    for (name, [x, y]) in [("wall", [5, 2]), ("box", [2, 5])] {
        let [r, g, b, _] = pixels[y * width + x];
        let long = format!("#{r:02x}{g:02x}{b:02x}");
        let group = &svg[svg.find(&format!("<title>{name}</title>")).expect(name)..];
        let fill = group.split('"').nth(1).expect("a fill");
        let digits: Vec<char> = fill.chars().skip(1).collect();
        let told = match digits.len() {
            3 => format!(
                "#{}",
                digits.iter().flat_map(|d| [d, d]).collect::<String>()
            ),
            _ => fill.to_owned(),
        };
        assert_eq!(told, long, "{name}");
    }
    for name in ["a.pdf", "a.geojson", "a.veduta"] {
        folder.told(&format!("{render} -o {name}"));
    }
    folder.told("shade a.veduta -o b.svg --lines silhouette");
    let [one, other] = ["a.svg", "b.svg"].map(|name| {
        let svg = String::from_utf8(folder.read(name)).expect("text");
        svg.lines().skip(2).collect::<Vec<_>>().join("\n")
    });
    assert_eq!(one, other, "all but the title");
    let piped = folder.veduta(&format!("{render} -o - --format svg --lines silhouette"));
    let piped = { piped }.assert().success().get_output().stdout.clone();
    assert_eq!(piped, folder.read("a.svg"));
}

#[test]
fn options_of_pixels_and_of_vector_pictures_are_not_mixed() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o sky.png"));
    for (arguments, message) in [
        ("-o a.png --lines crease", "--lines is for vector pictures"),
        ("-o a.svg --depth 16", "--depth is for pictures of pixels"),
        ("-o a.svg --fill none", "leaves nothing to draw"),
        (
            "-o a.geojson --lines crease",
            "--lines is for .svg and .pdf",
        ),
        ("-o a.geojson --trap 1", "--trap is for .svg and .pdf"),
        (
            "-o a.png --hidden-spacing 1px",
            "--hidden-spacing is for vector pictures",
        ),
        (
            "-o a.svg --lines crease --hidden-behind 1",
            "--hidden-behind is for hidden lines",
        ),
        ("-o a.svg --sampling multiscan:3", "leave --sampling out"),
        ("-o a.svg --background sky.png", "background of one colour"),
    ] {
        let failed = folder.veduta(&format!("render town.obj {FACING} {arguments}"));
        let failed = { failed }.assert().code(2);
        let told = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
        assert!(told.contains(message), "{arguments}: {told}");
        assert!(!folder.path("a.svg").exists());
    }
}
