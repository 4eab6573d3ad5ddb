//! Samples that overlap: split, merged and laid flat.

use crate::{Random, channels};
use half::f16;
use veduta_io::deep_exr::{
    DeepHeader, DeepImage, DeepPixels, MergeError, SampleType, Samples, merge,
};

/// A sample: front, back, opacity, premultiplied red, id.
type Sample = (f32, f32, f32, f32, u32);

/// A row of pixels with channels A, R, Z, ZBack and id.
fn row(pixels: &[Vec<Sample>]) -> DeepImage {
    let all: Vec<&Sample> = pixels.iter().flatten().collect();
    let float = |of: fn(&Sample) -> f32| Samples::Float(all.iter().map(|s| of(s)).collect());
    let columns = vec![
        float(|s| s.2),
        float(|s| s.3),
        float(|s| s.0),
        float(|s| s.1),
        Samples::Uint(all.iter().map(|s| s.4).collect()),
    ];
    let header = DeepHeader::new(
        pixels.len() as u32,
        1,
        channels([
            ("A", SampleType::Float),
            ("R", SampleType::Float),
            ("Z", SampleType::Float),
            ("ZBack", SampleType::Float),
            ("id", SampleType::Uint),
        ]),
    );
    let counts = pixels.iter().map(|samples| samples.len() as u32);
    let pixels = DeepPixels::from_counts(pixels.len(), counts, columns);
    DeepImage { header, pixels }
}

fn samples_of(image: &DeepImage, pixel: usize) -> Vec<Sample> {
    let channels = image.pixels.channels();
    let value = |channel: usize, sample| channels[channel].value(sample);
    let range = image.pixels.samples_of(pixel);
    range
        .map(|s| {
            let [a, r, z, b] = [0, 1, 2, 3].map(|channel| value(channel, s) as f32);
            (z, b, a, r, value(4, s) as u32)
        })
        .collect()
}

/// Red and opacity of the only pixel.
fn flat(samples: &[Sample]) -> [f32; 2] {
    let picture = row(&[samples.to_vec()]).flatten();
    let [r, _, _, a] = picture.expect("depth and opacity").pixels[0];
    [r, a]
}

fn assert_near(found: [f32; 2], expected: [f32; 2], case: &str) {
    let off = (found[0] - expected[0])
        .abs()
        .max((found[1] - expected[1]).abs());
    assert!(off < 1e-6, "{case}: {found:?} is not {expected:?}");
}

#[test]
fn nearer_samples_are_laid_over_farther_ones_whatever_their_order() {
    let near = (1.0, 1.0, 0.5, 0.1, 1);
    let far = (2.0, 2.0, 1.0, 0.8, 2);
    let expected = [0.1 + 0.5 * 0.8, 1.0];
    assert_near(flat(&[near, far]), expected, "sorted");
    assert_near(flat(&[far, near]), expected, "not sorted");
    assert_near(flat(&[]), [0.0, 0.0], "nothing");
}

#[test]
fn a_wall_in_the_middle_of_fog_is_seen_through_half_of_it() {
    // Fog that lets a quarter through lets half through half of it.
    let fog = (2.0, 4.0, 0.75, 0.3, 1);
    let wall = (3.0, 3.0, 1.0, 0.8, 2);
    let half_of_fog = 0.3 * 0.5 / 0.75;
    assert_near(
        flat(&[fog, wall]),
        [half_of_fog + 0.5 * 0.8, 1.0],
        "half way",
    );
    assert_near(
        flat(&[wall, fog]),
        [half_of_fog + 0.5 * 0.8, 1.0],
        "other order",
    );
    let behind = (4.0, 4.0, 1.0, 0.8, 2);
    assert_near(flat(&[fog, behind]), [0.3 + 0.25 * 0.8, 1.0], "behind");
    let before = (2.0, 2.0, 1.0, 0.8, 2);
    assert_near(flat(&[fog, before]), [0.8, 1.0], "before");
}

#[test]
fn two_fogs_in_one_place_are_as_many_thin_slices_of_both_in_turn() {
    let (a, b) = ((0.0, 1.0, 0.75, 0.3, 1), (0.0, 1.0, 0.5, 0.5, 2));
    let slices = 20_000;
    let (mut color, mut through) = (0.0_f64, 1.0_f64);
    for _ in 0..slices {
        for (_, _, alpha, red, _) in [a, b] {
            let slice = 1.0 - (1.0 - f64::from(alpha)).powf(1.0 / f64::from(slices));
            color += through * f64::from(red) * slice / f64::from(alpha);
            through *= 1.0 - slice;
        }
    }
    let found = flat(&[a, b]);
    assert!(
        (f64::from(found[0]) - color).abs() < 1e-4,
        "{found:?}, {color}"
    );
    assert!((f64::from(found[1]) - (1.0 - through)).abs() < 1e-6);
}

