//! Vector pictures, read again by readers of XML and JSON.

use crate::OneFile;
use roxmltree::{Document, Node};
use serde_json::Value;
use std::collections::BTreeSet;
use veduta::drawing::{
    Chain, Drawing, Evenness, Group, LineKind, Rim, Shape, Stroke, Underpainting, Veil,
};
use veduta::map::{MaterialId, ObjectId};
use veduta_geometry::{DVec2, signed_area};
use veduta_io::{VectorFormat, VectorOptions, stream_drawing, write_drawing};

/// The square with opposite corners in (min, min) and (max, max).
fn square(min: f64, max: f64) -> Vec<DVec2> {
    [[min, min], [max, min], [max, max], [min, max]]
        .map(DVec2::from)
        .to_vec()
}

/// Names that are hard to write, twice the same one, a frame with a hole, a triangle, and lines.
fn drawing() -> Drawing {
    let group = |name: &str, parent, shapes| Group {
        name: name.to_owned(),
        parent,
        shapes,
    };
    let shape = |group, outlines: Vec<Vec<DVec2>>, radiance| Shape {
        group,
        object: ObjectId(0),
        material: MaterialId(0),
        faces: 2,
        radiance,
        evenness: Evenness::Even,
        seen: outlines.clone(),
        painted: outlines,
        nearest: 1.5,
        farthest: 2.0,
    };
    let mut hole = square(2.5, 7.125);
    hole.reverse();
    let triangle = [[0.1234, 0.0], [9.0, 1.0], [3.0, 8.5]].map(DVec2::from);
    let stroke = |kind, closed| Stroke {
        kind,
        points: square(1.0, 2.0),
        closed,
    };
    let chain = |closed| Chain {
        points: square(0.25, 9.5),
        closed,
    };
    Drawing {
        underpainting: Some(Underpainting {
            outline: Some(vec![square(0.25, 9.5)]),
            radiance: [0.0, 1.0, 0.0],
            rims: vec![Rim {
                radiance: [1.0, 0.0, 0.0],
                chains: vec![chain(false), chain(true), chain(false)],
            }],
            rim_width: 3.0,
        }),
        size: [20.0, 10.0],
        groups: vec![
            group("town", None, 0..0),
            group("a & <b> \"c\" 'd'\u{7}", Some(0), 0..1),
            group("7 dwarfs", Some(1), 1..1),
            group("town", Some(0), 1..2),
            group("lines", None, 2..2),
        ],
        shapes: vec![
            shape(1, vec![square(0.5, 9.5), hole], [1.0, 0.25, 0.0]),
            shape(3, vec![triangle.to_vec()], [1.0; 3]),
        ],
        veils: vec![Veil {
            object: ObjectId(1),
            name: "town/window".to_owned(),
            material: MaterialId(0),
            radiance: [0.0, 0.0, 1.0],
            opacity: 0.25,
            evenness: Evenness::Even,
            outlines: vec![square(4.0, 6.0)],
        }],
        strokes: vec![
            stroke(LineKind::Hidden, false),
            stroke(LineKind::Silhouette, true),
            stroke(LineKind::Crease, false),
        ],
        material_names: vec!["brick \"red\"".to_owned()],
    }
}

fn encoded(suffix: &str, options: &VectorOptions) -> Vec<u8> {
    let format = VectorFormat::of_suffix(suffix).expect("a format");
    let mut bytes = Vec::new();
    stream_drawing(&mut bytes, format, &drawing(), options).expect("memory takes all");
    bytes
}

/// The rings of a path's data, which has the commands `m`, `l`, `h`, `v` and `z` only.
fn rings(path: &str) -> Vec<Vec<DVec2>> {
    let mut numbers = Vec::new();
    let mut rings: Vec<Vec<DVec2>> = Vec::new();
    let (mut command, mut at) = ('z', DVec2::ZERO);
    let mut rest = path;
    while let Some(c) = rest.chars().next() {
        if c.is_ascii_alphabetic() {
            command = c;
            rest = &rest[1..];
            if c == 'z' {
                at = rings[rings.len() - 1][0];
            }
            continue;
        }
        let number = rest.trim_start();
        let end = number[1..].find(|c: char| c != '.' && !c.is_ascii_digit());
        let (number, after) = number.split_at(end.map_or(number.len(), |end| end + 1));
        numbers.push(number.parse::<f64>().expect(number));
        rest = after;
        let step = match (command, &numbers[..]) {
            ('h', &[x]) => DVec2::new(x, 0.0),
            ('v', &[y]) => DVec2::new(0.0, y),
            ('m' | 'l', &[x, y]) => DVec2::new(x, y),
            _ => continue,
        };
        numbers.clear();
        at += step;
        if command == 'm' {
            rings.push(Vec::new());
            command = 'l';
        }
        rings.last_mut().expect("a path begins with m").push(at);
    }
    assert!(numbers.is_empty(), "{path}");
    rings
}

