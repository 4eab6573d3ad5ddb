use super::outline::{Point, Rounding};
use super::{VectorOptions, hidden_line, name_of_lines, srgb8, thousandths};
use std::collections::HashSet;
use std::fmt::Write;
use veduta::drawing::{Chain, Drawing, LineKind, Rim, Underpainting};
use veduta_geometry::DVec2;

/// SVG text. Groups nest as names do; a path is a shape, in relative coordinates.
///
/// Coordinates are whole numbers of the last decimal, which the `viewBox` scales to pixels: a decimal point in
/// each of them would make files a seventh larger.
pub fn encode(drawing: &Drawing, options: &VectorOptions) -> String {
    let mut svg = Svg {
        text: String::new(),
        rounding: Rounding::new(options.decimals),
        ids: HashSet::new(),
    };
    svg.document(drawing, options);
    svg.text
}

struct Svg {
    text: String,
    rounding: Rounding,
    /// Those given so far; only looked up in.
    ids: HashSet<String>,
}

impl Svg {
    fn document(&mut self, drawing: &Drawing, options: &VectorOptions) {
        let [width, height] = drawing.size;
        let [right, bottom] = drawing.size.map(|side| self.rounding.units(side));
        self.push(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {right} {bottom}\">\n"
        ));
        if !options.title.is_empty() {
            self.title(&options.title);
        }
        if let Some(color) = options.background {
            let color = Color(srgb8(color));
            self.push(format_args!(
                "<rect width=\"{right}\" height=\"{bottom}\" fill=\"{color}\"/>\n"
            ));
        }
        let beneath = drawing.underpainting.as_ref();
        if let Some(outline) = beneath.and_then(|beneath| beneath.outline.as_ref()) {
            // Not a clip path: several viewers clip what lies within piece by piece, and show the outlines too
            // opaque.
            let id = self.id("outline");
            self.push(format_args!(
                "<mask id=\"{id}\" maskUnits=\"userSpaceOnUse\" x=\"0\" y=\"0\" \
                 width=\"{right}\" height=\"{bottom}\">"
            ));
            self.shape(outline, [1.0; 3]);
            self.push(format_args!("</mask>\n<g mask=\"url(#{id})\">\n"));
            self.opaque(drawing);
            self.text.push_str("</g>\n");
        } else {
            self.opaque(drawing);
        }
        if !drawing.veils.is_empty() {
            self.veils(drawing);
        }
        if !drawing.strokes.is_empty() {
            self.lines(drawing, options);
        }
        self.text.push_str("</svg>\n");
    }

    fn opaque(&mut self, drawing: &Drawing) {
        if let Some(underpainting) = &drawing.underpainting {
            self.underpainting(drawing.size, underpainting);
        }
        self.groups(drawing);
    }

    fn underpainting(&mut self, size: [f64; 2], underpainting: &Underpainting) {
        self.begin_group("underpainting");
        let [right, bottom] = size.map(|side| self.rounding.units(side));
        let color = Color(srgb8(underpainting.radiance));
        self.push(format_args!(
            "<rect width=\"{right}\" height=\"{bottom}\" fill=\"{color}\"/>\n"
        ));
        let width = self.rounding.units(underpainting.rim_width);
        self.push(format_args!(
            "<g fill=\"none\" stroke-width=\"{width}\" stroke-linecap=\"round\" \
             stroke-linejoin=\"round\">\n"
        ));
        for Rim { radiance, chains } in &underpainting.rims {
            let color = Color(srgb8(*radiance));
            self.push(format_args!("<path stroke=\"{color}\" d=\""));
            // Relative to where the one before ended, or began if it is closed.
            let mut start = [0, 0];
            for Chain { points, closed } in chains {
                if let Some(chain) = self.rounding.line(points, *closed) {
                    start = self.path_from(start, &[chain], *closed);
                }
            }
            self.text.push_str("\"/>\n");
        }
        self.text.push_str("</g>\n</g>\n");
    }

    fn groups(&mut self, drawing: &Drawing) {
        // Groups that are open, the outermost first.
        let mut open: Vec<u32> = Vec::new();
        for (index, group) in (0u32..).zip(&drawing.groups) {
            while open.last().copied() != group.parent {
                open.pop();
                self.text.push_str("</g>\n");
            }
            open.push(index);
            self.begin_group(&group.name);
            for shape in &drawing.shapes[group.shapes.clone()] {
                self.shape(&shape.painted, shape.radiance);
            }
        }
        for _ in open {
            self.text.push_str("</g>\n");
        }
    }

    fn shape(&mut self, outlines: &[Vec<DVec2>], radiance: [f32; 3]) {
        let rings = self.rounding.rings(outlines);
        if !rings.is_empty() {
            let color = Color(srgb8(radiance));
            self.push(format_args!("<path fill=\"{color}\" d=\""));
            self.path(&rings, true);
            self.text.push_str("\"/>\n");
        }
    }

    /// In groups for each stretch of one object: their order is that of depth.
    fn veils(&mut self, drawing: &Drawing) {
        self.begin_group("veils");
        for of_object in drawing.veils.chunk_by(|a, b| a.object == b.object) {
            self.begin_group(&of_object[0].name);
            for veil in of_object {
                let rings = self.rounding.rings(&veil.outlines);
                if !rings.is_empty() {
                    let color = Color(srgb8(veil.radiance));
                    let opacity = thousandths(veil.opacity);
                    self.push(format_args!("<path fill=\"{color}\" fill-opacity=\""));
                    Rounding::new(3).push(&mut self.text, opacity);
                    self.text.push_str("\" d=\"");
                    self.path(&rings, true);
                    self.text.push_str("\"/>\n");
                }
            }
            self.text.push_str("</g>\n");
        }
        self.text.push_str("</g>\n");
    }

    fn lines(&mut self, drawing: &Drawing, options: &VectorOptions) {
        let id = self.id("lines");
        let color = Color(srgb8(options.line_color));
        let width = self.rounding.units(options.line_width);
        self.push(format_args!(
            "<g id=\"{id}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" \
             stroke-linecap=\"round\" stroke-linejoin=\"round\">\n"
        ));
        for strokes in drawing.strokes.chunk_by(|a, b| a.kind == b.kind) {
            let name = name_of_lines(strokes[0].kind);
            if strokes[0].kind == LineKind::Hidden {
                let id = self.id(name);
                let [narrow, dash, gap] = hidden_line(options.line_width);
                let [narrow, dash, gap] =
                    [narrow, dash, gap].map(|length| self.rounding.units(length));
                self.push(format_args!(
                    "<g id=\"{id}\" stroke-width=\"{narrow}\" stroke-dasharray=\"{dash} {gap}\" \
                     stroke-linecap=\"butt\">"
                ));
                self.title(name);
            } else {
                self.begin_group(name);
            }
            for stroke in strokes {
                if let Some((chain, closed)) = self.rounding.stroke(&stroke.points, stroke.closed) {
                    self.text.push_str("<path d=\"");
                    self.path(&[chain], closed);
                    self.text.push_str("\"/>\n");
                }
            }
            self.text.push_str("</g>\n");
        }
        self.text.push_str("</g>\n");
    }

    fn begin_group(&mut self, name: &str) {
        let id = self.id(name);
        self.push(format_args!("<g id=\"{id}\">"));
        self.title(name);
    }

    fn title(&mut self, title: &str) {
        self.text.push_str("<title>");
        push_escaped(&mut self.text, title);
        self.text.push_str("</title>\n");
    }

    fn push(&mut self, text: std::fmt::Arguments) {
        // Writing to a string cannot fail.
        let _ = self.text.write_fmt(text);
    }

    /// A name made an id that nothing else has: what cannot stand in one becomes `_`.
    fn id(&mut self, name: &str) -> String {
        let is_start = |c: char| c.is_ascii_alphabetic() || c == '_' || is_letter_beyond_ascii(c);
        let mut id = String::new();
        for c in name.chars() {
            let fits = is_start(c) || c.is_ascii_digit() || c == '-' || c == '.';
            if id.is_empty() && !is_start(c) {
                id.push('_');
            }
            if fits {
                id.push(c);
            } else if !id.ends_with('_') {
                id.push('_');
            }
        }
        if id.is_empty() {
            id.push('_');
        }
        let mut unique = id.clone();
        let mut count = 1;
        while !self.ids.insert(unique.clone()) {
            count += 1;
            unique = format!("{id}-{count}");
        }
        unique
    }

    /// The data of a path: relative commands, with no more separators than needed.
    fn path(&mut self, rings: &[Vec<Point>], closed: bool) {
        self.path_from([0, 0], rings, closed);
    }

    /// Goes on with a path from where it is, and returns where it is then.
    fn path_from(&mut self, mut start: Point, rings: &[Vec<Point>], closed: bool) -> Point {
        for ring in rings {
            let first = if closed { shortest(start, ring) } else { 0 };
            let [before, after] = [&ring[..first], &ring[first..]];
            self.text.push('m');
            self.numbers(&[after[0][0] - start[0], after[0][1] - start[1]], true);
            let mut at = after[0];
            // Pairs after `m` and `l` go on as lines.
            let mut is_line = true;
            for &point in after[1..].iter().chain(before) {
                let step = [point[0] - at[0], point[1] - at[1]];
                at = point;
                match step {
                    [along, 0] => {
                        self.text.push('h');
                        self.numbers(&[along], true);
                        is_line = false;
                    }
                    [0, along] => {
                        self.text.push('v');
                        self.numbers(&[along], true);
                        is_line = false;
                    }
                    _ => {
                        if !is_line {
                            self.text.push('l');
                        }
                        self.numbers(&step, !is_line);
                        is_line = true;
                    }
                }
            }
            start = at;
            if closed {
                self.text.push('z');
                // It goes back there.
                start = after[0];
            }
        }
        start
    }

    /// Appends numbers; `after_letter` says that nothing needs to part the first from what is there.
    fn numbers(&mut self, values: &[i64], after_letter: bool) {
        for (index, &value) in values.iter().enumerate() {
            if value >= 0 && (index > 0 || !after_letter) {
                self.text.push(' ');
            }
            self.push(format_args!("{value}"));
        }
    }
}