#[test]
fn opaque_samples_in_one_place_are_mixed_in_equal_shares() {
    let at = |red: f32, id| (1.0, 1.0, 1.0, red, id);
    assert_near(flat(&[at(0.2, 1), at(0.4, 2)]), [0.3, 1.0], "two");
    assert_near(
        flat(&[at(0.2, 1), at(0.4, 2), at(0.9, 3)]),
        [0.5, 1.0],
        "three",
    );
    // What lets light through adds nothing to what does not.
    assert_near(
        flat(&[at(0.2, 1), (1.0, 1.0, 0.5, 0.4, 2)]),
        [0.2, 1.0],
        "one",
    );
}

#[test]
fn faint_samples_keep_their_colour() {
    let faint = |front: f32| (front, front + 2.0, 1e-12_f32, 0.25_f32, 1);
    let [red, alpha] = flat(&[faint(0.0), faint(1.0)]);
    assert!(
        (red - 0.5).abs() < 1e-6 && (alpha - 2e-12).abs() < 1e-15,
        "{red} {alpha}"
    );
    let clear = |front: f32| (front, front + 2.0, 0.0_f32, 0.25_f32, 1);
    assert_near(
        flat(&[clear(0.0), clear(1.0)]),
        [0.5, 0.0],
        "light without opacity",
    );
}

#[test]
fn samples_of_no_sense_do_no_harm() {
    let wall = (2.0, 2.0, 1.0, 0.5, 1);
    let nan = f32::NAN;
    let infinite = f32::INFINITY;
    for odd in [
        (nan, nan, 1.0, 0.9, 2),
        (infinite, infinite, 1.0, 0.9, 2),
        (3.0, nan, 1.0, 0.9, 2),
        (3.0, infinite, 1.0, 0.9, 2),
        (3.0, 1.0, 1.0, 0.9, 2),
        (2.5, 2.5, nan, 0.9, 2),
    ] {
        assert_near(flat(&[odd, wall]), [0.5, 1.0], &format!("{odd:?}"));
        assert_near(flat(&[wall, odd]), [0.5, 1.0], &format!("{odd:?}"));
    }
    let zeros = [(0.0, 0.0, 0.5, 0.1, 1), (-0.0, 1.0, 0.5, 0.2, 2)];
    assert_near(flat(&zeros), [0.2, 0.75], "the point comes first");
}

/// The procedure of the document to the letter: split pairs until nothing overlaps partly, merge pairs
/// until nothing coincides, sort.
fn tidy_by_pairs(samples: &[Sample]) -> Vec<[f64; 4]> {
    let mut all: Vec<[f64; 4]> = samples
        .iter()
        .map(|&(z, b, a, c, _)| [z, b.max(z), a, c].map(f64::from))
        .collect();
    let part = |[_, _, a, c]: [f64; 4], share: f64| {
        if a == 1.0 {
            return [a, c];
        }
        let part = -(share * (-a).ln_1p()).exp_m1();
        [part, if a > 0.0 { c * part / a } else { c * share }]
    };
    'again: loop {
        for j in 0..all.len() {
            let sample = all[j];
            let [front, back, ..] = sample;
            let inside = |z: &f64| front < *z && *z < back;
            let cut = all
                .iter()
                .flat_map(|other| [other[0], other[1]])
                .find(inside);
            if let Some(z) = cut {
                let share = (z - front) / (back - front);
                let [a, c] = part(sample, share);
                all[j] = [front, z, a, c];
                let [a, c] = part(sample, 1.0 - share);
                all.push([z, back, a, c]);
                continue 'again;
            }
        }
        break;
    }
    'again: loop {
        for i in 0..all.len() {
            for j in i + 1..all.len() {
                if all[i][..2] != all[j][..2] {
                    continue;
                }
                let ([_, _, a, c], [_, _, b, d]) = (all[i], all[j]);
                // The sum of three may round one to a little less.
                let alpha = if a == 1.0 || b == 1.0 {
                    1.0
                } else {
                    a + b - a * b
                };
                let color = match (a == 1.0, b == 1.0) {
                    (true, true) => 0.5 * (c + d),
                    (true, false) => c,
                    (false, true) => d,
                    _ => {
                        let [u, v] = [a, b].map(|alpha: f64| -(-alpha).ln_1p());
                        let ratio = |u: f64, a: f64| if a > 0.0 { u / a } else { 1.0 };
                        let w = if u + v > 0.0 { alpha / (u + v) } else { 1.0 };
                        w * (c * ratio(u, a) + d * ratio(v, b))
                    }
                };
                all[i][2..].copy_from_slice(&[alpha, color]);
                all.remove(j);
                continue 'again;
            }
        }
        break;
    }
    all.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    all
}

