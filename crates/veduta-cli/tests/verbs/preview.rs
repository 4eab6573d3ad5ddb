use crate::{FACING, Folder, png};

/// What a terminal shows of half blocks: pixels, `None` where nothing is drawn.
fn decode_blocks(text: &str) -> Vec<Vec<Option<[u8; 3]>>> {
    let mut rows = Vec::new();
    for line in text.lines() {
        let (mut upper, mut lower) = (Vec::new(), Vec::new());
        let [mut front, mut back] = [None; 2];
        let mut rest = line;
        while let Some(c) = rest.chars().next() {
            if let Some(sequence) = rest.strip_prefix("\x1b[") {
                let (codes, after) = sequence.split_once('m').expect("a sequence ends");
                let codes: Vec<u8> = codes
                    .split(';')
                    .map(|code| code.parse().expect("a number"))
                    .collect();
                match codes[..] {
                    [0] => [front, back] = [None; 2],
                    [38, 2, r, g, b] => front = Some([r, g, b]),
                    [48, 2, r, g, b] => back = Some([r, g, b]),
                    _ => panic!("{codes:?}"),
                }
                rest = after;
                continue;
            }
            let [up, low] = match c {
                '▀' => [front, back],
                '▄' => [back, front],
                ' ' => [back; 2],
                other => panic!("{other:?}"),
            };
            upper.push(up);
            lower.push(low);
            rest = &rest[c.len_utf8()..];
        }
        rows.push(upper);
        rows.push(lower);
    }
    rows
}

#[test]
fn half_blocks_are_the_picture() {
    let folder = Folder::new();
    let output = folder
        .veduta(&format!(
            "render town.obj {FACING} --unlit --preview=blocks"
        ))
        .env("COLORTERM", "truecolor")
        .assert()
        .success()
        .stderr("");
    let text = String::from_utf8(output.get_output().stdout.clone()).expect("text");
    let shown = decode_blocks(&text);
    folder.told(&format!("render town.obj {FACING} --unlit -o a.png"));
    let (width, height, pixels) = png(&folder.read("a.png"));
    assert_eq!(shown.len(), height);
    for (row, pixels) in shown.iter().zip(pixels.chunks(width)) {
        let expected: Vec<_> = pixels
            .iter()
            .map(|&[r, g, b, alpha]| (alpha > 127).then_some([r, g, b]))
            .collect();
        assert_eq!(*row, expected);
    }
}

#[test]
fn in_a_pipe_only_what_is_forced_is_shown() {
    let folder = Folder::new();
    let render = format!("render town.obj {FACING} --unlit");
    assert_eq!(folder.told(&format!("{render} --preview")), "");
    assert_eq!(
        folder.told(&format!("{render} --preview=auto -o a.png")),
        ""
    );
    assert!(
        folder
            .told(&format!("{render} --preview=kitty"))
            .starts_with("\x1b_Ga=T,f=100")
    );
    assert!(
        folder
            .told(&format!("{render} --preview=sixel"))
            .starts_with("\x1bP0;1q\"1;1;8;8")
    );
    // With a picture beside it.
    let shown = folder.told(&format!("{render} --preview=blocks -o b.png"));
    assert!(shown.contains('▀') && folder.path("b.png").exists());
    folder
        .veduta(&format!("{render} --preview=ascii"))
        .assert()
        .code(2);
}

#[test]
fn a_large_picture_is_previewed_small() {
    let folder = Folder::new();
    let shown = folder.told("render town.obj --size 4000x1000 --preview=blocks");
    let columns = shown.lines().map(|line| {
        let drawn = line.chars().filter(|c| ['▀', '▄', ' '].contains(c));
        drawn.count()
    });
    assert_eq!(columns.max(), Some(80));
    assert_eq!(shown.lines().count(), 10);
}
