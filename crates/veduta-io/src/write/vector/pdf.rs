use super::outline::{Point, Rounding};
use super::{VectorOptions, hidden_line, name_of_lines, srgb8, thousandths};
use crate::deflate::deflate;
use pdf_writer::{Array, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use std::collections::BTreeSet;
use std::fmt::Write;
use veduta::drawing::{Chain, Drawing, LineKind, Rim, Underpainting};
use veduta_geometry::DVec2;

/// Points (1/72 inch) of a pixel, of which CSS has 96 to an inch.
const POINTS_PER_PIXEL: f64 = 0.75;

/// How hard to compress, of 10.
const COMPRESSION: i32 = 9;

/// A PDF of one page. Groups are optional content groups, which viewers list as layers; a part of
/// the page within the marks of its group and of all around it shows when all of them are on.
///
/// Colours are DeviceRGB, which viewers take for sRGB.
///
/// What is seen through the outline of the underpainting is a transparency group with a soft mask. A clip
/// would be smoothed anew for each path within.
pub fn encode(drawing: &Drawing, options: &VectorOptions) -> Vec<u8> {
    let mut layers = Layers::default();
    let Streams { page: text, masked } = streams(drawing, options, &mut layers);
    let compressed = |text: &str| deflate(text.as_bytes(), COMPRESSION);

    let [catalog, pages, page, stream, document, group, mask, names] =
        [1, 2, 3, 4, 5, 6, 7, 8].map(Ref::new);
    let layer_ref = |index: usize| Ref::new(9 + index as i32);
    let mut pdf = Pdf::new();
    pdf.set_version(1, 7);
    {
        let mut catalog = pdf.catalog(catalog);
        catalog.pages(pages);
        let mut optional = catalog.insert(Name(b"OCProperties")).dict();
        let all = (0..layers.layers.len()).map(layer_ref);
        optional.insert(Name(b"OCGs")).array().items(all);
        let mut usual = optional.insert(Name(b"D")).dict();
        layers.push_children(None, &mut usual.insert(Name(b"Order")).array(), &layer_ref);
    }
    pdf.pages(pages).kids([page]).count(1);
    {
        let mut page = pdf.page(page);
        let [width, height] = drawing.size.map(|side| (side * POINTS_PER_PIXEL) as f32);
        page.parent(pages);
        page.media_box(Rect::new(0.0, 0.0, width, height));
        page.contents(stream);
        let mut resources = page.resources();
        resources.pair(Name(b"Properties"), names);
        if masked.is_some() {
            resources.x_objects().pair(Name(GROUP.as_bytes()), group);
        }
        let mut states = resources.ext_g_states();
        if masked.is_some() {
            let mut state = states.insert(Name(MASK.as_bytes())).dict();
            let mut soft_mask = state.insert(Name(b"SMask")).dict();
            soft_mask.pair(Name(b"S"), Name(b"Alpha"));
            soft_mask.pair(Name(b"G"), mask);
        }
        for opacity in opacities(drawing) {
            let mut state = states.insert(Name(state_name(opacity).as_bytes())).dict();
            state.pair(Name(b"ca"), opacity as f32 / 1000.0);
        }
    }
    pdf.stream(stream, &compressed(&text))
        .filter(Filter::FlateDecode)
        .finish();
    if let Some(parts) = &masked {
        for (reference, text) in [group, mask].into_iter().zip(parts) {
            let compressed = compressed(text);
            let mut form = pdf.form_xobject(reference, &compressed);
            form.filter(Filter::FlateDecode);
            let [width, height] = drawing.size.map(|side| side as f32);
            form.bbox(Rect::new(0.0, 0.0, width, height));
            let mut transparency = form.group();
            transparency.transparency().isolated(true);
            transparency.color_space().device_rgb();
            transparency.finish();
            form.resources().pair(Name(b"Properties"), names);
        }
    }
    {
        let mut properties = pdf.indirect(names).dict();
        for index in 0..layers.layers.len() {
            properties.pair(Name(resource_name(index).as_bytes()), layer_ref(index));
        }
    }
    {
        let mut told = pdf.document_info(document);
        told.producer(TextStr("Veduta"));
        if !options.title.is_empty() {
            told.title(TextStr(&options.title));
        }
    }
    for (index, layer) in layers.layers.iter().enumerate() {
        pdf.indirect(layer_ref(index))
            .dict()
            .pair(Name(b"Type"), Name(b"OCG"))
            .pair(Name(b"Name"), TextStr(&layer.name));
    }
    pdf.finish()
}

/// The layers of the document, parents before children.
#[derive(Default)]
struct Layers {
    layers: Vec<Layer>,
}

struct Layer {
    name: String,
    children: Vec<usize>,
    is_root: bool,
}

impl Layers {
    fn push(&mut self, name: &str, parent: Option<usize>) -> usize {
        let index = self.layers.len();
        if let Some(parent) = parent {
            self.layers[parent].children.push(index);
        }
        self.layers.push(Layer {
            name: name.to_owned(),
            children: Vec::new(),
            is_root: parent.is_none(),
        });
        index
    }

    /// Lists layers as they are nested: after each the array of its children, if it has any. What is
    /// painted last comes first, as in programs for drawing.
    fn push_children(
        &self,
        parent: Option<usize>,
        order: &mut Array,
        layer_ref: &impl Fn(usize) -> Ref,
    ) {
        let children: Vec<usize> = match parent {
            Some(parent) => self.layers[parent].children.clone(),
            None => (0..self.layers.len())
                .filter(|&index| self.layers[index].is_root)
                .collect(),
        };
        for &child in children.iter().rev() {
            order.item(layer_ref(child));
            if !self.layers[child].children.is_empty() {
                self.push_children(Some(child), &mut order.push().array(), layer_ref);
            }
        }
    }
}

/// By which the page's content knows a layer.
fn resource_name(layer: usize) -> String {
    format!("G{layer}")
}

/// The opacities of veils, in thousandths.
fn opacities(drawing: &Drawing) -> BTreeSet<i64> {
    let veils = drawing.veils.iter();
    veils.map(|veil| thousandths(veil.opacity)).collect()
}

/// By which the page's content knows an opacity.
fn state_name(opacity: i64) -> String {
    format!("A{opacity}")
}

/// By which the page's content knows what is seen through the outline.
const GROUP: &str = "Opaque";

/// By which it knows the outline.
const MASK: &str = "Outline";

/// Content, not compressed.
struct Streams {
    page: String,
    /// What is seen through the outline, and the outline, if there is one.
    masked: Option<[String; 2]>,
}

fn streams(drawing: &Drawing, options: &VectorOptions, layers: &mut Layers) -> Streams {
    let mut content = Content::new(options);
    let height = drawing.size[1] * POINTS_PER_PIXEL;
    // From here on in pixels, y downwards.
    content.push(format_args!(
        "{POINTS_PER_PIXEL} 0 0 -{POINTS_PER_PIXEL} 0 {height} cm\n"
    ));
    if let Some(color) = options.background {
        content.frame(drawing.size, color);
    }
    let beneath = drawing.underpainting.as_ref();
    let outline = beneath.and_then(|beneath| beneath.outline.as_ref());
    let masked = outline.map(|outline| {
        let [mut group, mut mask] = [(); 2].map(|()| Content::new(options));
        group.opaque(drawing, layers);
        mask.shape(outline, [0.0; 3]);
        content.push(format_args!("q /{MASK} gs /{GROUP} Do Q\n"));
        [group.text, mask.text]
    });
    if masked.is_none() {
        content.opaque(drawing, layers);
    }
    if !drawing.veils.is_empty() {
        content.veils(drawing, layers);
    }
    if !drawing.strokes.is_empty() {
        content.lines(drawing, options, layers);
    }
    Streams {
        page: content.text,
        masked,
    }
}

/// Content of the page or a part of it (ISO 32000-1, 8 and 14.6).
struct Content {
    text: String,
    rounding: Rounding,
    /// The colour that fills now.
    fill: Option<[u8; 3]>,
}

impl Content {
    fn new(options: &VectorOptions) -> Self {
        Self {
            text: String::new(),
            rounding: Rounding::new(options.decimals),
            fill: None,
        }
    }

    /// Underpainting and shapes.
    fn opaque(&mut self, drawing: &Drawing, layers: &mut Layers) {
        if let Some(underpainting) = &drawing.underpainting {
            self.frame(drawing.size, underpainting.radiance);
            self.rims(underpainting);
        }
        let mut open: Vec<u32> = Vec::new();
        for (index, group) in (0u32..).zip(&drawing.groups) {
            while open.last().copied() != group.parent {
                open.pop();
                self.text.push_str("EMC\n");
            }
            open.push(index);
            // Layers and groups begin with the same rows.
            let layer = layers.push(&group.name, group.parent.map(|parent| parent as usize));
            self.begin_layer(layer);
            for shape in &drawing.shapes[group.shapes.clone()] {
                self.shape(&shape.painted, shape.radiance);
            }
        }
        for _ in open {
            self.text.push_str("EMC\n");
        }
    }

    /// Fills the frame.
    fn frame(&mut self, [width, height]: [f64; 2], radiance: [f32; 3]) {
        self.fill(srgb8(radiance));
        self.push(format_args!("0 0 {width} {height} re f\n"));
    }

    fn rims(&mut self, underpainting: &Underpainting) {
        let width = underpainting.rim_width;
        // Round caps and joins.
        self.push(format_args!("q {width} w 1 J 1 j\n"));
        for Rim { radiance, chains } in &underpainting.rims {
            self.color(srgb8(*radiance), "RG");
            for Chain { points, closed } in chains {
                if let Some(chain) = self.rounding.line(points, *closed) {
                    self.stroke(&chain, *closed);
                }
            }
        }
        self.text.push_str("Q\n");
    }

    fn push(&mut self, text: std::fmt::Arguments) {
        // Writing to a string cannot fail.
        let _ = self.text.write_fmt(text);
    }

    fn begin_layer(&mut self, layer: usize) {
        let name = resource_name(layer);
        self.push(format_args!("/OC /{name} BDC\n"));
    }

    fn color(&mut self, color: [u8; 3], operator: &str) {
        for channel in color {
            // Three decimals tell each of the 256 values.
            let value = (f64::from(channel) / 0.255).round() as i64;
            Rounding::new(3).push(&mut self.text, value);
            self.text.push(' ');
        }
        self.push(format_args!("{operator}\n"));
    }

    fn fill(&mut self, color: [u8; 3]) {
        if self.fill != Some(color) {
            self.fill = Some(color);
            self.color(color, "rg");
        }
    }

    fn shape(&mut self, outlines: &[Vec<DVec2>], radiance: [f32; 3]) {
        let rings = self.rounding.rings(outlines);
        if !rings.is_empty() {
            self.fill(srgb8(radiance));
            for ring in &rings {
                self.path(ring);
                self.text.push_str("h\n");
            }
            self.text.push_str("f\n");
        }
    }

    /// In layers for each stretch of one object: their order is that of depth.
    fn veils(&mut self, drawing: &Drawing, layers: &mut Layers) {
        let all = layers.push("veils", None);
        self.begin_layer(all);
        self.text.push_str("q\n");
        for of_object in drawing.veils.chunk_by(|a, b| a.object == b.object) {
            let layer = layers.push(&of_object[0].name, Some(all));
            self.begin_layer(layer);
            for veil in of_object {
                let name = state_name(thousandths(veil.opacity));
                self.push(format_args!("/{name} gs\n"));
                self.shape(&veil.outlines, veil.radiance);
            }
            self.text.push_str("EMC\n");
        }
        self.text.push_str("Q\nEMC\n");
        // As it was before.
        self.fill = None;
    }

    fn lines(&mut self, drawing: &Drawing, options: &VectorOptions, layers: &mut Layers) {
        let all = layers.push("lines", None);
        self.begin_layer(all);
        self.color(srgb8(options.line_color), "RG");
        let width = options.line_width;
        // Round caps and joins.
        self.push(format_args!("{width} w 1 J 1 j\n"));
        for strokes in drawing.strokes.chunk_by(|a, b| a.kind == b.kind) {
            let layer = layers.push(name_of_lines(strokes[0].kind), Some(all));
            self.begin_layer(layer);
            let is_hidden = strokes[0].kind == LineKind::Hidden;
            if is_hidden {
                let [narrow, dash, gap] = hidden_line(width);
                self.push(format_args!("q {narrow} w 0 J [{dash} {gap}] 0 d\n"));
            }
            for stroke in strokes {
                if let Some((chain, closed)) = self.rounding.stroke(&stroke.points, stroke.closed) {
                    self.stroke(&chain, closed);
                }
            }
            if is_hidden {
                self.text.push_str("Q\n");
            }
            self.text.push_str("EMC\n");
        }
        self.text.push_str("EMC\n");
    }

    /// A stroke in the colour and width for them.
    fn stroke(&mut self, chain: &[Point], closed: bool) {
        self.path(chain);
        self.text.push_str(if closed { "s\n" } else { "S\n" });
    }

    fn path(&mut self, points: &[Point]) {
        for (index, point) in points.iter().enumerate() {
            for &value in point {
                self.rounding.push(&mut self.text, value);
                self.text.push(' ');
            }
            self.text.push_str(if index == 0 { "m " } else { "l " });
        }
    }
}