/// Pixels of points and volumes on few depths, so that they overlap in every way.
fn random_pixel(random: &mut Random) -> Vec<Sample> {
    (0..random.below(7))
        .map(|_| {
            let front = random.below(5) as f32;
            let back = front + random.below(4) as f32;
            // Of one opaque colour, since the document tells the mean of two only.
            let (alpha, red) = match random.below(4) {
                0 => (1.0, 0.7),
                1 => (0.0, 0.0),
                _ => {
                    let alpha = random.unit();
                    (alpha, alpha * random.unit())
                }
            };
            (front, back, alpha, red, random.below(1000) as u32)
        })
        .collect()
}

#[test]
fn one_sweep_does_what_splitting_and_merging_pairs_does() {
    let mut random = Random(7);
    for case in 0..3000 {
        let pixel = random_pixel(&mut random);
        let expected = tidy_by_pairs(&pixel);
        let (a, b) = pixel.split_at(random.below(pixel.len() + 1));
        let merged = merge(&[&row(&[a.to_vec()]), &row(&[b.to_vec()])]).expect("alike");
        let found = samples_of(&merged, 0);
        assert_eq!(found.len(), expected.len(), "case {case}: {pixel:?}");
        for (&(z, back, alpha, red, _), due) in found.iter().zip(&expected) {
            let off = [z, back, alpha, red].map(f64::from);
            let off = off.iter().zip(due).map(|(a, b)| (a - b).abs());
            assert!(
                off.fold(0.0, f64::max) < 1e-6,
                "case {case}: {found:?}, {expected:?}"
            );
        }
    }
}

#[test]
fn pictures_merge_to_the_same_in_any_order_and_grouping() {
    let mut random = Random(11);
    for case in 0..500 {
        let images = [0, 1, 2].map(|_| row(&[random_pixel(&mut random)]));
        let [a, b, c] = &images;
        let at_once = merge(&[a, b, c]).expect("alike");
        let in_turn = merge(&[&merge(&[c, a]).expect("alike"), b]).expect("alike");
        let [x, y] = [&at_once, &in_turn].map(|image| image.flatten().expect("depth").pixels[0]);
        for (x, y) in x.into_iter().zip(y) {
            assert!((x - y).abs() < 1e-5, "case {case}: {x} and {y}");
        }
        // What is tidy stays what it is.
        let again = merge(&[&at_once]).expect("alike");
        assert_eq!(again.pixels, at_once.pixels, "case {case}");
    }
}

#[test]
fn ids_are_kept_and_where_samples_are_merged_the_earlier_pictures() {
    let fog = |front: f32, id| (front, front + 2.0, 0.5, 0.1, id);
    let merged = merge(&[&row(&[vec![fog(0.0, 7)]]), &row(&[vec![fog(1.0, 9)]])]);
    let ids: Vec<u32> = samples_of(&merged.expect("alike"), 0)
        .iter()
        .map(|s| s.4)
        .collect();
    assert_eq!(ids, [7, 7, 9], "alone, both, alone");
}

#[test]
fn a_pixel_of_a_hundred_thousand_fogs_is_made_flat_in_a_moment() {
    // Pairwise that would be ten thousand million splits.
    let count = 100_000;
    let fog = |k: u32| (k as f32, (count + k) as f32, 1e-5, 1e-5, k);
    let all: Vec<Sample> = (0..count).map(fog).collect();
    let begin = std::time::Instant::now();
    let [red, alpha] = flat(&all);
    let expected = 1.0 - (f64::from(count) * (-1e-5_f64).ln_1p()).exp();
    assert!(
        (f64::from(alpha) - expected).abs() < 1e-4,
        "{alpha}, {expected}"
    );
    assert!((f64::from(red) - expected).abs() < 1e-4, "{red}");
    assert!(begin.elapsed().as_secs() < 30, "{:?}", begin.elapsed());
}