/// The corner of a ring to begin with, for a short path that comes from `start`: the way there is written, and the
/// side before it is not, since the path closes with that.
fn shortest(start: Point, ring: &[Point]) -> usize {
    let written = |from: Point, to: Point| -> i64 {
        let steps = [to[0] - from[0], to[1] - from[1]].map(|step| {
            let digits = step.unsigned_abs().checked_ilog10().unwrap_or(0);
            // With a sign or a space before them.
            i64::from(digits) + 2
        });
        match steps {
            [along, _] if to[1] == from[1] => along,
            [_, along] if to[0] == from[0] => along,
            [across, down] => across + down,
        }
    };
    let cost = |&corner: &usize| {
        let before = ring[(corner + ring.len() - 1) % ring.len()];
        written(start, ring[corner]) - written(before, ring[corner])
    };
    (0..ring.len()).min_by_key(cost).unwrap_or(0)
}

/// Letters that XML names may have, of those beyond ASCII: what Unicode calls letters within the ranges
/// of XML 1.0, fifth edition.
fn is_letter_beyond_ascii(c: char) -> bool {
    matches!(c, '\u{c0}'..='\u{2ff}' | '\u{370}'..='\u{1fff}' | '\u{3001}'..='\u{d7ff}')
        && c.is_alphabetic()
}

/// Text of XML 1.0. What it cannot hold (control characters) becomes the replacement character.
fn push_escaped(text: &mut String, name: &str) {
    for c in name.chars() {
        match c {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '>' => text.push_str("&gt;"),
            '\t' | '\n' | '\r' => text.push(' '),
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => text.push('\u{fffd}'),
            c => text.push(c),
        }
    }
}

/// An 8-bit sRGB colour, in three digits if they say it.
struct Color([u8; 3]);

impl std::fmt::Display for Color {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [r, g, b] = self.0;
        if self.0.iter().all(|channel| channel % 17 == 0) {
            write!(f, "#{:x}{:x}{:x}", r / 17, g / 17, b / 17)
        } else {
            write!(f, "#{r:02x}{g:02x}{b:02x}")
        }
    }
}