fn title_of<'a>(node: Node<'a, '_>) -> &'a str {
    let title = node.children().find(|child| child.has_tag_name("title"));
    title.and_then(|title| title.text()).unwrap_or_default()
}

#[test]
fn an_svg_holds_groups_with_names_and_paths_with_the_outlines() {
    let options = VectorOptions {
        title: "1 < 2".to_owned(),
        background: Some([0.0, 0.0, 1.0]),
        line_width: 0.5,
        ..VectorOptions::default()
    };
    let text = String::from_utf8(encoded("svg", &options)).expect("text");
    let document = Document::parse(&text).expect("XML");
    let svg = document.root_element();
    assert_eq!(
        svg.tag_name().namespace(),
        Some("http://www.w3.org/2000/svg")
    );
    assert_eq!(
        (svg.attribute("viewBox"), title_of(svg)),
        (Some("0 0 2000 1000"), "1 < 2")
    );
    let groups: Vec<Node> = document
        .descendants()
        .filter(|n| n.has_tag_name("g"))
        .collect();
    let names: Vec<&str> = groups.iter().map(|&group| title_of(group)).collect();
    let hard = "a & <b> \"c\" 'd'\u{fffd}";
    assert_eq!(
        names,
        [
            "",
            "underpainting",
            "",
            "town",
            hard,
            "7 dwarfs",
            "town",
            "lines",
            "veils",
            "town/window",
            "",
            "hidden",
            "silhouettes",
            "creases"
        ]
    );
    let ids: Vec<&str> = groups
        .iter()
        .filter_map(|group| group.attribute("id"))
        .collect();
    assert_eq!(
        ids[..6],
        [
            "underpainting",
            "town",
            "a_b_c_d_",
            "_7_dwarfs",
            "town-2",
            "lines"
        ]
    );
    let different: BTreeSet<&&str> = ids.iter().collect();
    // All but those of what is masked and of the rims have one.
    assert_eq!(different.len(), groups.len() - 2, "{ids:?}");
    let depth = |node: &Node| node.ancestors().filter(|n| n.has_tag_name("g")).count();
    assert_eq!(
        groups.iter().map(depth).collect::<Vec<_>>(),
        [1, 2, 3, 2, 3, 4, 3, 2, 1, 2, 1, 2, 2, 2]
    );

    let paths: Vec<Node> = document
        .descendants()
        .filter(|n| n.has_tag_name("path"))
        .collect();
    let fills: Vec<_> = paths.iter().map(|path| path.attribute("fill")).collect();
    assert_eq!(
        fills,
        [
            Some("#fff"),
            None,
            Some("#ff8900"),
            Some("#fff"),
            Some("#00f"),
            None,
            None,
            None
        ],
        "the mask first, then rims, shapes, veils, lines"
    );
    assert_eq!(groups[0].attribute("mask"), Some("url(#outline)"));
    assert_eq!(groups[2].attribute("stroke-width"), Some("300"));
    let data = |index: usize| paths[index].attribute("d").expect("a path has data");
    let mut rims = rings(data(1));
    let expected = square(25.0, 950.0);
    // One is closed, and begins where that is shortest to write.
    let first = rims[1].iter().position(|point| *point == expected[0]);
    rims[1].rotate_left(first.expect("it has that corner"));
    assert_eq!(rims, [&expected[..]; 3], "{}", data(1));
    assert_eq!(data(1).matches('z').count(), 1);
    for (index, shape) in drawing().shapes.iter().enumerate() {
        let found = rings(data(index + 2));
        assert_eq!(found.len(), shape.painted.len());
        for (found, outline) in found.iter().zip(&shape.painted) {
            // Hundredths of a pixel.
            let off = (signed_area(found) / 1e4 - signed_area(outline)).abs();
            assert!(off < 0.01 * 40.0, "{found:?} and not {outline:?}");
        }
    }
    assert!(
        !data(5).ends_with('z') && data(6).ends_with('z') && !data(7).ends_with('z'),
        "one is closed"
    );
    assert_eq!(paths[4].attribute("fill-opacity"), Some(".25"));
    let dashes = groups.iter().map(|group| {
        let of = |name| group.attribute(name);
        (of("stroke-width"), of("stroke-dasharray"))
    });
    let dashes: Vec<_> = dashes.skip(10).collect();
    assert_eq!(
        dashes,
        [
            (Some("50"), None),
            (Some("25"), Some("300 75")),
            (None, None),
            (None, None)
        ]
    );
    let rectangles = document.descendants().filter(|n| n.has_tag_name("rect"));
    let fills: Vec<_> = rectangles.map(|rect| rect.attribute("fill")).collect();
    assert_eq!(fills, [Some("#00f"), Some("#0f0")], "background, ground");
}