#[test]
fn windows_are_united_and_types_widened() {
    let mut a = row(&[vec![(1.0, 1.0, 0.5, 0.1, 1)]]);
    let mut b = row(&[vec![(2.0, 2.0, 1.0, 0.8, 2)], vec![(3.0, 3.0, 1.0, 0.4, 3)]]);
    for image in [&mut a, &mut b] {
        image.header.display_window.max = [9, 9];
    }
    a.header.data_window.min = [4, 5];
    a.header.data_window.max = [4, 5];
    b.header.data_window.min = [4, 5];
    b.header.data_window.max = [5, 5];
    // The first picture's red in half floats.
    let columns = a.pixels.channels();
    let halves = vec![
        columns[0].clone(),
        Samples::Half(vec![f16::from_f32(0.1)]),
        columns[2].clone(),
        columns[3].clone(),
        columns[4].clone(),
    ];
    a.pixels = DeepPixels::from_counts(1, [1], halves);
    a.header.channels[1].sample_type = SampleType::Half;
    b.header.data_window.min = [3, 4];
    b.header.data_window.max = [4, 4];
    let merged = merge(&[&a, &b]).expect("alike");
    assert_eq!(merged.header.data_window.min, [3, 4]);
    assert_eq!(merged.header.data_window.max, [4, 5]);
    assert_eq!(merged.header.channels[1].sample_type, SampleType::Float);
    let counts = [0, 1, 2, 3].map(|pixel| merged.pixels.samples_of(pixel).len());
    assert_eq!(counts, [1, 1, 0, 1]);
}

#[test]
fn pictures_that_do_not_fit_are_refused_with_what_differs() {
    let a = row(&[vec![]]);
    let mut other_frame = a.clone();
    other_frame.header.display_window.max = [5, 5];
    let error = merge(&[&a, &other_frame]).expect_err("another frame");
    assert!(
        matches!(error, MergeError::Frames { index: 1, .. }),
        "{error}"
    );
    let mut other_channels = a.clone();
    other_channels.header.channels[1].name = "S".to_owned();
    let error = merge(&[&a, &other_channels]).expect_err("other channels");
    assert!(
        error.to_string().contains("A (Float), S (Float)"),
        "{error}"
    );
    let mut no_depth = a.clone();
    no_depth.header.channels[2].name = "Y".to_owned();
    assert_eq!(
        merge(&[&no_depth]).expect_err("no depth"),
        MergeError::NoDepth
    );
}

#[test]
fn colours_with_opacities_of_their_own_are_laid_over_by_them() {
    let float = SampleType::Float;
    let names = [
        ("AB", float),
        ("AG", float),
        ("AR", float),
        ("B", float),
        ("G", float),
        ("R", float),
        ("Z", float),
    ];
    let of = |values: [f32; 2]| Samples::Float(values.to_vec());
    let columns = vec![
        of([0.25, 1.0]),
        of([0.5, 1.0]),
        of([1.0, 1.0]),
        of([0.1, 0.9]),
        of([0.1, 0.9]),
        of([0.1, 0.9]),
        of([1.0, 2.0]),
    ];
    let image = DeepImage {
        header: DeepHeader::new(1, 1, channels(names)),
        pixels: DeepPixels::from_counts(1, [2], columns),
    };
    let [r, g, b, a] = image.flatten().expect("depth and opacity").pixels[0];
    assert_near([r, g], [0.1, 0.1 + 0.5 * 0.9], "red is not let through");
    assert_near([b, a], [0.1 + 0.75 * 0.9, 1.0], "blue");
}

#[test]
fn the_first_layer_with_colours_is_the_picture_where_the_base_has_none() {
    let float = SampleType::Float;
    let names = [
        ("Z", float),
        ("view.A", float),
        ("view.B", float),
        ("view.G", float),
        ("view.R", float),
    ];
    let of = |value: f32| Samples::Float(vec![value]);
    let columns = vec![of(1.0), of(0.5), of(0.1), of(0.2), of(0.3)];
    let image = DeepImage {
        header: DeepHeader::new(1, 1, channels(names)),
        pixels: DeepPixels::from_counts(1, [1], columns),
    };
    let picture = image.flatten().expect("depth and opacity");
    assert_eq!(picture.pixels[0], [0.3, 0.2, 0.1, 0.5]);
    let grey = DeepImage {
        header: DeepHeader::new(1, 1, channels([("A", float), ("Y", float), ("Z", float)])),
        pixels: DeepPixels::from_counts(1, [1], vec![of(0.5), of(0.25), of(1.0)]),
    };
    let picture = grey.flatten().expect("depth and opacity");
    assert_eq!(picture.pixels[0], [0.25, 0.25, 0.25, 0.5]);
}
