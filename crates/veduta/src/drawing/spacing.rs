//! Strokes -> strokes of which hidden ones keep away from others.
//!
//! Of a machine with parts within parts, hidden lines would fill the picture. Drawings on paper keep parallel lines
//! apart (ISO 128-20 wants 0.7 mm). So a hidden line is left out where another runs beside it nearer than that: one
//! that is seen, or a hidden one of more length. What is left and is too short to be told from others is left out,
//! too.

use super::hidden::positive;
use super::{LineKind, Settings, Stroke};
use std::cmp::Reverse;
use veduta_geometry::{DVec2, cross};

/// The cosine of the angle up to which lines run beside one another, 20 degrees: curves that are far from parallel
/// are told apart, and those cut into chords are not.
const PARALLEL: f64 = 0.94;

/// The side in pixels of the cells by which lines are found; at least the spacing.
const CELL: f64 = 16.0;

/// Leaves out what is hidden and too near to other lines, or too short.
pub(super) fn kept(strokes: Vec<Stroke>, settings: &Settings) -> Vec<Stroke> {
    let (hidden, seen): (Vec<Stroke>, Vec<Stroke>) = strokes
        .into_iter()
        .partition(|stroke| stroke.kind == LineKind::Hidden);
    let is_long = |stroke: &Stroke| length(stroke) >= settings.shortest_hidden;
    if settings.hidden_spacing <= 0.0 {
        return hidden.into_iter().filter(is_long).chain(seen).collect();
    }
    let mut lines = Lines::new(settings.hidden_spacing, hidden.iter().chain(&seen));
    for stroke in &seen {
        lines.push(stroke);
    }
    // The longest first; of equal ones the first.
    let mut order: Vec<&Stroke> = hidden.iter().collect();
    order.sort_by_key(|stroke| Reverse(length(stroke).to_bits()));
    let mut kept = Vec::new();
    for stroke in order {
        let parts: Vec<Stroke> = lines.away(stroke).into_iter().filter(is_long).collect();
        for part in &parts {
            lines.push(part);
        }
        kept.extend(parts);
    }
    kept.into_iter().chain(seen).collect()
}

fn length(stroke: &Stroke) -> f64 {
    segments(stroke)
        .map(|[from, to]| (to - from).length())
        .sum()
}

fn segments(stroke: &Stroke) -> impl Iterator<Item = [DVec2; 2]> {
    let points = &stroke.points;
    let count = points.len() - usize::from(!stroke.closed);
    (0..count).map(|k| [points[k], points[(k + 1) % points.len()]])
}

/// Lines that others are to keep away from.
struct Lines {
    spacing: f64,
    cell: f64,
    low: DVec2,
    columns: usize,
    /// By cell, rows of `segments`.
    in_cells: Vec<Vec<u32>>,
    segments: Vec<[DVec2; 2]>,
}

impl Lines {
    /// None yet; of those strokes and parts of them there may be some.
    fn new<'a>(spacing: f64, strokes: impl Iterator<Item = &'a Stroke> + Clone) -> Self {
        let points = strokes.flat_map(|stroke| stroke.points.iter().copied());
        let low = points.clone().fold(DVec2::INFINITY, DVec2::min);
        let high = points.fold(low, DVec2::max);
        let cell = CELL.max(spacing);
        let cells = ((high - low) / cell).max(DVec2::ZERO).floor();
        let [columns, rows] = [cells.x as usize + 1, cells.y as usize + 1];
        Self {
            spacing,
            cell,
            low,
            columns,
            in_cells: vec![Vec::new(); columns * rows],
            segments: Vec::new(),
        }
    }

    /// The cells that a segment and what is near it may lie in.
    fn cells(&self, [from, to]: [DVec2; 2]) -> impl Iterator<Item = usize> + use<> {
        let rows = self.in_cells.len() / self.columns;
        let at = |point: DVec2| ((point - self.low) / self.cell).max(DVec2::ZERO);
        let low = at(from.min(to) - self.spacing);
        let high = at(from.max(to) + self.spacing);
        let columns = self.columns;
        let range =
            |low: f64, high: f64, count: usize| low as usize..(high as usize + 1).min(count);
        let across = range(low.x, high.x, columns);
        range(low.y, high.y, rows)
            .flat_map(move |row| across.clone().map(move |column| row * columns + column))
    }

    fn push(&mut self, stroke: &Stroke) {
        for segment in segments(stroke) {
            let index = self.segments.len() as u32;
            self.segments.push(segment);
            for cell in self.cells(segment) {
                self.in_cells[cell].push(index);
            }
        }
    }

    /// The parts of a stroke that none of these lines runs beside.
    fn away(&self, stroke: &Stroke) -> Vec<Stroke> {
        let beside: Vec<Vec<[f64; 2]>> = segments(stroke).map(|ends| self.beside(ends)).collect();
        if beside.iter().all(Vec::is_empty) {
            return vec![stroke.clone()];
        }
        let mut parts: Vec<Vec<DVec2>> = vec![Vec::new()];
        for ([from, to], beside) in segments(stroke).zip(&beside) {
            let starts = [0.0].into_iter().chain(beside.iter().map(|part| part[1]));
            let ends = beside.iter().map(|part| part[0]).chain([1.0]);
            for (start, end) in starts.zip(ends) {
                if start > 0.0 {
                    parts.push(Vec::new());
                }
                if end > start {
                    let part = parts.last_mut().expect("there is always one");
                    if part.is_empty() {
                        part.push(from.lerp(to, start));
                    }
                    part.push(from.lerp(to, end));
                }
            }
        }
        parts.retain(|points| points.len() > 1);
        let part = |points| Stroke {
            kind: stroke.kind,
            points,
            closed: false,
        };
        parts.into_iter().map(part).collect()
    }

    /// Where lines run beside a segment, in shares of its length: ascending, apart from one another.
    fn beside(&self, segment @ [from, to]: [DVec2; 2]) -> Vec<[f64; 2]> {
        let mut near: Vec<u32> = self
            .cells(segment)
            .flat_map(|cell| self.in_cells[cell].iter().copied())
            .collect();
        near.sort_unstable();
        near.dedup();
        let along = (to - from).normalize_or_zero();
        let mut parts: Vec<[f64; 2]> = near
            .into_iter()
            .filter_map(|line| {
                let [start, end] = self.segments[line as usize];
                let direction = (end - start).normalize_or_zero();
                if along.dot(direction).abs() < PARALLEL {
                    return None;
                }
                let reach = (end - start).length();
                let ahead = |point: DVec2| (point - start).dot(direction);
                let aside = |point: DVec2| cross(direction, point - start);
                let mut part = [0.0, 1.0];
                part = positive(part, ahead(from), ahead(to))?;
                part = positive(part, reach - ahead(from), reach - ahead(to))?;
                part = positive(part, self.spacing - aside(from), self.spacing - aside(to))?;
                positive(part, self.spacing + aside(from), self.spacing + aside(to))
            })
            .collect();
        parts.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let mut joined: Vec<[f64; 2]> = Vec::new();
        for part in parts {
            match joined.last_mut() {
                Some(last) if part[0] <= last[1] => last[1] = last[1].max(part[1]),
                _ => joined.push(part),
            }
        }
        joined
    }
}