#[test]
fn fewer_decimals_make_smaller_files() {
    let size = |decimals| {
        let options = VectorOptions {
            decimals,
            ..VectorOptions::default()
        };
        encoded("svg", &options).len()
    };
    assert!(size(0) < size(1) && size(1) < size(3));
}

#[test]
fn a_pdf_has_a_layer_for_each_group() {
    let bytes = encoded("pdf", &VectorOptions::default());
    assert!(bytes.starts_with(b"%PDF-1.7") && bytes.ends_with(b"%%EOF"));
    let find = |what: &[u8]| bytes.windows(what.len()).position(|found| found == what);
    // Of the page, of what is masked, and of the mask.
    let starts = bytes.windows(8).enumerate();
    let starts = starts.filter(|(_, found)| found == b"\nstream\n");
    let contents: Vec<String> = starts
        .map(|(at, found)| {
            let bytes = &bytes[at + found.len()..];
            let text = miniz_oxide::inflate::decompress_to_vec_zlib(bytes).expect("Deflate");
            String::from_utf8(text).expect("text")
        })
        .collect();
    assert_eq!(contents.len(), 3);
    assert!(contents[0].contains("q /Outline gs /Opaque Do Q\n"));
    let content = contents.concat();
    let words = || content.split_ascii_whitespace();
    let count = |what: &str| words().filter(|word| *word == what).count();
    // Five groups, the veils and their object, the lines, and three kinds of them.
    assert_eq!((count("BDC"), count("EMC")), (11, 11));
    assert_eq!((count("m"), count("h"), count("f")), (11, 5, 5));
    assert_eq!((count("s"), count("S")), (2, 4));
    assert!(content.contains("q 0.5 w 0 J [6 1.5] 0 d\n"), "dashes");
    assert_eq!((count("q"), count("Q")), (4, 4));
    assert_eq!(count("/A250"), 1, "opacity");
    for what in [
        "/OCProperties",
        "/Type /OCG",
        "/G7 16 0 R",
        "/ca 0.25",
        "/S /Alpha",
        "/S /Transparency",
        "/MediaBox [0 0 15 7.5]",
    ] {
        assert!(find(what.as_bytes()).is_some(), "{what}");
    }
    assert_eq!(
        bytes,
        encoded("pdf", &VectorOptions::default()),
        "the same bytes"
    );
}

#[test]
fn geojson_has_polygons_with_holes_and_says_what_they_are() {
    // The hole's corners have three decimals.
    let options = VectorOptions {
        decimals: 3,
        ..VectorOptions::default()
    };
    let text = encoded("geojson", &options);
    let json: Value = serde_json::from_slice(&text).expect("JSON");
    let features = json["features"].as_array().expect("features");
    assert_eq!(features.len(), 3);
    assert_eq!(features[2]["properties"]["opacity"], 0.25);
    let properties = &features[0]["properties"];
    assert_eq!(properties["object"], "town/a & <b> \"c\" 'd'\u{7}");
    assert_eq!(properties["material"], "brick \"red\"");
    assert_eq!(
        (&properties["color"], &properties["faces"]),
        (&"#ff8900".into(), &2.into())
    );
    let polygons = features[0]["geometry"]["coordinates"]
        .as_array()
        .expect("polygons");
    let rings: Vec<Vec<DVec2>> = polygons[0]
        .as_array()
        .expect("rings")
        .iter()
        .map(|ring| {
            let positions = ring.as_array().expect("positions");
            let number = |at: &Value, axis: usize| at[axis].as_f64().expect("a number");
            let point = |at: &Value| DVec2::new(number(at, 0), number(at, 1));
            positions.iter().map(point).collect()
        })
        .collect();
    // Counterclockwise around, with y upwards; the hole clockwise; both closed.
    assert!((signed_area(&rings[0]) - 81.0).abs() < 1e-9);
    assert!((signed_area(&rings[1]) + 4.625 * 4.625).abs() < 1e-9);
    assert!(rings.iter().all(|ring| ring.first() == ring.last()));
    assert!(rings[0].contains(&DVec2::new(0.5, 9.5)), "{:?}", rings[0]);
}

#[test]
fn a_drawing_that_cannot_be_written_says_where() {
    let file = OneFile::new("no-folder/a.svg");
    let format = VectorFormat::of(&file.path).expect("a format");
    let error = write_drawing(&file.path, format, &drawing(), &VectorOptions::default());
    let message = error.expect_err("there is no folder").to_string();
    assert!(message.contains("a.svg: cannot be written"), "{message}");
}
